"""Everything around the brain: the simulated world, the episodes, the money, the statistics, the reports."""
