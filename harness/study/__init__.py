"""What is to be driven and what came of it."""
