"""Paths planned and checked without driving."""
