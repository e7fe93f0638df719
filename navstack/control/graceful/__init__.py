"""The graceful controller: a smooth control law to a pose on the path."""
