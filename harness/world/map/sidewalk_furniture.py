"""Street furniture of the sidewalk world: what it is, how large, and where it stands."""

import math
from dataclasses import dataclass

import numpy as np

from harness.world.map.scene import Obstacle
from harness.world.map.shapes import Rect, bounds, box, octagon, polygon_area
from harness.world.map.sidewalk_blocks import Block, Streets
from harness.world.map.statistics import PIECE_AREA, PUBLISHED
from navstack.types import FloatArray


@dataclass(frozen=True, slots=True)
class Furniture:
    """One kind of street furniture."""

    length: tuple[float, float]  # [m] along the curb, least and most
    depth: tuple[float, float]  # [m] across the sidewalk
    height: tuple[float, float]  # [m]
    is_post: bool = False  # an octagon of diameter ``length`` instead of a box


CATALOGUE = {
    "mailbox": Furniture((0.60, 0.75), (0.55, 0.65), (1.25, 1.35)),
    "trash_bin": Furniture((0.55, 0.75), (0.55, 0.75), (0.95, 1.15)),
    "bollard": Furniture((0.26, 0.34), (0.26, 0.34), (0.85, 1.0), is_post=True),
    "plant": Furniture((0.7, 1.1), (0.6, 0.9), (0.9, 1.6)),
    "tree_pit": Furniture((1.1, 1.8), (1.0, 1.4), (2.5, 4.0)),
    "fence": Furniture((2.4, 3.2), (0.12, 0.16), (1.1, 1.2)),
    "hydrant": Furniture((0.32, 0.40), (0.32, 0.40), (0.75, 0.85), is_post=True),
    "lamp": Furniture((0.28, 0.36), (0.28, 0.36), (4.5, 5.5), is_post=True),
    "traffic_light": Furniture((0.28, 0.36), (0.28, 0.36), (3.5, 4.5), is_post=True),
    "newspaper_box": Furniture((0.5, 0.6), (0.45, 0.5), (1.1, 1.25)),
    "bus_stop": Furniture((2.8, 3.8), (1.2, 1.4), (2.4, 2.6)),
    "barrier": Furniture((1.4, 2.0), (0.4, 0.5), (1.0, 1.1)),
}
_KINDS = {"tree_pit": "plant"}  # entries that are sizes of another kind

# How often a kind stands in the furniture zone along the curb, relative to each other.
_CURB_MIX = {
    "trash_bin": 18,
    "mailbox": 7,
    "plant": 20,
    "tree_pit": 14,
    "bollard": 13,
    "hydrant": 7,
    "lamp": 13,
    "newspaper_box": 12,
    "bus_stop": 5,
    "fence": 6,
}
_FACADE_MIX = {"plant": 10, "trash_bin": 3, "newspaper_box": 3}

_CLEAR_LANE = 1.25  # [m] of a sidewalk's width that furniture at the curb leaves free
_CURB_GAP = (0.28, 0.56)  # [m] between the curb and what stands along it
_FACADE_GAP = (0.1, 0.3)  # [m]
# median [m] and log standard deviation of the distance along the curb, between groups
_CURB_SPACING = (5.3, 0.28)
_GROUP_SHARE = 0.28  # of the pieces stand close to the previous one
_GROUP_SPACING = (1.4, 3.4)  # [m]
_FACADE_SPACING = (13.0, 0.8)
_FACADE_LEAST_WIDTH = 3.7  # [m] narrower sidewalks have nothing along the facades
_PANEL_LENGTH = 3.0  # [m] of fence around a building site, about
_PANEL_INSET = 0.1  # [m] inside the site's edge, so that the way beside it keeps its width
_APPROACH = 1.2  # [m] kept free around crosswalks
# [m] of a traffic light from a crosswalk's corner, across and along it
_SIGNAL_BESIDE, _SIGNAL_BEYOND = 0.35, 0.45


class Furnisher:
    """Places furniture so that no two pieces touch and crosswalks stay open."""

    def __init__(self, streets: Streets, rng: np.random.Generator) -> None:
        self.pieces: list[Obstacle] = []
        self._count = 0  # of the pieces, those of a size that counts
        self._streets = streets
        self._rng = rng
        self._taken: list[Rect] = [area.grown(_APPROACH) for area in streets.crosswalks]

    def furnish(self) -> tuple[Obstacle, ...]:
        """Furnish the streets.

        Curbs in random order until there are as many pieces as in the paper's world.
        """
        for area in self._streets.construction:
            self._fence_in(area)
        self._dig_work_areas(3)
        self._signal_crosswalks(0.35)
        for area in self._streets.plazas:
            self._furnish_plaza(area)
        sides = [(block, side) for block in self._streets.blocks for side in range(4)]
        for block, side in sides:
            if block.widths[side] >= _FACADE_LEAST_WIDTH and block.use != "plaza":
                self._line_facade(block, side)
        for number in self._rng.permutation(len(sides)):
            self._line_curb(*sides[number])
        return tuple(self.pieces)

    def _line_curb(self, block: Block, side: int) -> None:
        strip, width = block.strip(side), block.widths[side]
        length = strip.side_length(side)
        along = float(self._rng.uniform(1.0, 4.0))
        while along < length - 1.0 and self._count < PUBLISHED.pieces:
            gap = float(self._rng.uniform(*_CURB_GAP))
            name, size = self._draw(_CURB_MIX)
            if gap + size[1] <= width - _CLEAR_LANE:
                self._place_along(name, size, strip, side, along, gap + 0.5 * size[1])
            along += self._spacing(_CURB_SPACING)

    def _line_facade(self, block: Block, side: int) -> None:
        strip, width = block.strip(side), block.widths[side]
        neighbours = block.widths[(side + 3) % 4], block.widths[(side + 1) % 4]
        length = strip.side_length(side)
        along = max(neighbours) + self._spacing(_FACADE_SPACING)
        while along < length - max(neighbours):
            name, size = self._draw(_FACADE_MIX)
            inwards = width - self._rng.uniform(*_FACADE_GAP) - 0.5 * size[1]
            self._place_along(name, size, strip, side, along, inwards)
            along += self._spacing(_FACADE_SPACING)

    def _place_along(
        self,
        name: str,
        size: FloatArray,
        strip: Rect,
        side: int,
        along: float,
        inwards: float,
    ) -> None:
        """Place a piece ``along`` [m] from the strip's lower end, ``inwards`` from the curb."""
        yaw = math.pi / 2.0 if side % 2 == 0 else 0.0
        self._place(name, size, *strip.beside(side, along, inwards), yaw, margin=0.35)

    def _furnish_plaza(self, area: Rect) -> None:
        """Planters on a loose grid, and a row of bollards along the open sides."""
        columns = max(int(area.width / 9.0), 1)
        rows = max(int(area.depth / 9.0), 1)
        for k in range(columns * rows):
            column = k % columns + 0.5 + self._rng.uniform(-0.2, 0.2)
            row = k // columns + 0.5 + self._rng.uniform(-0.2, 0.2)
            x = area.x0 + column * area.width / columns
            y = area.y0 + row * area.depth / rows
            name, size = self._draw({"tree_pit": 3, "plant": 2, "lamp": 1, "trash_bin": 1})
            yaw = float(self._rng.uniform(0.0, math.pi / 2.0))
            self._place(name, size, x, y, yaw, margin=0.8)
        for x in np.arange(area.x0 + 0.8, area.x1, 1.7):
            if self._rng.random() < 0.8:
                name, size = self._draw({"bollard": 1})
                self._place(name, size, float(x), area.y1 - 0.2, 0.0, margin=0.5)

    def _signal_crosswalks(self, share: float) -> None:
        """Traffic lights beside the ends of some crosswalks."""
        for area in self._streets.crosswalks:
            crosses_x = any(area.x0 == block.area.x1 for block in self._streets.blocks)
            dx, dy = _SIGNAL_BESIDE, _SIGNAL_BEYOND
            if crosses_x:
                dx, dy = dy, dx
            for x, y in ((area.x0 - dx, area.y0 - dy), (area.x1 + dx, area.y1 + dy)):
                if self._rng.random() > share:
                    continue
                _, size = self._draw({"traffic_light": 1})
                reach = Rect(x, y, x, y).grown(size[0])
                if not any(bounds(piece.polygon).overlaps(reach) for piece in self.pieces):
                    self._add("traffic_light", size, x, y, 0.0)

    def _fence_in(self, area: Rect) -> None:
        """Panels just inside those sides of a building site that do not lean on a building."""
        walls = [bounds(building.polygon) for building in self._streets.buildings]
        line = area.grown(-_PANEL_INSET)
        for side in range(4):
            length = line.side_length(side)
            count = max(round(length / _PANEL_LENGTH), 1)
            for k in range(count):
                x, y = line.beside(side, (k + 0.5) * length / count)
                reach = Rect(x, y, x, y).grown(2.0 * _PANEL_INSET)
                if not any(wall.overlaps(reach) for wall in walls):
                    yaw = math.pi / 2.0 if side % 2 == 0 else 0.0
                    self._add("fence", np.array((length / count - 0.15, 0.14, 1.2)), x, y, yaw)

    def _dig_work_areas(self, count: int) -> None:
        """Roadworks on wide sidewalks: barriers at both ends, fence panels towards people."""
        wide = [
            (b, s)
            for b in self._streets.blocks
            for s in (1, 3)
            if 4.0 <= b.widths[s] < 6.0 and b.use != "plaza"
        ]
        for k in self._rng.permutation(len(wide))[:count]:
            block, side = wide[k]
            strip, depth = block.strip(side), block.widths[side] - 2.0
            x0 = strip.x0 + self._rng.uniform(0.35, 0.5) * strip.width
            y0 = strip.y0 + 0.2 if side == 1 else strip.y1 - 0.2 - depth
            area = Rect(x0, y0, x0 + float(self._rng.uniform(5.0, 8.0)), y0 + depth)
            self._streets.work_areas.append(area)
            middle = 0.5 * (area.y0 + area.y1)
            for x in (area.x0 - 0.25, area.x1 + 0.25):
                self._add("barrier", np.array((depth - 0.1, 0.45, 1.05)), x, middle, math.pi / 2.0)
            panels = max(round(area.width / 2.5), 1)
            for i in range(panels):
                x = area.x0 + (i + 0.5) * area.width / panels
                y = area.y1 if side == 1 else area.y0
                self._add("fence", np.array((area.width / panels - 0.15, 0.14, 1.1)), x, y, 0.0)
            self._taken.append(area.inset(-1.5, -0.5, -1.5, -0.5))

    def _draw(self, mix: dict[str, int]) -> tuple[str, FloatArray]:
        """A kind, and its length, depth and height in [m]."""
        names = list(mix)
        weights = np.array(list(mix.values()), dtype=np.float64)
        drawn = self._rng.choice(len(names), p=weights / weights.sum())
        name = names[int(drawn)]
        entry = CATALOGUE[name]
        low, high = np.array((entry.length, entry.depth, entry.height)).T
        return name, np.round(self._rng.uniform(low, high), 2)

    def _spacing(self, distribution: tuple[float, float]) -> float:
        if self._rng.random() < _GROUP_SHARE:
            return float(self._rng.uniform(*_GROUP_SPACING))
        median, spread = distribution
        return max(median * math.exp(spread * self._rng.standard_normal()), 1.0)

    def _place(
        self,
        name: str,
        size: FloatArray,
        x: float,
        y: float,
        yaw: float,
        margin: float,
    ) -> None:
        """Add a piece unless something is within ``margin`` [m]."""
        area = bounds(_outline(name, size, x, y, yaw)).grown(margin)
        if not any(area.overlaps(taken) for taken in self._taken):
            self._add(name, size, x, y, yaw)

    def _add(self, name: str, size: FloatArray, x: float, y: float, yaw: float) -> None:
        outline = _outline(name, size, x, y, yaw)
        self.pieces.append(Obstacle(_KINDS.get(name, name), outline, float(size[2])))
        self._count += PIECE_AREA[0] <= polygon_area(outline) <= PIECE_AREA[1]
        self._taken.append(bounds(outline))


def _outline(name: str, size: FloatArray, x: float, y: float, yaw: float) -> FloatArray:
    if CATALOGUE[name].is_post:
        return np.round(octagon(x, y, 0.5 * float(size[0])), 3)
    return np.round(box(x, y, yaw, float(size[0]), float(size[1])), 3)
