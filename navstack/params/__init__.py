"""Nav2 parameter files and our own small ones, read strictly."""
