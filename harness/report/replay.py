"""A recorded delivery as a replay shows it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from harness.economics.accountings import COUNTED, EVENT
from harness.metrics.columns import Row
from harness.metrics.contacts import was_counted
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.types import FloatArray, Pose2D

MAP_MARGIN = 20.0  # [m] around the way: the map of a whole town has 16 million cells


@dataclass(frozen=True, slots=True, eq=False)
class RecordedReplay:
    """What a replay shows beside the map."""

    arrays: Mapping[str, Any]  # of the recording
    contacts: Sequence[Row]  # of :func:`contacts_shown`
    footprint: FloatArray  # (N, 2) [m], base frame
    person_radius: float  # [m]


def grid_around(grid: OccupancyGrid, trace: FloatArray) -> OccupancyGrid | None:
    """The part of a map around a recorded trajectory; None where that is all off the map.

    Args:
        grid: the map.
        trace: rows of :data:`harness.metrics.replay_log.TRACE_COLUMNS`, (T, 11).

    Raises:
        MapError: the map is rotated.
    """
    grid.require_unrotated("map")
    corner = np.array((grid.origin.x, grid.origin.y))
    size = (grid.width, grid.height)
    low = trace[:, 1:3].min(axis=0) - MAP_MARGIN - corner
    high = trace[:, 1:3].max(axis=0) + MAP_MARGIN - corner
    x0, y0 = np.floor(low / grid.resolution).clip(0, size).astype(int).tolist()
    x1, y1 = np.ceil(high / grid.resolution).clip(0, size).astype(int).tolist()
    if x0 >= x1 or y0 >= y1:
        return None
    origin = Pose2D(grid.origin.x + x0 * grid.resolution, grid.origin.y + y0 * grid.resolution)
    return OccupancyGrid(grid.data[y0:y1, x0:x1], grid.resolution, origin)


def contacts_shown(events: Sequence[Row]) -> list[Row]:
    """Those of a delivery's rows of ``events.parquet`` that a replay shows, in the order of time.

    A counted contact stands for itself, an event for contacts that the published rule did not
    count. What has no time or no place is left out.
    """
    known = [
        event for event in events if None not in (event["stamp_s"], event["x_m"], event["y_m"])
    ]
    counted = [event for event in known if event["type"] == COUNTED]
    paid = [(event["stamp_s"], _partner(event)) for event in counted]
    others = [
        event
        for event in known
        if event["type"] == EVENT
        and not was_counted(event["stamp_s"], event["duration_s"] or 0.0, _partner(event), paid)
    ]
    return sorted((*counted, *others), key=lambda event: float(event["stamp_s"]))


def _partner(event: Row) -> tuple[str, int]:
    return event["partner"], event["partner_id"]
