"""Crossings that nobody drew as a way: nodes of a street, and those that the rules fill in."""

from collections import Counter, defaultdict
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import shapely

from harness.street.osm_file import Extract
from harness.street.rules import RULES
from harness.street.walks import BESIDE, Street, Walk, crossing_tags, has_signals
from navstack.types import FloatArray

_JUNCTION = 3  # arms of a node at which streets meet
_NEAR = 10.0  # [m] of an arm to the sidewalks that are filled in along its street
_FARTHER = 8  # [m] by which a crossing between drawn ways may lie farther from its junction


def more_crossings(
    extract: Extract, streets: list[Street], walks: list[Walk], sides: list[Walk]
) -> list[Walk]:
    """Crossings that are drawn as a node of a street only, and those that the rules fill in.

    A filled one lies at each arm of a junction that has sidewalks on both sides and no crossing
    near. Where the junction has signals, it has them, too.
    """
    drawn = [walk.line for walk in walks if walk.kind == "crossing"]
    arms = Counter(node for street in streets for node in _arms(street.nodes))
    at_nodes = _crossings_at_nodes(extract, streets, walks, arms)
    known = shapely.union_all([*drawn, *(walk.line for walk in at_nodes)])
    return at_nodes + _filled_crossings(streets, sides, walks, known, _signals(extract), arms)


def _signals(extract: Extract) -> set[int]:
    """The nodes with traffic signals."""
    return {
        point.nodes[0]
        for point in extract.points
        if point.tags.get("highway") == "traffic_signals" or has_signals(point.tags)
    }


def _crossings_at_nodes(
    extract: Extract, streets: list[Street], walks: list[Walk], arms: Counter[int]
) -> list[Walk]:
    """Those at nodes between junctions; at a junction each arm has one, by the rules."""
    lines = shapely.union_all([walk.line for walk in walks])
    by_node: dict[int, Street] = {}
    for street in streets:
        for node in street.nodes:
            by_node.setdefault(node, street)
    found = []
    for point in extract.points:
        if not _is_crossing(point.tags):
            continue
        node = point.nodes[0]
        if node not in by_node or arms[node] >= _JUNCTION:
            continue
        if shapely.dwithin(lines, point.geometry, 1.0):
            continue
        street = by_node[node]
        signals, step = crossing_tags(point, {})
        line = _across(street, street.line.project(point.geometry))
        found.append(_crossing(line, "drawn", signals, step))
    return found


def _is_crossing(tags: dict[str, str]) -> bool:
    """Whether a node of a street is a crossing; one at signals may have their tag instead."""
    if tags.get("highway") == "traffic_signals":
        return tags.get("crossing", "no") != "no"
    return tags.get("highway") == "crossing" and tags.get("crossing") != "no"


def _filled_crossings(
    streets: list[Street],
    sides: list[Walk],
    walks: list[Walk],
    known: shapely.Geometry,
    signals: set[int],
    arms: Counter[int],
) -> list[Walk]:
    filled = shapely.union_all([walk.line for walk in sides])
    beside = [walk.line for walk in walks if walk.kind not in ("crossing", "service")]
    drawn = shapely.STRtree(beside)
    found: list[Walk] = []
    for arm in _arms_of_junctions(streets, arms):
        street, away = arm.street, arm.away
        place = street.line.interpolate(arm.place(0.0))
        if shapely.dwithin(known, place, RULES.street["crossing_reach"]):
            continue
        if any(shapely.dwithin(walk.line, place, 0.5 * away) for walk in found):
            continue
        if shapely.dwithin(filled, place, _NEAR):
            line = _across(street, arm.place(0.0))
        else:
            line = _first_between_drawn(arm, drawn)
        if line is not None:
            found.append(_crossing(line, "rule", arm.node in signals, False))
    return found


@dataclass(frozen=True, slots=True)
class _Arm:
    """A street that leaves a junction."""

    street: Street
    node: int
    start: float  # [m] of the junction along the street
    direction: float  # 1: towards the street's end, -1: towards its begin
    away: float  # [m] from the junction to where it may be crossed

    def place(self, farther: float) -> float:
        """Where it may be crossed, along the street [m]; or some metres farther away."""
        return self.start + self.direction * (self.away + farther)

    def reaches(self, farther: float) -> bool:
        """Whether the street leads as far as that."""
        return bool(1.0 <= self.place(farther) <= self.street.line.length - 1.0)


def _arms_of_junctions(streets: list[Street], arms: Counter[int]) -> Iterator[_Arm]:
    """The arms that are long enough for a crossing.

    Nobody crosses to a roundabout's island, or where a ramp meets a motorway.
    """
    widest: dict[int, float] = defaultdict(float)
    closed: set[int] = set()
    for street in streets:
        for node in street.nodes:
            widest[node] = max(widest[node], street.width)
        if street.tags["highway"] == "motorway":
            closed.update(street.nodes)
    for street in streets:
        if street.inner_side:
            continue
        for node, start, direction in _directions(street):
            away = 0.5 * widest[node] + RULES.street["crossing_setback"]
            arm = _Arm(street, node, start, direction, away)
            if arms[node] >= _JUNCTION and node not in closed and arm.reaches(0.0):
                yield arm


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
    middle, normal = _cut(street, along)
    return shapely.LineString((middle - half * normal, middle + half * normal))


def _first_between_drawn(arm: _Arm, drawn: shapely.STRtree) -> shapely.Geometry | None:
    """The line nearest to a junction that joins the ways beside an arm; None: there is none."""
    for farther in range(_FARTHER):
        if arm.reaches(farther):
            line = _between_drawn(arm.street, arm.place(farther), drawn)
            if line is not None:
                return line
    return None


def _between_drawn(street: Street, along: float, drawn: shapely.STRtree) -> shapely.Geometry | None:
    """A line over a street between the ways that are drawn beside it; None: one side has none."""
    far = 0.5 * street.width + BESIDE
    middle, normal = _cut(street, along)
    ends = []
    for side in (-1.0, 1.0):
        ray = shapely.LineString((middle, middle + side * far * normal))
        met = shapely.intersection(drawn.geometries[drawn.query(ray, "intersects")], ray)
        if not len(met):
            return None
        distances = shapely.distance(met, shapely.Point(middle))
        ends.append(middle + side * float(distances.min()) * normal)
    return shapely.LineString(ends)


def _cut(street: Street, along: float) -> tuple[FloatArray, FloatArray]:
    """The middle of a street (2,) [m] at a place along it, and the direction (2,) to its left."""
    before = shapely.get_coordinates(street.line.interpolate(max(along - 1.0, 0.0)))[0]
    after = shapely.get_coordinates(street.line.interpolate(along + 1.0))[0]
    middle = shapely.get_coordinates(street.line.interpolate(along))[0]
    direction = (after - before) / max(float(np.hypot(*(after - before))), 1e-9)
    return middle, np.array((-direction[1], direction[0]))


def _crossing(line: shapely.Geometry, source: str, signals: bool, step: bool) -> Walk:
    width = RULES.walk_widths["crossing"]
    return Walk("crossing", line, width, source, False, signals, step)
