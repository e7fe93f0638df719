"""A district of a city: its ground and furniture, and the scenes of its parts."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely

from harness.street.furniture import StreetFurnisher, StreetFurniture
from harness.street.ground import DistrictGround, lay_ground
from harness.street.osm_file import CREDIT, Extract
from harness.street.raster import cells_of
from harness.street.rules import RULES
from harness.street.walks import Walk
from harness.world.map.scene import Obstacle, Scene, Zone
from harness.world.map.shapes import Rect, fill_convex
from harness.world.map.sidewalk import (
    LIDAR_LOWER_EDGE,
    RESOLUTION,
    largest_part,
    without_slivers,
)
from navstack.costmap.map_image import MAX_PIXELS
from navstack.costmap.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from navstack.types import BoolArray, FloatArray, Pose2D

TILE = 200.0  # [m] side of a part of a district that is larger than one map
_GRID, _SLIVER = 0.001, 0.01  # [m] of corners that are written, [m2] of areas that are not


@dataclass(frozen=True, eq=False)
class District:
    """What an extract and the rules say of a box; [m], origin in its lower left corner."""

    extract: Extract
    ground: DistrictGround
    furniture: StreetFurniture

    @cached_property
    def obstacles(self) -> list[Obstacle]:
        """Buildings, barriers and furniture, convex."""
        return [*self.ground.solid, *self.furniture.pieces]

    @cached_property
    def bounds(self) -> FloatArray:
        """Of the obstacles (n, 4): least x, y and most x, y [m]."""
        found = [(*each.polygon.min(axis=0), *each.polygon.max(axis=0)) for each in self.obstacles]
        return np.array(found, dtype=float).reshape(-1, 4)

    @cached_property
    def crossings(self) -> list[tuple[Walk, shapely.Geometry]]:
        """The crossings, each with the part of the carriageways [m] that it leads over."""
        carriageways = shapely.union_all([street.polygon for street in self.ground.streets])
        shapely.prepare(carriageways)
        found = [walk for walk in self.ground.walks if walk.kind == "crossing"]
        return [(walk, shapely.intersection(walk.polygon, carriageways)) for walk in found]

    @cached_property
    def uses(self) -> list[tuple[str, shapely.Geometry, float]]:
        """Uses of the ground: kind of the zone, polygons [m], height [m].

        Crossings with raised kerbs lie as low as the road.
        """
        ground, kerb = self.ground, RULES.street["kerb_height"]
        steps = shapely.union_all([over for walk, over in self.crossings if walk.has_step])
        level = shapely.union_all([over for walk, over in self.crossings if not walk.has_step])
        over = shapely.union(steps, level)
        people = shapely.difference(ground.walkable, shapely.union(ground.plazas, over))
        return [
            ("lawn", ground.green, 0.0),
            ("road", ground.roads, -kerb),
            ("sidewalk", people, 0.0),
            ("plaza", shapely.intersection(ground.plazas, ground.walkable), 0.0),
            ("crosswalk", level, 0.0),
            ("crosswalk", shapely.difference(steps, level), -kerb),
        ]


def build_district(extract: Extract, seed: int) -> District:
    """Lay the ground and furnish it; the same seed gives the same district.

    Raises:
        InputError: nobody can walk there, as far as the extract says.
    """
    ground = lay_ground(extract, np.random.default_rng((seed, 0)))
    furnisher = StreetFurnisher(ground, np.random.default_rng((seed, 1)))
    return District(extract, ground, furnisher.furnish(extract))


def windows_of(area: Rect) -> list[tuple[str, Rect]]:
    """The parts of a box that become maps: suffix of the name, and window [m].

    One where the cells are few enough for a map, else tiles of ``TILE``.
    """
    whole = Rect(0.0, 0.0, _cells(area.width) * RESOLUTION, _cells(area.depth) * RESOLUTION)
    if _cells(area.width) * _cells(area.depth) <= MAX_PIXELS:
        return [("", whole)]
    windows = []
    for row in range(math.ceil(whole.depth / TILE)):
        for column in range(math.ceil(whole.width / TILE)):
            x, y = column * TILE, row * TILE
            window = Rect(x, y, min(x + TILE, whole.x1), min(y + TILE, whole.y1))
            windows.append((f"_{column}_{row}", window))
    return windows


def _cells(length: float) -> int:
    return int(length / RESOLUTION)


def has_ground(district: District, window: Rect) -> bool:
    """Whether anything of a window is walkable: a route may lead through the corner of a tile."""
    return bool(clipped(district.ground.walkable, window).area >= _SLIVER)


def scene_of(district: District, window: Rect, name: str) -> Scene:
    """The scene of a window [m] of a district.

    Walkable is what people may walk on and nothing stands on; the mesh is its largest connected
    part without slivers.
    """
    obstacles = [
        district.obstacles[place] for place in np.flatnonzero(_overlap(district.bounds, window))
    ]
    seen = np.zeros((round(window.depth / RESOLUTION), round(window.width / RESOLUTION)), bool)
    blocked = np.zeros_like(seen)
    for each in obstacles:
        fill_convex(blocked, each.polygon, True, RESOLUTION, window.x0, window.y0)
        if each.height >= LIDAR_LOWER_EDGE:
            fill_convex(seen, each.polygon, True, RESOLUTION, window.x0, window.y0)
    walkable = cells_of(district.ground.walkable, window, RESOLUTION) & ~blocked
    mesh = largest_part(without_slivers(walkable, RESOLUTION))
    return Scene(
        name,
        tuple(obstacles),
        tuple(_zones(district, window)),
        _grid(seen, window),
        _grid(~walkable, window),
        _grid(~mesh, window),
        CREDIT,
    )


def overview(district: District) -> Scene:
    """The whole district for a picture: its maps have one cell, buildings are not convex."""
    area = district.ground.box
    size = max(area.width, area.depth)
    empty = OccupancyGrid(np.zeros((1, 1), dtype=np.int8), size, Pose2D(area.x0, area.y0, 0.0))
    built = [
        Obstacle(kind, outline, height)
        for kind, shape, height in district.ground.built
        for outline in _simple_parts(shape)
    ]
    obstacles = (*built, *district.furniture.pieces)
    zones = tuple(_zones(district, area))
    return Scene("overview", obstacles, zones, empty, empty, credit=CREDIT)


def _overlap(bounds: FloatArray, window: Rect) -> BoolArray:
    """Which of some bounds (n, 4), least x, y and most x, y [m], reach into a window."""
    least_x, least_y, most_x, most_y = bounds.T
    across = (most_x > window.x0) & (least_x < window.x1)
    overlap: BoolArray = across & (most_y > window.y0) & (least_y < window.y1)
    return overlap


def _grid(occupied: BoolArray, window: Rect) -> OccupancyGrid:
    data = np.where(occupied, np.int8(OCCUPIED), np.int8(FREE))
    return OccupancyGrid(data, RESOLUTION, Pose2D(window.x0, window.y0, 0.0))


def _zones(district: District, window: Rect) -> list[Zone]:
    return [
        Zone(kind, corners, height)
        for kind, shape, height in district.uses
        for corners in _simple_parts(clipped(shape, window))
    ]


def clipped(shape: shapely.Geometry, window: Rect) -> shapely.Geometry:
    """The part of an area in a window [m]."""
    try:
        return shapely.clip_by_rect(shape, window.x0, window.y0, window.x1, window.y1)
    except shapely.GEOSException:  # it fails where only a sliver would be left, but is far quicker
        box = shapely.box(window.x0, window.y0, window.x1, window.y1)
        return shapely.intersection(shape, box)


def _simple_parts(shape: shapely.Geometry) -> list[FloatArray]:
    """Polygons (N, 2) without holes that make up an area: it is cut at its holes."""
    found: list[FloatArray] = []
    waiting = shapely.get_parts(shape).tolist()
    while waiting:
        part = shapely.set_precision(waiting.pop(), _GRID)  # valid when it is written
        if part.geom_type in ("MultiPolygon", "GeometryCollection"):
            waiting += shapely.get_parts(part).tolist()
        elif part.geom_type != "Polygon":
            continue
        elif part.interiors:
            waiting += _halves(part)
        elif part.area >= _SLIVER:
            ring = shapely.orient_polygons(part).exterior
            found.append(np.round(shapely.get_coordinates(ring)[:-1], 3))
    return found


def _halves(polygon: shapely.Geometry) -> list[shapely.Geometry]:
    """A polygon cut in two at its first hole."""
    x0, y0, x1, y1 = polygon.bounds
    middle = polygon.interiors[0].centroid.x
    halves = [shapely.box(x0, y0, middle, y1), shapely.box(middle, y0, x1, y1)]
    return [
        part
        for half in halves
        for part in shapely.get_parts(shapely.intersection(polygon, half)).tolist()
    ]
