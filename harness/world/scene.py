"""What stands in a world: typed obstacles, zones and the two maps made from them."""

from dataclasses import dataclass

from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.types import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Obstacle:
    """Something solid, extruded from the ground."""

    kind: str  # 'building_glass', 'mailbox', 'trash_bin', 'bollard', 'plant', 'fence', ..., 'unknown'
    polygon: FloatArray  # (N, 2) [m] convex, counter-clockwise, map frame
    height: float  # [m]


@dataclass(frozen=True, slots=True, eq=False)
class Zone:
    """A part of the ground with a use."""

    kind: str  # 'sidewalk', 'crosswalk', 'plaza', 'construction', 'work_area', 'road'
    polygon: FloatArray  # (N, 2) [m], map frame


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """A world at rest."""

    name: str
    obstacles: tuple[Obstacle, ...]
    zones: tuple[Zone, ...]
    geometry: OccupancyGrid  # what a lidar at its height can hit; roads are free
    walkable: OccupancyGrid  # FREE where people and robot may be, OCCUPIED elsewhere; same shape as geometry
