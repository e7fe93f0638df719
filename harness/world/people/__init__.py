"""Models of pedestrians, recorded ones, and their bodies near the robot."""
