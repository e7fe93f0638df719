"""The world's own kernels that a numpy twin can be written for."""

from collections.abc import Sequence

import numpy as np

from harness.bench import twins
from harness.bench.component import Component, Prepared, require_agreement, shipped_map
from harness.bench.localizers import START
from harness.world.lidar_kernels import cast_grid, clearance_field
from navstack.costmap.occupancy_grid import OCCUPIED

BEAMS = 360
REACH = 30.0  # [m]


def scan() -> Prepared:
    """The rays of one scan on the shipped map, without people and noise."""
    grid = shipped_map("sidewalk")
    occupied = grid.data >= OCCUPIED
    field = clearance_field(occupied)
    x, y = (START.x - grid.origin.x) / grid.resolution, (START.y - grid.origin.y) / grid.resolution
    angles = -np.pi + np.arange(BEAMS) * (2.0 * np.pi / BEAMS) + 0.001
    directions, reach = np.column_stack((np.cos(angles), np.sin(angles))), REACH / grid.resolution
    ranges = np.empty(BEAMS)

    def ours() -> None:
        cast_grid(field, x, y, 1.0, 0.0, directions, reach, ranges)

    ours()
    require_agreement("lidar", ranges, twins.cast(occupied, x, y, directions, reach), 1e-9)
    return Prepared(ours, lambda: twins.cast(occupied, x, y, directions, reach))


COMPONENTS: Sequence[Component] = (Component("lidar, 360 beams, 30 m", scan),)
