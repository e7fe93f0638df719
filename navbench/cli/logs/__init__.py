"""Commands that read recorded drives."""
