"""What a stuck robot tries: spinning, backing up, driving straight on, waiting."""
