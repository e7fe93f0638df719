"""What is carried, and what of it is spilt."""
