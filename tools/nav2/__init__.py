"""Reads the facts of a distribution of Nav2 from its sources."""
