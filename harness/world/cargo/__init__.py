"""The cargo and what is spilt of it."""
