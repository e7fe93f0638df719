"""A robot's own parameters from a log of its drive, and what that drive cost."""
