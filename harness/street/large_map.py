"""A map that is too large to be driven on as a whole: cut into tiles, with a route graph."""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely

from harness.street.district import TILE
from harness.street.route_graph import RouteGraph, graph_of_area
from harness.world.map.extrude import merge_rectangles
from harness.world.map.scene_io import FREE_BELOW
from harness.world.map.shapes import Rect
from navstack.costmap.map_image import MAX_PIXELS
from navstack.costmap.map_io import load_metadata, load_squares, save_map
from navstack.costmap.occupancy_grid import (
    FREE,
    OCCUPIED,
    SOLID_FROM,
    UNKNOWN,
    OccupancyGrid,
)
from navstack.errors import MapError
from navstack.types import Pose2D

_LEAST_SIDE = 100  # [cells] of a tile


@dataclass(frozen=True, slots=True, eq=False)
class LargeMap:
    """What is known of a map that has been cut."""

    box: Rect  # [m] map frame
    free: shapely.Geometry  # [m]
    resolution: float  # [m/cell]
    files: list[Path]  # of the tiles

    def graph(self) -> RouteGraph:
        """The ways along the middle of the free ground.

        Raises:
            MapError: no way is wide or long enough.
        """
        return graph_of_area(self.free.simplify(self.resolution), self.box)


def cut(path: Path, folder: Path, name: str) -> LargeMap:
    """Write a map_server map of up to 400 million cells as tiles ``NAME_column_row`` of 200 m.

    A tile without a free cell has no file. The origin moves to the nearest whole cell.

    Raises:
        MapError: the map cannot be read, is turned or has no free cell, or the folder cannot be
            written.
    """
    about = load_metadata(path)
    r, yaw = about.resolution, about.origin.yaw
    if yaw != 0.0:
        raise MapError(
            f"map {path}: is turned by {yaw:g} rad; tiles lie along the axes: save it with "
            "a yaw of 0"
        )
    side = min(max(round(TILE / r), _LEAST_SIDE), math.isqrt(MAX_PIXELS))
    boxes, free, files = [], [], []
    for column, row, square in load_squares(path, side):
        corner = Pose2D(round(square.origin.x / r) * r, round(square.origin.y / r) * r, 0.0)
        tile = OccupancyGrid(square.data, r, corner)
        boxes.append((corner.x, corner.y, corner.x + tile.width * r, corner.y + tile.height * r))
        is_free = (tile.data >= FREE) & (tile.data < FREE_BELOW)
        if is_free.any():
            files.append(folder / f"{name}_{column}_{row}.yaml")
            cells = np.full(tile.data.shape, UNKNOWN, dtype=np.int8)
            cells[is_free] = FREE
            cells[tile.data >= SOLID_FROM] = OCCUPIED
            save_map(OccupancyGrid(cells, r, corner), files[-1])  # an image has no shades between
            free.append(_area(is_free, tile))
    if not files:
        raise MapError(
            f"map image {about.image}: has no free cell; check thresholds and negate in {path.name}"
        )
    bounds = np.array(boxes)
    box = Rect(*bounds[:, :2].min(axis=0).tolist(), *bounds[:, 2:].max(axis=0).tolist())
    return LargeMap(box, shapely.union_all(free), r, files)


def _area(cells: np.ndarray, grid: OccupancyGrid) -> shapely.Geometry:
    """The ground [m] of the cells (H, W) of a grid that are set."""
    r, x, y = grid.resolution, grid.origin.x, grid.origin.y
    low_row, low_column, high_row, high_column = merge_rectangles(cells).T * r
    boxes = shapely.box(x + low_column, y + low_row, x + high_column, y + high_row)
    return shapely.union_all(boxes, grid_size=0.001)
