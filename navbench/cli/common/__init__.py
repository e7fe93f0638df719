"""What several commands have in common on the screen."""
