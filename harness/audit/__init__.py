"""The auditor: whether an optimum earns its margin, or exploits a gap of the model."""
