"""What developers of navbench run: measurements, checks and the studies of the documents."""
