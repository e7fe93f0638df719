"""What stands in a world: typed obstacles, zones and the maps made from them."""

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from navstack.costmap.field_cache import cached_array, content_key
from navstack.costmap.occupancy_grid import OCCUPIED, UNKNOWN, OccupancyGrid, enclosed
from navstack.types import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Obstacle:
    """Something solid, extruded from the ground."""

    # 'building_glass', 'mailbox', 'trash_bin', 'bollard', 'plant', 'fence', ..., 'unknown'
    kind: str
    polygon: FloatArray  # (N, 2) [m] convex, counter-clockwise, map frame
    height: float  # [m]


@dataclass(frozen=True, slots=True, eq=False)
class Zone:
    """A part of the ground with a use."""

    kind: str  # 'sidewalk', 'crosswalk', 'plaza', 'construction', 'work_area', 'road'
    polygon: FloatArray  # (N, 2) [m], map frame
    elevation: float = 0.0  # [m] of the ground; where zones overlap, the later one counts


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """A world at rest."""

    name: str
    obstacles: tuple[Obstacle, ...]
    zones: tuple[Zone, ...]
    geometry: OccupancyGrid  # what a lidar at its height can hit; roads are free
    # FREE where feet and wheels may be, up to curb and wall, OCCUPIED elsewhere; same shape
    walkable: OccupancyGrid
    drawn_mesh: OccupancyGrid | None = None  # the navigation mesh where one was drawn; same shape
    credit: str = ""  # whose data it is made of, as their licence asks to say
    # whether somebody said where wheels may be; else it is where the geometry is free
    is_ground_given: bool = True

    @property
    def mapped_geometry(self) -> OccupancyGrid:
        """The geometry as a robot with a lidar maps it.

        Surfaces are occupied, what lies behind them is unknown.
        """
        return _surfaces(self.geometry)

    @property
    def navigation_mesh(self) -> OccupancyGrid:
        """Where people walk and missions are drawn.

        The part of the walkable ground that was drawn, or all of it.
        """
        return self.walkable if self.drawn_mesh is None else self.drawn_mesh

    @property
    def outlined_mesh(self) -> OccupancyGrid:
        """The navigation mesh with its edges occupied, as if a lidar had mapped walls there.

        Unknown beyond them.
        """
        return _surfaces(self.navigation_mesh)


def _surfaces(grid: OccupancyGrid) -> OccupancyGrid:
    """A map whose occupied cells are unknown where all eight neighbours are occupied, too."""
    data = grid.data

    def compute() -> npt.NDArray[np.int8]:
        return np.where(enclosed(data >= OCCUPIED), np.int8(UNKNOWN), data)

    return replace(grid, data=cached_array(content_key("mapped geometry 1", data), compute))
