"""Localizers: from observations to a belief in the map frame."""
