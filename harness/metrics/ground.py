"""What ground the robot drove on."""

import numpy as np
import shapely

from harness.metrics.columns import Row
from harness.world.map.scene import Scene
from navstack.costmap.occupancy_grid import FREE, OccupancyGrid
from navstack.types import BoolArray, FloatArray

ROAD = "road"  # kind of a zone


def ground_driven(stamp: FloatArray, x: FloatArray, y: FloatArray, scene: Scene) -> Row:
    """Metres and seconds off the walkable ground, and those of them on the road.

    A step counts by where it ends, with the origin of the base frame.

    Args:
        stamp: times (T,) [s].
        x: true positions (T,) [m], map frame.
        y: the same along the other axis.
        scene: the world. Where it has no road, nothing is said of one.
    """
    steps, times = np.hypot(np.diff(x), np.diff(y)), np.diff(stamp)
    off = ~_is_free(x[1:], y[1:], scene.walkable)
    row: Row = {"road_distance_m": None, "road_time_s": None}
    if any(zone.kind == ROAD for zone in scene.zones):
        road = np.flatnonzero(off)
        road = road[_is_road(x[1:][road], y[1:][road], scene)]
        row = {
            "road_distance_m": float(steps[road].sum()),
            "road_time_s": float(times[road].sum()),
        }
    return {
        **row,
        "off_walkable_distance_m": float(steps[off].sum()),
        "off_walkable_time_s": float(times[off].sum()),
    }


def _is_free(x: FloatArray, y: FloatArray, grid: OccupancyGrid) -> BoolArray:
    """Whether points (n,) lie in free cells; none beyond the grid does."""
    columns = np.floor((x - grid.origin.x) / grid.resolution).astype(np.int64)
    rows = np.floor((y - grid.origin.y) / grid.resolution).astype(np.int64)
    inside = (columns >= 0) & (columns < grid.width) & (rows >= 0) & (rows < grid.height)
    free = np.zeros(len(x), dtype=bool)
    free[inside] = grid.data[rows[inside], columns[inside]] == FREE
    return free


def _is_road(x: FloatArray, y: FloatArray, scene: Scene) -> BoolArray:
    """Whether points (n,) lie on a road; where zones overlap, the later one counts."""
    tree = shapely.STRtree([shapely.Polygon(zone.polygon) for zone in scene.zones])
    points, zones = tree.query(shapely.points(x, y), predicate="intersects")
    last = np.full(len(x), -1)
    np.maximum.at(last, points, zones)
    is_road = np.array([*(zone.kind == ROAD for zone in scene.zones), False])
    road: BoolArray = is_road[last]
    return road
