"""Occupancy grids as nav_msgs/OccupancyGrid has them."""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from navstack.costmap.map_image import MAX_PIXELS
from navstack.errors import MapError
from navstack.geometry import rotation
from navstack.types import BoolArray, Pose2D

FREE = 0
OCCUPIED = 100
# [%] occupancy from which a cell of a map stands in the way (map_server's default occupied_thresh)
SOLID_FROM = 65
UNKNOWN = -1
FARTHEST = 1e8  # [m] of a place on any map, beyond the earth's circumference


@dataclass(frozen=True, slots=True, eq=False)
class OccupancyGrid:
    """Occupancy per cell; the grid's lower left corner stands at ``origin`` in the map frame."""

    # (height, width), row 0 = lowest y; 0..100 occupancy in percent, -1 unknown
    data: npt.NDArray[np.int8]
    resolution: float  # [m/cell]
    origin: Pose2D  # of the lower left corner of cell (0, 0)

    @property
    def width(self) -> int:
        """Cells along x."""
        return int(self.data.shape[1])

    @property
    def height(self) -> int:
        """Cells along y."""
        return int(self.data.shape[0])

    def value_at(self, x: float, y: float) -> int:
        """The occupancy at a point of the map frame.

        UNKNOWN beyond the grid, whose yaw must be 0.
        """
        column = math.floor((x - self.origin.x) / self.resolution)
        row = math.floor((y - self.origin.y) / self.resolution)
        if 0 <= column < self.width and 0 <= row < self.height:
            return int(self.data[row, column])
        return UNKNOWN

    def require_unrotated(self, name: str) -> None:
        """Refuse a yaw other than 0.

        Raises:
            MapError: the grid is rotated.
        """
        if abs(math.sin(self.origin.yaw)) > 1e-9 or math.cos(self.origin.yaw) < 0.0:
            raise MapError(
                f"the {name} is rotated by {self.origin.yaw} rad; "
                f"costmaps need {name}s with an origin yaw of 0"
            )


def enclosed(occupied: BoolArray) -> BoolArray:
    """Occupied cells with eight occupied neighbours; beyond the map's edges all are."""
    whole = np.pad(occupied, 1, constant_values=True)
    beside = whole[:, :-2] & whole[:, 1:-1] & whole[:, 2:]
    inside: BoolArray = beside[:-2] & beside[1:-1] & beside[2:]
    return inside


def align(grid: OccupancyGrid) -> OccupancyGrid:
    """The same map with its axes parallel to the frame's, by the nearest cell.

    What lies outside is unknown.

    (Nav2's costmaps ignore a yaw in a map's origin instead.)
    """
    yaw, r = grid.origin.yaw, grid.resolution
    if yaw == 0.0:
        return grid
    corners = np.array(((0, 0), (grid.width, 0), (grid.width, grid.height), (0, grid.height))) * r
    turned = corners @ rotation(-yaw)
    low, high = turned.min(axis=0), turned.max(axis=0)
    width, height = (max(math.ceil(extent / r - 1e-9), 1) for extent in high - low)
    if width * height > MAX_PIXELS:
        raise MapError(
            f"map turned by {yaw:g} rad has {width} x {height} cells; allowed: {MAX_PIXELS}; give "
            "an origin without yaw"
        )
    cos, sin = math.cos(yaw), math.sin(yaw)
    x = low[0] + (np.arange(width) + 0.5) * r
    y = (low[1] + (np.arange(height) + 0.5) * r)[:, None]
    columns = np.floor((cos * x + sin * y) / r).astype(np.int64)
    rows = np.floor((-sin * x + cos * y) / r).astype(np.int64)
    inside = (columns >= 0) & (columns < grid.width) & (rows >= 0) & (rows < grid.height)
    data = np.full((height, width), UNKNOWN, dtype=np.int8)
    data[inside] = grid.data[rows[inside], columns[inside]]
    return OccupancyGrid(
        data, r, Pose2D(grid.origin.x + float(low[0]), grid.origin.y + float(low[1]), 0.0)
    )
