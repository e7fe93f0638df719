"""The streets of the sidewalk world.

Blocks, sidewalks, buildings, lawns, alleys, crosswalks, plaza, building site.
"""

from dataclasses import dataclass, field

import numpy as np

from harness.world.map.scene import Obstacle, Zone
from harness.world.map.shapes import Rect, bounds

HALF_SIZE = 100.0  # [m] the world reaches from -100 to 100 on both axes
COLUMNS, ROWS = 4, 3  # city blocks
_EDGE = 1.5  # [m] depth of the facades around the world
_OUTER_ROAD = 5.0  # [m] between those facades and the blocks
_ROAD_WIDTHS = (7.0, 9.5)  # [m]
_SIDEWALK_WIDTHS = (2.7, 2.9, 3.1, 3.3, 3.6, 4.0, 4.4, 10.4)  # [m] equally often
_ALLEY_WIDTHS = (1.1, 3.0)  # [m] evenly spread over a city's alleys
# of the blocks with buildings are cut by alleys along both axes, the others along one
_QUARTERED_SHARE = 0.75
_CUT = (0.35, 0.65)  # of a block's extent, where an alley cuts it
_CROSSWALK_WIDTHS = (2.6, 3.8)  # [m]
# of the roads between two blocks have a crosswalk at both ends, the others at one
_DOUBLE_CROSSING_SHARE = 0.5
# Vertical curbs are 0.10 to 0.20 m high (AASHTO, A Policy on Geometric Design of Highways and
# Streets, "Curbs"). Crosswalks are raised ones: at sidewalk level from curb to curb.
CURB_HEIGHT = 0.12  # [m] of sidewalks, plazas and lawns above the road
_LAWN_SHARE = 0.25  # of the lots are lawns instead of buildings


@dataclass(frozen=True, slots=True)
class Block:
    """One city block: buildings in the middle, a sidewalk on each side."""

    area: Rect  # including the sidewalks
    widths: tuple[float, float, float, float]  # [m] of the sidewalks: left, bottom, right, top
    use: str  # 'buildings' or 'plaza'

    @property
    def interior(self) -> Rect:
        """What the sidewalks enclose."""
        return self.area.inset(*self.widths)

    def strip(self, side: int) -> Rect:
        """The sidewalk along one side (index of ``widths``), corners included."""
        a, (left, bottom, right, top) = self.area, self.widths
        return (
            Rect(a.x0, a.y0, a.x0 + left, a.y1),
            Rect(a.x0, a.y0, a.x1, a.y0 + bottom),
            Rect(a.x1 - right, a.y0, a.x1, a.y1),
            Rect(a.x0, a.y1 - top, a.x1, a.y1),
        )[side]


@dataclass(slots=True)
class Streets:
    """A city plan under construction."""

    blocks: list[Block] = field(default_factory=list)
    crosswalks: list[Rect] = field(default_factory=list)
    plazas: list[Rect] = field(default_factory=list)
    construction: list[Rect] = field(default_factory=list)
    work_areas: list[Rect] = field(default_factory=list)
    lawns: list[Rect] = field(default_factory=list)
    buildings: list[Obstacle] = field(default_factory=list)

    def zones(self) -> tuple[Zone, ...]:
        """The ground: road everywhere, the rest on top of it, later zones over earlier ones."""
        world = Rect(-HALF_SIZE, -HALF_SIZE, HALF_SIZE, HALF_SIZE)
        parts = [("road", world)]
        parts += [("sidewalk", block.area) for block in self.blocks]
        parts += [("lawn", area) for area in self.lawns]
        parts += [("crosswalk", area) for area in self.crosswalks]
        parts += [("plaza", area) for area in self.plazas]
        parts += [("construction", area) for area in self.construction]
        parts += [("work_area", area) for area in self.work_areas]
        return tuple(
            Zone(kind, np.round(area.polygon, 3), -CURB_HEIGHT if kind == "road" else 0.0)
            for kind, area in parts
        )


def lay_out(rng: np.random.Generator, widening: float = 0.0) -> Streets:
    """Draw a city plan.

    Args:
        rng: where it is drawn from.
        widening: [m] by which every sidewalk is wider than drawn, and the road beside it narrower.
    """
    streets = Streets()
    lanes_x, lanes_y = _lanes(rng, COLUMNS), _lanes(rng, ROWS)
    widths = (
        rng.permutation(np.resize(_SIDEWALK_WIDTHS, 4 * COLUMNS * ROWS)).reshape(-1, 4) + widening
    )
    plaza = int(rng.integers(COLUMNS * ROWS))
    for number in range(COLUMNS * ROWS):
        row, column = divmod(number, COLUMNS)
        (x0, x1), (y0, y1) = lanes_x[column], lanes_y[row]
        drawn = Rect(x0, y0, x1, y1)
        area, use = drawn.grown(widening), "buildings"
        if number == plaza:
            use = "plaza"
        streets.blocks.append(Block(area, tuple(widths[number].tolist()), use))
    _add_crosswalks(streets, rng)
    alleys = _alleys(rng, len(streets.blocks) - 1)
    for block in streets.blocks:
        if block.use == "plaza":
            _build_plaza(streets, block, rng)
        else:
            _build_block(streets, block, alleys.pop(), rng)
    _sow_lawns(streets, rng)
    _open_construction_site(streets, rng)
    _add_world_edge(streets, rng)
    return streets


def _lanes(rng: np.random.Generator, count: int) -> list[tuple[float, float]]:
    """Extents of ``count`` rows of blocks along one axis, with roads between them, in [m]."""
    free = 2.0 * (HALF_SIZE - _EDGE - _OUTER_ROAD)
    roads = rng.uniform(*_ROAD_WIDTHS, size=count - 1)
    shares = rng.uniform(0.85, 1.15, size=count)
    sizes = np.round((free - roads.sum()) * shares / shares.sum(), 1)
    starts = (
        -HALF_SIZE + _EDGE + _OUTER_ROAD + np.concatenate(((0.0,), np.cumsum(sizes[:-1] + roads)))
    )
    return [
        (round(float(start), 2), round(float(start + size), 2))
        for start, size in zip(starts, sizes, strict=True)
    ]


def _add_crosswalks(streets: Streets, rng: np.random.Generator) -> None:
    """One or two crossings between neighbouring blocks, near the ends of the road between them."""
    ends = _crossing_ends(rng, ROWS * (COLUMNS - 1) + COLUMNS * (ROWS - 1))
    for number, block in enumerate(streets.blocks):
        row, column = divmod(number, COLUMNS)
        if column + 1 < COLUMNS:
            a, b = block.area, streets.blocks[number + 1].area
            for low, high in _crossing_spans(rng, ends.pop(), a.y0, a.y1):
                streets.crosswalks.append(Rect(a.x1, low, b.x0, high))
        if row + 1 < ROWS:
            a, b = block.area, streets.blocks[number + COLUMNS].area
            for low, high in _crossing_spans(rng, ends.pop(), a.x0, a.x1):
                streets.crosswalks.append(Rect(low, a.y1, high, b.y0))


def _crossing_ends(rng: np.random.Generator, roads: int) -> list[slice]:
    """Which of a road's two ends have a crosswalk, for each road.

    Where it is one, as often the first as the last.
    """
    both, first, last = slice(0, 2), slice(0, 1), slice(1, 2)
    double = round(_DOUBLE_CROSSING_SHARE * roads)
    ends = [both] * double + [first, last] * roads
    return [ends[k] for k in rng.permutation(roads)]


def _crossing_spans(
    rng: np.random.Generator,
    ends: slice,
    start: float,
    end: float,
) -> list[tuple[float, float]]:
    """Extents [m] of the crosswalks over a road that runs from ``start`` to ``end``."""
    widths = rng.uniform(*_CROSSWALK_WIDTHS, size=2)
    offsets = rng.uniform(0.5, 1.5, size=2)
    spans = [
        (start + offsets[0], start + offsets[0] + widths[0]),
        (end - offsets[1] - widths[1], end - offsets[1]),
    ]
    return spans[ends]


def _alleys(rng: np.random.Generator, blocks: int) -> list[list[float]]:
    """Widths [m] of each block's alleys.

    One across it, and for the share that is quartered one across each half.
    """
    quartered = round(_QUARTERED_SHARE * blocks)
    widths = rng.permutation(np.linspace(*_ALLEY_WIDTHS, blocks + 2 * quartered)).tolist()
    alleys = []
    for block in rng.permutation(blocks):
        count = 1
        if block < quartered:
            count = 3
        alleys.append([widths.pop() for _ in range(count)])
    return alleys


def _build_block(
    streets: Streets,
    block: Block,
    alleys: list[float],
    rng: np.random.Generator,
) -> None:
    """Fill a block with buildings that alleys part and that stand back from the sidewalk."""
    inner = block.interior
    along_x = inner.width >= inner.depth
    parts = _split(inner, along_x, rng.uniform(*_CUT), alleys[0])
    if len(alleys) > 1:
        halves, parts = parts, []
        for half, alley in zip(halves, alleys[1:], strict=True):
            parts += _split(half, not along_x, rng.uniform(*_CUT), alley)
    for part in parts:
        for lot in _lots(part, rng):
            faces = _setbacks(lot, inner, rng)
            _add_building(streets, lot.inset(*faces), rng)


def _split(area: Rect, along_x: bool, share: float, gap: float) -> list[Rect]:
    """Two parts of a rectangle with a gap [m] between them."""
    if along_x:
        middle = area.x0 + share * area.width
        return [
            Rect(area.x0, area.y0, middle - gap / 2, area.y1),
            Rect(middle + gap / 2, area.y0, area.x1, area.y1),
        ]
    middle = area.y0 + share * area.depth
    return [
        Rect(area.x0, area.y0, area.x1, middle - gap / 2),
        Rect(area.x0, middle + gap / 2, area.x1, area.y1),
    ]


def _lots(area: Rect, rng: np.random.Generator) -> list[Rect]:
    """Cut a rectangle into lots of at most ~22 m."""
    if max(area.width, area.depth) < 22.0:
        return [area]
    halves = _split(area, area.width >= area.depth, rng.uniform(0.38, 0.62), 0.0)
    return [lot for half in halves for lot in _lots(half, rng)]


def _setbacks(lot: Rect, inner: Rect, rng: np.random.Generator) -> tuple[float, ...]:
    """How far [m] a building stands back on each side that faces a sidewalk."""
    depths = rng.choice((0.0, 0.0, 0.3, 0.6, 1.2, 2.0), size=4)
    faces = (lot.x0 == inner.x0, lot.y0 == inner.y0, lot.x1 == inner.x1, lot.y1 == inner.y1)
    return tuple(float(depth) if face else 0.0 for depth, face in zip(depths, faces, strict=True))


def _add_building(streets: Streets, area: Rect, rng: np.random.Generator) -> None:
    height = round(float(rng.uniform(6.0, 24.0)), 1)
    streets.buildings.append(Obstacle("building_glass", np.round(area.polygon, 3), height))


def _build_plaza(streets: Streets, block: Block, rng: np.random.Generator) -> None:
    """A square with one row of buildings behind it."""
    inner = block.interior
    depth = rng.uniform(0.25, 0.35) * inner.depth
    split = inner.y0 + depth
    for lot in _lots(Rect(inner.x0, inner.y0, inner.x1, split), rng):
        _add_building(streets, lot, rng)
    streets.plazas.append(Rect(inner.x0, split, inner.x1, inner.y1))


def _sow_lawns(streets: Streets, rng: np.random.Generator) -> None:
    """Turn some buildings into lawns: nobody walks there, and the lidar sees across."""
    buildings, streets.buildings = streets.buildings, []
    order = rng.permutation(len(buildings)).tolist()
    chosen = set(order[: round(_LAWN_SHARE * len(buildings))])
    for number, building in enumerate(buildings):
        if number in chosen:
            streets.lawns.append(bounds(building.polygon))
        else:
            streets.buildings.append(building)


def _open_construction_site(streets: Streets, rng: np.random.Generator) -> None:
    """Turn one building of a block's edge into a fenced building site."""
    large = [
        k
        for k, building in enumerate(streets.buildings)
        if np.ptp(building.polygon, axis=0).min() > 10.0
    ]
    chosen = streets.buildings.pop(large[int(rng.integers(len(large)))])
    streets.construction.append(bounds(chosen.polygon))


def _add_world_edge(streets: Streets, rng: np.random.Generator) -> None:
    """Facades on the far side of the outermost roads, so that the world ends at a wall."""
    h, cuts = HALF_SIZE, np.linspace(-HALF_SIZE, HALF_SIZE, 9)
    for low, high in zip(cuts[:-1], cuts[1:], strict=True):
        for area in (
            Rect(-h, low, -h + _EDGE, high),
            Rect(h - _EDGE, low, h, high),
            Rect(low, -h, high, -h + _EDGE),
            Rect(low, h - _EDGE, high, h),
        ):
            _add_building(streets, area, rng)
