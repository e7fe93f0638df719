"""Policies of the user's: what they see, where they run, and how their answers drive the robot."""
