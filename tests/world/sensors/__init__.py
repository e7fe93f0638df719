"""Tests of harness.world.sensors."""
