"""Combinations of Nav2 parameters that hurt on a real robot: one small function per rule, listed in ``rules.py``."""
