"""One delivery, from the first observation to its row."""
