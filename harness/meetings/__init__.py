"""Margins from meetings with people, not whole deliveries."""
