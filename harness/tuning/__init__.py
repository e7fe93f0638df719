"""Tuning a Nav2 parameter file for what its deliveries earn."""
