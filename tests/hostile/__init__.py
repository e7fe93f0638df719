"""Malformed inputs: whatever a user receives from others ends in one clear line."""
