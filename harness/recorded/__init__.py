"""Recorded logs: bags of ROS 1 and ROS 2 in, trajectories out."""
