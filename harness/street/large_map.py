"""A map that is too large to be driven on as a whole: cut into tiles, with a route graph."""

import itertools
import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely

from harness.street.district import TILE
from harness.street.route_graph import RouteGraph, graph_of_area
from harness.world.map.extrude import merge_rectangles
from harness.world.map.scene_io import (
    FREE_BELOW,
    made_of,
    mesh_beside,
    other_cells,
    walkable_beside,
)
from harness.world.map.shapes import Rect
from navstack.costmap.map_image import MAX_PIXELS, image_size
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

    Of the maps beside it that of the walkable ground is cut, too. A tile of which nothing is known
    has no file. The origin moves to the nearest whole cell.

    Raises:
        MapError: a map cannot be read, is turned or has no free cell, or they do not lie on each
            other, or the folder cannot be written.
    """
    about = load_metadata(path)
    r, yaw = about.resolution, about.origin.yaw
    if yaw != 0.0:
        raise MapError(
            f"map {path}: is turned by {yaw:g} rad; tiles lie along the axes: save it with "
            "a yaw of 0"
        )
    side = min(max(round(TILE / r), _LEAST_SIDE), math.isqrt(MAX_PIXELS))
    ground_path = walkable_beside(path)
    grounds: Iterable[OccupancyGrid | None] = itertools.repeat(None)
    if ground_path is not None:
        _require_same_cells(ground_path, path)
        grounds = (ground for _, _, ground in load_squares(ground_path, side))
    boxes, free, files = [], [], []
    for (column, row, square), ground in zip(
        load_squares(path, side), grounds, strict=ground_path is not None
    ):
        corner = Pose2D(round(square.origin.x / r) * r, round(square.origin.y / r) * r, 0.0)
        tile = OccupancyGrid(square.data, r, corner)
        boxes.append((corner.x, corner.y, corner.x + tile.width * r, corner.y + tile.height * r))
        shown = tile.data if ground is None else ground.data
        is_free = (shown >= FREE) & (shown < FREE_BELOW)
        if is_free.any() or (tile.data != UNKNOWN).any():
            files.append(folder / f"{name}_{column}_{row}.yaml")
            save_map(_without_shades(tile), files[-1])
            if ground is not None:
                closed = np.where(is_free, np.int8(FREE), np.int8(OCCUPIED))
                grid = OccupancyGrid(closed, r, corner)
                save_map(grid, folder / f"{made_of(files[-1].stem)[1]}.yaml")
            free.append(_area(is_free, tile))
    ground_area = shapely.union_all(free)
    if ground_area.is_empty:
        raise MapError(
            f"map image {about.image}: has no free cell; check thresholds and negate in {path.name}"
        )
    bounds = np.array(boxes)
    box = Rect(*bounds[:, :2].min(axis=0).tolist(), *bounds[:, 2:].max(axis=0).tolist())
    return LargeMap(box, ground_area, r, files)


def left_behind(path: Path) -> list[Path]:
    """Files of a map that are not cut: its objects and the mesh that was drawn."""
    return [each for each in (path.with_suffix(".geojson"), mesh_beside(path)) if each.exists()]


def _without_shades(tile: OccupancyGrid) -> OccupancyGrid:
    """A map that is free, occupied or unknown: an image has no shades between."""
    cells = np.full(tile.data.shape, UNKNOWN, dtype=np.int8)
    cells[(tile.data >= FREE) & (tile.data < FREE_BELOW)] = FREE
    cells[tile.data >= SOLID_FROM] = OCCUPIED
    return OccupancyGrid(cells, tile.resolution, tile.origin)


def _require_same_cells(companion: Path, path: Path) -> None:
    """Check that a map beside another one has its cells.

    Raises:
        MapError: it has not.
    """
    found = []
    for each in (companion, path):
        about = load_metadata(each)
        found.append((image_size(about.image), about.resolution, about.origin, about.crop))
    if found[0] != found[1]:
        raise other_cells(companion, path)


def _area(cells: np.ndarray, grid: OccupancyGrid) -> shapely.Geometry:
    """The ground [m] of the cells (H, W) of a grid that are set."""
    r, x, y = grid.resolution, grid.origin.x, grid.origin.y
    low_row, low_column, high_row, high_column = merge_rectangles(cells).T * r
    boxes = shapely.box(x + low_column, y + low_row, x + high_column, y + high_row)
    return shapely.union_all(boxes, grid_size=0.001)
