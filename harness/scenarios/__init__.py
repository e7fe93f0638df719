"""Scenarios: short situations as data, driven in the physical world and judged by checks."""
