"""Links that join parts of the walkable ground which the mapping leaves apart."""

import numpy as np
import shapely

from harness.street.rules import RULES
from harness.street.walks import Street, Walk

_HALF = 0.45  # [m] what is narrower on each side joins nothing
_LEAST_AREA = 3.0  # [m2] of a part that is joined
_ROUNDS = 4
_MEDIAN = 4.0  # [m] a filled side with a carriageway as near as this beyond it is a median


def without_medians(sides: list[Walk], streets: list[Street]) -> list[Walk]:
    """The filled sides of streets without those between two carriageways."""
    tree = shapely.STRtree([street.polygon for street in streets])
    kept = []
    for walk in sides:
        middle = walk.line.interpolate(0.5, normalized=True)
        beyond = middle.buffer(0.5 * walk.width + _MEDIAN)
        near = [streets[number] for number in tree.query(beyond, predicate="intersects")]
        if walk.source == "tag" or not _is_between(walk.line, near):
            kept.append(walk)
    return kept


def _is_between(line: shapely.Geometry, streets: list[Street]) -> bool:
    """Whether streets lie on both sides of the middle of a line."""
    middle = shapely.get_coordinates(line.interpolate(0.5, normalized=True))[0]
    ahead = shapely.get_coordinates(line.interpolate(0.6, normalized=True))[0] - middle
    sides = set()
    for street in streets:
        foot = street.line.interpolate(street.line.project(shapely.Point(middle)))
        to_street = shapely.get_coordinates(foot)[0] - middle
        across = ahead[0] * to_street[1] - ahead[1] * to_street[0]
        if abs(across) > 0.7 * np.hypot(*ahead) * np.hypot(*to_street):
            sides.add(bool(across > 0.0))
    return len(sides) == 2


def links_between(
    walkable: shapely.Geometry, built: shapely.Geometry, carriageways: shapely.Geometry
) -> list[Walk]:
    """The shortest lines that join parts of the walkable ground to others near by.

    Args:
        walkable: the ground [m].
        built: [m] what a link does not lead through.
        carriageways: [m] a link over one is a crossing.
    """
    found: list[Walk] = []
    ground = walkable
    shapely.prepare(built)
    shapely.prepare(carriageways)
    for _ in range(_ROUNDS):
        parts = shapely.get_parts(ground.buffer(-_HALF))
        parts = parts[shapely.area(parts) >= _LEAST_AREA]
        largest = int(np.argmax(shapely.area(parts))) if len(parts) else -1
        made: list[Walk] = []
        tree = shapely.STRtree(parts)
        for number, part in enumerate(parts):
            if number != largest:
                made += _link(number, part, parts, tree, built, carriageways)
        if not made:
            return found
        found += made
        ground = shapely.union_all([ground, *(link.polygon for link in made)])
    return found


def _link(
    number: int,
    part: shapely.Geometry,
    parts: "np.ndarray",
    tree: shapely.STRtree,
    built: shapely.Geometry,
    carriageways: shapely.Geometry,
) -> list[Walk]:
    reach = RULES.street["link_length"]
    near = tree.query(part, predicate="dwithin", distance=reach)
    lines = [shapely.shortest_line(part, parts[other]) for other in near if other != number]
    lines.sort(key=lambda line: line.length)
    for line in lines:
        if line.length > 0.0 and not shapely.intersects(built, line.buffer(_HALF)):
            kind, width = "footway", RULES.walk_widths["path"]
            if shapely.intersection(carriageways, line).length > 1.0:
                kind, width = "crossing", RULES.walk_widths["crossing"]
            return [Walk(kind, _longer(line), width, "rule")]
    return []


def _longer(line: shapely.Geometry) -> shapely.Geometry:
    """A straight line with half a metre more at both ends."""
    (first, last), by = shapely.get_coordinates(line), 0.5 / line.length
    return shapely.LineString((first + by * (first - last), last + by * (last - first)))
