"""Combinations of Nav2 parameters that cause trouble on a real robot: one small function per rule, listed in ``rules.py``."""
