"""A day of a fleet, simulated over deliveries that were driven."""
