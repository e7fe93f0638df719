"""The robot's sensors with their errors."""
