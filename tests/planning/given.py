"""Maps, and measures of paths, that the tests of planners share."""

import math

import numpy as np

from navstack.costmap.costmap import Costmap


def free_map(height, width, resolution=0.1, x=0.0, y=0.0):
    """A costmap of so many free cells with its lower left corner at (x, y)."""
    return Costmap(np.zeros((height, width), dtype=np.uint8), resolution, x, y)


def step_lengths(poses):
    """Straight distances (N - 1,) between neighbouring poses (N, 2 or 3)."""
    return np.hypot(*np.diff(poses[:, :2], axis=0).T)


def turns_of(poses):
    """Changes of heading (N - 1,) between neighbouring poses (N, 3), without their signs."""
    return np.abs((np.diff(poses[:, 2]) + math.pi) % (2.0 * math.pi) - math.pi)
