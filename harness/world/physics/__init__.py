"""What moves and touches: bodies, contacts, drive and ground."""
