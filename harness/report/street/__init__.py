"""What an imported street looks like: screen, page and picture."""
