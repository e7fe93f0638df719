"""Combinations of Nav2 parameters that will cause trouble.

One small function per rule, listed in ``rules.py``.
"""
