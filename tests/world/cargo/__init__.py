"""Tests of harness.world.cargo."""
