"""Scans held against a map: by how much the believed pose is off, and how well that is known."""
