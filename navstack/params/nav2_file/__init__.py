"""Nav2 parameter files: read, checked, edited and written back."""
