"""Commands for streets and fleets."""
