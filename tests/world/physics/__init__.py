"""Tests of harness.world.physics."""
