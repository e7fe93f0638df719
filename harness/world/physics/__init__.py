"""Rigid bodies, contacts, drive and ground."""
