"""What of the map and of a delivery's events the writers of replays show."""

from collections.abc import Sequence

import numpy as np

from harness.metrics import Row
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.types import FloatArray, Pose2D

MAP_MARGIN = 20.0  # [m] around the way: the map of a whole town has 16 million cells


def grid_around(grid: OccupancyGrid, trace: FloatArray) -> OccupancyGrid:
    """The part of a map around a recorded trajectory.

    Args:
        grid: the map, unrotated.
        trace: rows of :data:`harness.metrics.replay_log.TRACE_COLUMNS`, (T, 11).
    """
    low, high = trace[:, 1:3].min(axis=0) - MAP_MARGIN, trace[:, 1:3].max(axis=0) + MAP_MARGIN
    corner, size = np.array((grid.origin.x, grid.origin.y)), (grid.width, grid.height)
    x0, y0 = np.clip(np.floor((low - corner) / grid.resolution).astype(int), 0, size).tolist()
    x1, y1 = np.clip(np.ceil((high - corner) / grid.resolution).astype(int), 0, size).tolist()
    origin = Pose2D(grid.origin.x + x0 * grid.resolution, grid.origin.y + y0 * grid.resolution)
    return OccupancyGrid(grid.data[y0:y1, x0:x1], grid.resolution, origin)


def placed(events: Sequence[Row]) -> list[Row]:
    """Those rows of ``events.parquet`` that have a time and a place, in the order of time."""
    known = (event for event in events if None not in (event["stamp_s"], event["x_m"], event["y_m"]))
    return sorted(known, key=lambda event: float(event["stamp_s"]))
