"""Narrow streets between houses, where people share the carriageway."""

from collections.abc import Iterator

import numpy as np
import shapely
from shapely.ops import substring

from harness.street.links import HALF
from harness.street.rules import RULES, is_open_on_foot, sidewalk_sides
from harness.street.walks import Street, Walk, pieces_of
from navstack.types import BoolArray

_STEP = 0.5  # [m] along a street, at which it is looked at
_LEAST = 1.0  # [m] of a street without a way beside it
_LONGER = 2.0  # [m] that people walk on the carriageway before and after
_OVERLAP = 0.1  # [m] of it and the ways beside it


def alleys(
    streets: list[Street],
    walks: list[Walk],
    medians: list[Walk],
    built: list[shapely.Geometry],
) -> list[Walk]:
    """The parts of carriageways beside which houses stand where the ways for people would be.

    Args:
        streets: the carriageways.
        walks: drawn ways and sides of streets.
        medians: sides that lie between two carriageways, of which nobody shares either.
        built: [m] houses and barriers.
    """
    carriageways = shapely.STRtree([street.polygon for street in streets])
    ways = shapely.STRtree([walk.polygon for walk in walks])
    houses = shapely.STRtree(built)
    sides = [walk for walk in walks if walk.source != "drawn"]
    if not sides:
        return []
    blocked = houses.query([walk.polygon for walk in sides], predicate="intersects")[0]
    narrow = shapely.STRtree([sides[number].line for number in np.unique(blocked)])
    between = shapely.STRtree([walk.line for walk in medians if not _is_built_on(walk, houses)])
    found = []
    for street in filter(_may_be_shared, streets):
        reach = street.width + max(walk.width for walk in sides)
        width = street.width + 2.0 * _OVERLAP
        for number, piece in enumerate(pieces_of(street.line)):
            is_dual = len(between.query(piece, predicate="dwithin", distance=street.width))
            if is_dual or not len(narrow.query(piece, predicate="dwithin", distance=reach)):
                continue
            at = number * piece.length
            around = piece.buffer(reach, cap_style="flat")
            there = _within(around, ways).difference(_within(around, carriageways))
            free = there.difference(_within(around, houses))
            is_shut = _is_passed(piece, there) & ~_is_passed(piece, free)
            for begin, end in _runs(is_shut):
                part = _part(street.line, at + begin - _LONGER, at + end + _LONGER)
                found.append(Walk("living_street", part, width, "rule"))
    return found


def _may_be_shared(street: Street) -> bool:
    """Whether people may walk on a street that should have ways beside it."""
    is_of_town = street.tags["highway"] in RULES.street["has_sidewalks"]
    return is_of_town and is_open_on_foot(street.tags) and bool(sidewalk_sides(street.tags))


def _is_built_on(walk: Walk, houses: shapely.STRtree) -> bool:
    """Whether houses take most of a way's ground; a rail along a median takes little."""
    return bool(_within(walk.polygon, houses).area > 0.5 * walk.polygon.area)


def _part(line: shapely.Geometry, begin: float, end: float) -> shapely.Geometry:
    """The part of a line between two distances [m] along it, straight on beyond its ends."""
    part = substring(line, max(begin, 0.0), min(end, line.length))
    corners = shapely.get_coordinates(shapely.remove_repeated_points(part))
    first, last = corners[0] - corners[1], corners[-1] - corners[-2]
    first *= max(-begin, 0.0) / np.hypot(*first)
    last *= max(end - line.length, 0.0) / np.hypot(*last)
    return shapely.LineString(np.vstack((corners[0] + first, corners[1:-1], corners[-1] + last)))


def _within(around: shapely.Geometry, tree: shapely.STRtree) -> shapely.Geometry:
    near = tree.geometries[tree.query(around, predicate="intersects")]
    return shapely.intersection(shapely.union_all(near), around)


def _is_passed(piece: shapely.Geometry, ground: shapely.Geometry) -> BoolArray:
    """Where along a piece of a street somebody passes on the ground beside it."""
    stations = np.arange(0.0, piece.length, _STEP)
    passed = np.zeros(len(stations), dtype=np.bool_)
    for part in shapely.get_parts(ground.buffer(-HALF)):
        if not part.is_empty:
            corners = shapely.points(shapely.get_coordinates(part))
            along = shapely.line_locate_point(piece, corners)
            passed |= (stations >= along.min() - HALF) & (stations <= along.max() + HALF)
    return passed


def _runs(marked: BoolArray) -> Iterator[tuple[float, float]]:
    """Begin and end [m] of each stretch that is marked and long enough."""
    edges = np.flatnonzero(np.diff(np.concatenate(((False,), marked, (False,)))))
    for first, last in zip(edges[::2], edges[1::2], strict=True):
        if (last - first) * _STEP > _LEAST:
            yield float(first) * _STEP, float(last) * _STEP
