"""Street furniture of a district: what is mapped, and what the rules fill in."""

import math
from collections import Counter, defaultdict
from dataclasses import dataclass, field

import numpy as np
import shapely

from harness.street.ground import DistrictGround
from harness.street.osm_file import Extract
from harness.street.rules import RULES
from harness.street.walks import Walk
from harness.world.map.scene import Obstacle
from harness.world.map.shapes import box, octagon
from navstack.types import FloatArray

CLEAR = 0.75  # [m] that furniture leaves free on each side of the middle of a way
_INSIDE = 0.35  # [m] from a sidewalk's edge to the middle of what is filled in
_LEAST_WIDTH = 1.8  # [m] narrower sidewalks get nothing


@dataclass(slots=True)
class StreetFurniture:
    """What stands in a district, without buildings and barriers."""

    pieces: list[Obstacle] = field(default_factory=list)
    mapped: Counter[str] = field(default_factory=Counter)  # pieces by kind
    filled: Counter[str] = field(default_factory=Counter)
    moved: int = 0  # pieces that stood in the middle of a way


class StreetFurnisher:
    """Puts the mapped pieces in place, then fills in what is missing."""

    def __init__(self, ground: DistrictGround, rng: np.random.Generator) -> None:
        self.found = StreetFurniture()
        self._ground, self._rng = ground, rng
        self._lines = np.array([walk.line for walk in ground.walks], dtype=object)
        self._tree = shapely.STRtree(self._lines)
        self._places: dict[str, list[tuple[float, float]]] = defaultdict(list)  # by entry
        shapely.prepare(ground.walkable)

    def furnish(self, extract: Extract) -> StreetFurniture:
        """Furnish the ground of an extract."""
        for point in extract.points:
            entry = _entry(point.tags)
            x, y = shapely.get_coordinates(point.geometry)[0].tolist()
            if entry and self._is_inside(x, y):
                self._put(entry, x, y, "mapped")
        for walk in self._ground.walks:
            if walk.has_signals:
                self._signal(walk)
        for entry, spacing in RULES.filling.items():
            for walk in self._ground.walks:
                if walk.kind == "sidewalk" and walk.width >= _LEAST_WIDTH:
                    self._fill(entry, spacing, walk)
        return self.found

    def _is_inside(self, x: float, y: float) -> bool:
        area = self._ground.box
        return area.x0 < x < area.x1 and area.y0 < y < area.y1

    def _put(self, entry: str, x: float, y: float, source: str) -> None:
        length, depth, height, kind = RULES.catalogue[entry]
        x, y, yaw, moved = self._off_the_middle(x, y, 0.5 * max(length, depth))
        outline = octagon(x, y, 0.5 * length)
        if depth > 0.0:
            outline = box(x, y, yaw, length, depth)
        self.found.pieces.append(Obstacle(kind, np.round(outline, 3), height))
        self.found.moved += moved
        getattr(self.found, source)[kind] += 1
        self._places[entry].append((x, y))

    def _off_the_middle(self, x: float, y: float, radius: float) -> tuple[float, float, float, int]:
        """The place [m] beside the nearest way's middle, its direction [rad], and whether moved."""
        point = shapely.Point(x, y)
        if not len(self._lines):
            return x, y, 0.0, 0
        line = self._lines[int(self._tree.nearest(point))]
        along = float(line.project(point))
        foot, yaw = _pose(line, along)
        apart = math.hypot(x - foot[0], y - foot[1])
        if apart >= CLEAR + radius:
            return x, y, yaw, 0
        side = 1.0
        if math.cos(yaw) * (y - foot[1]) - math.sin(yaw) * (x - foot[0]) < 0.0:
            side = -1.0
        away = side * (CLEAR + radius)
        return foot[0] - away * math.sin(yaw), foot[1] + away * math.cos(yaw), yaw, 1

    def _signal(self, crossing: Walk) -> None:
        """A traffic light beside each end of a crossing, on its right."""
        for along, direction in ((0.0, -1.0), (crossing.line.length, 1.0)):
            (x, y), yaw = _pose(crossing.line, along)
            beside = direction * (0.5 * crossing.width + _INSIDE)
            x, y = x + beside * math.sin(yaw), y - beside * math.cos(yaw)
            if self._is_inside(x, y):
                self._put("traffic_light", x, y, "mapped")

    def _fill(self, entry: str, spacing: float, walk: Walk) -> None:
        """One piece every ``spacing`` [m] at the road's side of a sidewalk, where none is near."""
        radius = 0.5 * RULES.catalogue[entry][0]
        along = float(self._rng.uniform(0.0, spacing))
        while along < walk.line.length:
            (x, y), yaw = _pose(walk.line, along)
            aside = 0.5 * walk.width - _INSIDE
            across = aside * np.array((-math.sin(yaw), math.cos(yaw)))
            sides = [shapely.Point((x, y) + across), shapely.Point((x, y) - across)]
            place = min(sides, key=lambda side: shapely.distance(self._ground.roads, side))
            has_room = aside - radius >= CLEAR and self._ground.walkable.contains(
                place.buffer(radius)
            )
            if has_room and not self._is_near(entry, place.x, place.y, spacing):
                self._put(entry, place.x, place.y, "filled")
            along += spacing

    def _is_near(self, entry: str, x: float, y: float, reach: float) -> bool:
        places = np.array(self._places[entry]).reshape(-1, 2)
        return bool((np.hypot(*(places - (x, y)).T) < reach).any())


def _entry(tags: dict[str, str]) -> str:
    for key, value in tags.items():
        entry = RULES.furniture.get(f"{key}={value}") or RULES.furniture.get(f"{key}=*")
        if entry:
            return entry
    return ""


def _pose(line: shapely.Geometry, along: float) -> tuple[FloatArray, float]:
    """Point (2,) of a line [m] and its direction there [rad]."""
    ends = (max(along - 0.5, 0.0), min(along + 0.5, line.length))
    points = shapely.line_interpolate_point(line, (along, *ends))
    here, before, after = shapely.get_coordinates(points)
    return here, math.atan2(after[1] - before[1], after[0] - before[0])
