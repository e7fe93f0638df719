"""Lines along which people walk: drawn ways and sides of streets."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.ops import substring

from harness.street.osm_file import Extract, MappedThing
from harness.street.rules import (
    RULES,
    carriageway_width,
    is_open,
    sidewalk_sides,
    tagged_length,
    walk_kind,
    walk_width,
)

# [m] of a side of a street that is filled in, or is not, as a whole
_PIECE = 20.0
BESIDE = 6.0  # [m] a drawn way as near as this to a side of a street is its sidewalk
_LEAST_PIECE = 3.0  # [m]
_SAMPLES = 5  # points of a chunk that are looked at
_ALONG = 0.7  # [-] least advance of a way along a side to that of the side
_ROUND = ("roundabout", "circular")  # junction=
_RAISED = ("raised", "regular")  # kerb= of a step
# crossing= of one with signals; the birds are those of British roads
_SIGNALLED = ("traffic_signals", "pelican", "puffin", "toucan", "pegasus")


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

    @property
    def inner_side(self) -> str:
        """The side of a roundabout's island, 'left' or 'right'; empty: it is no roundabout."""
        if self.tags.get("junction") not in _ROUND:
            return ""
        x, y = shapely.get_coordinates(self.line).T
        area = float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum())  # twice, signed
        if area < 0.0:
            return "right"
        return "left"  # of a straight piece, too: it is driven counter-clockwise in most countries


def streets_of(extract: Extract) -> list[Street]:
    """The carriageways of an extract that are drawn as lines."""
    return [
        Street(thing.tags, thing.geometry, carriageway_width(thing.tags), thing.nodes)
        for thing in extract.lines
        if thing.tags.get("highway") in RULES.carriageways and thing.tags.get("area") != "yes"
    ]


def street_areas(extract: Extract) -> list[shapely.Geometry]:
    """The carriageways that are drawn as areas [m], as a place where cars turn."""
    return [
        thing.geometry for thing in extract.areas if thing.tags.get("highway") in RULES.carriageways
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
        if kind == "crossing" and thing.tags.get("crossing") == "no":
            continue
        width, has_width = walk_width(thing.tags, kind)
        signals, step = False, False
        if kind == "crossing":
            signals, step = crossing_tags(thing, at_node)
        walk = Walk(kind, thing.geometry, width, "drawn", has_width, signals, step)
        found.append(walk)
    return found


def crossing_tags(thing: MappedThing, at_node: dict[int, dict[str, str]]) -> tuple[bool, bool]:
    """Whether a crossing has signals, and whether its kerbs are steps."""
    tags = [thing.tags, *(at_node[node] for node in thing.nodes if node in at_node)]
    has_step = any(each.get("kerb") in _RAISED for each in tags)
    return any(has_signals(each) for each in tags), has_step


def has_signals(tags: dict[str, str]) -> bool:
    """Whether a crossing has signals."""
    kinds = tags.get("crossing", "").split(";")
    return any(kind in _SIGNALLED for kind in kinds) or tags.get("crossing:signals", "no") != "no"


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
            if source == "rule" and side == street.inner_side:
                continue
            width = usual * float(rng.uniform(1.0 - spread, 1.0 + spread))
            tagged = _side_width(street.tags, side)
            if tagged is not None:
                width = tagged
            offset = 0.5 * (street.width + width)
            if side == "right":
                offset = -offset
            found += [
                Walk("sidewalk", chunk, width, source, tagged is not None)
                for part in _open_parts(street.line)
                for chunk in pieces_of(shapely.offset_curve(part, offset, join_style="mitre"))
                if not _is_drawn(chunk, tree)
            ]
    return found


def _open_parts(line: shapely.Geometry) -> list[shapely.Geometry]:
    """A line, or the halves of a loop: GEOS loses parts of the outer side of a loop as a whole."""
    corners = shapely.get_coordinates(line)[:-1]
    count = len(corners)
    if not line.is_closed or count < 3:
        return [line]
    half = count // 2
    # cut where it is straight, or the outer side would have a gap
    first = 0.5 * (corners[0] + corners[1])
    second = 0.5 * (corners[half] + corners[half + 1 - count])
    there = np.vstack((first, corners[1 : half + 1], second))
    back = np.vstack((second, corners[half + 1 :], corners[0], first))
    return [shapely.LineString(there), shapely.LineString(back)]


def _is_drawn(chunk: shapely.Geometry, tree: shapely.STRtree) -> bool:
    """Whether most of a part of a street's side has a drawn way along it."""
    along = np.linspace(0.1, 0.9, _SAMPLES)
    points = shapely.line_interpolate_point(chunk, along, normalized=True)
    near, ways = tree.query_nearest(points, max_distance=BESIDE, all_matches=False)
    if len(near) <= _SAMPLES // 2:
        return False
    feet = shapely.get_point(shapely.shortest_line(points[near], tree.geometries[ways]), 1)
    beside = shapely.line_locate_point(chunk, feet, normalized=True)
    return bool(np.ptp(beside) > _ALONG * np.ptp(along[near]))


def _side_width(tags: dict[str, str], side: str) -> float | None:
    keys = (f"sidewalk:{side}:width", "sidewalk:both:width", "sidewalk:width")
    lengths = [tagged_length(tags, key) for key in keys]
    return next((length for length in lengths if length is not None), None)


def pieces_of(line: shapely.Geometry) -> Iterator[shapely.Geometry]:
    """A line in pieces of about 20 m."""
    for part in shapely.get_parts(line):
        if part.length < _LEAST_PIECE:
            continue
        count = max(round(part.length / _PIECE), 1)
        step = part.length / count
        for number in range(count):
            yield substring(part, number * step, (number + 1) * step)
