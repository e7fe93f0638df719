"""The door to ROS 2: a delivery driven by nodes of another program, and our brain as a node."""
