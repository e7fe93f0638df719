"""Finished runs compared and priced anew."""
