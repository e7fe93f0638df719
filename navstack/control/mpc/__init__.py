"""Jerk-limited model predictive control."""
