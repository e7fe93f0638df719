"""Tuning: what is asked for, driving it, and what is written."""
