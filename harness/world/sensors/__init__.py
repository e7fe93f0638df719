"""What the robot is told: sensors with their errors."""
