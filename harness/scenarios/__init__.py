"""Scenarios: short situations written down as data, driven in the physical world and judged by named checks."""
