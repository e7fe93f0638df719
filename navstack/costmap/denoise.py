"""Removing obstacle groups of a few cells, as sensor noise makes them (``denoise_layer.cpp``)."""

import numpy as np
from scipy import ndimage

from navstack.costmap.costmap import FREE_SPACE, INSCRIBED_INFLATED_OBSTACLE, NO_INFORMATION
from navstack.types import ByteArray


def remove_small_groups(
    costs: ByteArray, minimal_size: int, connectivity: int, unknown_is_obstacle: bool
) -> None:
    """Free the groups of fewer than ``minimal_size`` obstacle cells of ``costs``, in place.

    Obstacles are costs of 253 and 254, and 255 with ``unknown_is_obstacle``. With a
    ``connectivity`` of 4 cells with a common side are one group, with 8 those with a common corner
    too. What lies beyond the edges of ``costs`` (height, width) does not count.
    """
    is_obstacle = costs >= INSCRIBED_INFLATED_OBSTACLE
    if not unknown_is_obstacle:
        is_obstacle &= costs != NO_INFORMATION
    neighbours = ndimage.generate_binary_structure(2, connectivity // 4)
    groups, _ = ndimage.label(is_obstacle, neighbours)
    is_small = np.bincount(groups.ravel()) < minimal_size
    costs[is_small[groups] & is_obstacle] = FREE_SPACE
