"""Scenes: generated sidewalks, imported maps, and their files."""
