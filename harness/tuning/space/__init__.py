"""What a study may change: parameters, their ranges, paths and constraints."""
