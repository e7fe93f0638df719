"""Tests of harness.world.people."""
