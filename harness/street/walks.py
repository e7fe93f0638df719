"""Lines along which people walk: drawn ways, sides of streets, and crossings between them."""

from collections import Counter, defaultdict
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.ops import substring

from harness.street.osm_file import Extract, MappedThing
from harness.street.rules import (
    RULES,
    carriageway_width,
    sidewalk_sides,
    tagged_length,
    walk_kind,
    walk_width,
)

# [m] of a side of a street that is filled in, or is not, as a whole
_CHUNK = 20.0
_BESIDE = 6.0  # [m] a drawn way as near as this to a side of a street is its sidewalk
_LEAST_CHUNK = 3.0  # [m]
_SAMPLES = 5  # points of a chunk that are looked at
_RAISED = ("raised", "regular")  # kerb= of a step


@dataclass(frozen=True, slots=True, eq=False)
class Walk:
    """A line with a width along which people walk."""

    kind: str  # a key of the rules' ``walk_widths``
    line: shapely.Geometry  # [m]
    width: float  # [m]
    source: str  # 'drawn', 'tag' of a street, or 'rule' where nothing says so
    has_width: bool = False  # a tag gives the width
    has_signals: bool = False  # of a crossing
    has_step: bool = False  # of a crossing: its kerbs are raised

    @property
    def polygon(self) -> shapely.Geometry:
        """The ground that it takes [m]."""
        return self.line.buffer(0.5 * self.width, cap_style="flat", join_style="mitre")


@dataclass(frozen=True, slots=True, eq=False)
class Street:
    """A carriageway."""

    tags: dict[str, str]
    line: shapely.Geometry  # [m] its middle
    width: float  # [m] between kerbs
    nodes: tuple[int, ...]

    @property
    def polygon(self) -> shapely.Geometry:
        """The ground between its kerbs [m]."""
        return self.line.buffer(0.5 * self.width)


def streets_of(extract: Extract) -> list[Street]:
    """The carriageways of an extract."""
    return [
        Street(thing.tags, thing.geometry, carriageway_width(thing.tags), thing.nodes)
        for thing in extract.lines
        if thing.tags.get("highway") in RULES.carriageways
    ]


def drawn_walks(extract: Extract) -> list[Walk]:
    """The ways for people that somebody drew, crossings among them; no steps."""
    at_node = {point.nodes[0]: point.tags for point in extract.points}
    found = []
    for thing in extract.lines:
        kind = walk_kind(thing.tags)
        if not kind or kind == "steps" or not is_open(thing.tags):
            continue
        if thing.tags.get("area") == "yes":
            continue  # an area, which is read as one
        width, has_width = walk_width(thing.tags, kind)
        signals, step = False, False
        if kind == "crossing":
            signals, step = _crossing_tags(thing, at_node)
        walk = Walk(kind, thing.geometry, width, "drawn", has_width, signals, step)
        found.append(walk)
    return found


def is_open(tags: dict[str, str]) -> bool:
    """Whether people may walk there."""
    if tags.get("foot") in ("yes", "designated", "permissive"):
        return True
    return tags.get("access") not in ("private", "no") and tags.get("foot") not in ("no", "private")


def _crossing_tags(thing: MappedThing, at_node: dict[int, dict[str, str]]) -> tuple[bool, bool]:
    """Whether a crossing has signals, and whether its kerbs are steps."""
    tags = [thing.tags, *(at_node[node] for node in thing.nodes if node in at_node)]
    has_signals = any(each.get("crossing") == "traffic_signals" for each in tags)
    has_signals |= any(each.get("crossing:signals") == "yes" for each in tags)
    return has_signals, any(each.get("kerb") in _RAISED for each in tags)


def side_walks(
    streets: list[Street], drawn: shapely.Geometry, rng: np.random.Generator
) -> list[Walk]:
    """Sidewalks on those sides of streets where tags or the rules say so and none is drawn.

    Args:
        streets: the carriageways.
        drawn: [m] lines and areas for people that are drawn, without crossings.
        rng: of the widths that no tag gives.
    """
    tree = shapely.STRtree(shapely.get_parts(drawn))
    usual, spread = RULES.walk_widths["sidewalk"], RULES.street["sidewalk_spread"]
    found = []
    for street in streets:
        for side, source in sidewalk_sides(street.tags).items():
            width = usual * float(rng.uniform(1.0 - spread, 1.0 + spread))
            tagged = _side_width(street.tags, side)
            if tagged is not None:
                width = tagged
            offset = 0.5 * (street.width + width)
            if side == "right":
                offset = -offset
            line = shapely.offset_curve(street.line, offset, join_style="mitre")
            found += [
                Walk("sidewalk", chunk, width, source, tagged is not None)
                for chunk in _chunks(line)
                if not _is_drawn(chunk, tree)
            ]
    return found


def _is_drawn(chunk: shapely.Geometry, tree: shapely.STRtree) -> bool:
    """Whether most of a part of a street's side has a drawn way beside it."""
    along = np.linspace(0.1, 0.9, _SAMPLES)
    points = shapely.line_interpolate_point(chunk, along, normalized=True)
    near, _ = tree.query(points, predicate="dwithin", distance=_BESIDE)
    return bool(len(np.unique(near)) > _SAMPLES // 2)


def _side_width(tags: dict[str, str], side: str) -> float | None:
    keys = (f"sidewalk:{side}:width", "sidewalk:both:width", "sidewalk:width")
    lengths = [tagged_length(tags, key) for key in keys]
    return next((length for length in lengths if length is not None), None)


def _chunks(line: shapely.Geometry) -> Iterator[shapely.Geometry]:
    for part in shapely.get_parts(line):
        if part.length < _LEAST_CHUNK:
            continue
        count = max(round(part.length / _CHUNK), 1)
        step = part.length / count
        for number in range(count):
            yield substring(part, number * step, (number + 1) * step)


def more_crossings(
    extract: Extract, streets: list[Street], walks: list[Walk], sides: list[Walk]
) -> list[Walk]:
    """Crossings that are drawn as a node of a street only, and those that the rules fill in.

    A filled one lies at each arm of a junction that has filled sidewalks and no crossing near.
    """
    on_walks = [walk.line for walk in walks if walk.kind == "crossing"]
    marked = [
        point
        for point in extract.points
        if point.tags.get("highway") == "crossing" and point.tags.get("crossing") != "no"
    ]
    lines = shapely.union_all([walk.line for walk in walks])
    by_node: dict[int, list[Street]] = defaultdict(list)
    for street in streets:
        for node in set(street.nodes):
            by_node[node].append(street)
    found = []
    for point in marked:
        across = by_node.get(point.nodes[0], [])
        if across and not shapely.dwithin(lines, point.geometry, 1.0):
            signals, step = _crossing_tags(point, {})
            line = _across(across[0], across[0].line.project(point.geometry))
            found.append(_crossing(line, "drawn", signals, step))
    known = shapely.union_all([*on_walks, *(walk.line for walk in found)])
    return found + _filled_crossings(streets, sides, known)


def _filled_crossings(
    streets: list[Street], sides: list[Walk], known: shapely.Geometry
) -> list[Walk]:
    filled = shapely.union_all([walk.line for walk in sides])
    arms = Counter(node for street in streets for node in _arms(street.nodes))
    widest: dict[int, float] = defaultdict(float)
    for street in streets:
        for node in street.nodes:
            widest[node] = max(widest[node], street.width)
    found: list[Walk] = []
    for street in streets:
        for node, start, direction in _directions(street):
            if arms[node] < 3:
                continue
            away = 0.5 * widest[node] + RULES.street["crossing_setback"]
            along = start + direction * away
            if not 1.0 <= along <= street.line.length - 1.0:
                continue
            place = street.line.interpolate(along)
            reach = RULES.street["crossing_reach"]
            if shapely.dwithin(known, place, reach) or not shapely.dwithin(filled, place, 10.0):
                continue
            if any(shapely.dwithin(walk.line, place, 0.5 * away) for walk in found):
                continue
            line = _across(street, along)
            found.append(_crossing(line, "rule", False, False))
    return found


def _arms(nodes: tuple[int, ...]) -> Iterator[int]:
    """Each node of a way, twice where the way goes on."""
    yield from nodes
    yield from nodes[1:-1]


def _directions(street: Street) -> Iterator[tuple[int, float, float]]:
    """Each node of a way: its number, its place along the way [m], and where the way leads on.

    That is 1 towards the way's end, -1 towards its begin.
    """
    corners = shapely.get_coordinates(street.line)
    steps = np.hypot(*np.diff(corners, axis=0).T)
    along = np.concatenate(((0.0,), np.cumsum(steps)))
    for node, place in zip(street.nodes, along.tolist(), strict=True):
        yield node, place, 1.0
        yield node, place, -1.0


def _across(street: Street, along: float) -> shapely.Geometry:
    """A line over a street, from the middle of one sidewalk to that of the other [m]."""
    half = 0.5 * street.width + 0.5 * RULES.walk_widths["sidewalk"]
    before = shapely.get_coordinates(street.line.interpolate(max(along - 1.0, 0.0)))[0]
    after = shapely.get_coordinates(street.line.interpolate(along + 1.0))[0]
    middle = shapely.get_coordinates(street.line.interpolate(along))[0]
    direction = (after - before) / max(float(np.hypot(*(after - before))), 1e-9)
    normal = np.array((-direction[1], direction[0]))
    return shapely.LineString((middle - half * normal, middle + half * normal))


def _crossing(line: shapely.Geometry, source: str, signals: bool, step: bool) -> Walk:
    width = RULES.walk_widths["crossing"]
    return Walk("crossing", line, width, source, False, signals, step)
