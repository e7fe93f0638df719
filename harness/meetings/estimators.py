"""From what a margin is estimated."""

DELIVERIES, MEETINGS = ESTIMATORS = ("deliveries", "meetings")
