"""Combinations of Nav2 parameters that will cause trouble: one small function per rule, listed in ``rules.py``."""
