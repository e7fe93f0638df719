"""Perception: what moves around the robot."""
