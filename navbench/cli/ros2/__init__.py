"""Commands that need ROS 2."""
