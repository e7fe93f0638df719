"""Around the brain: the simulated world, the episodes, the money, the statistics, the reports."""

from navstack.dispatch import pin

pin()  # before anything loads numpy
