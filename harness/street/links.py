"""Links that join parts of the walkable ground which the mapping leaves apart."""

import numpy as np
import shapely
from scipy.cluster.hierarchy import DisjointSet

from harness.street.rules import RULES
from harness.street.walks import Street, Walk
from navstack.types import BoolArray, IntArray

HALF = 0.45  # [m] what is narrower on each side joins nothing
_REACH = RULES.street["link_length"]  # [m]
_STEP = 1.0  # [m] between the ends of lines that are tried
_LEAST_AREA = 3.0  # [m2] of a part that is joined
_MEDIAN = 4.0  # [m] a filled side with a carriageway as near as this beyond it is a median


def without_medians(sides: list[Walk], streets: list[Street]) -> tuple[list[Walk], list[Walk]]:
    """The sides of streets, and those filled ones that lie between two carriageways."""
    tree = shapely.STRtree([street.polygon for street in streets])
    kept, medians = [], []
    for walk in sides:
        middle = walk.line.interpolate(0.5, normalized=True)
        beyond = middle.buffer(0.5 * walk.width + _MEDIAN)
        near = [streets[number] for number in tree.query(beyond, predicate="intersects")]
        if walk.source == "rule" and _is_between(walk.line, near):
            medians.append(walk)
        else:
            kept.append(walk)
    return kept, medians


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

    They are those of a spanning tree of the parts (Kruskal 1956), shorter ones first.

    Args:
        walkable: the ground [m].
        built: [m] what a link does not lead through.
        carriageways: [m] a link over one is a crossing.
    """
    parts = shapely.get_parts(walkable.buffer(-HALF))
    parts = parts[shapely.area(parts) >= _LEAST_AREA]
    shapely.prepare(built)
    pairs = shapely.STRtree(parts).query(parts, predicate="dwithin", distance=_REACH)
    first, second = pairs[:, pairs[0] < pairs[1]]
    joined = DisjointSet(range(len(parts)))
    shortest = shapely.shortest_line(parts[first], parts[second])
    lines = _joining(joined, first, second, shortest, built)
    apart = [not joined.connected(a, b) for a, b in zip(first, second, strict=True)]
    first, second = first[apart], second[apart]
    others = [_free_line(*pair, built) for pair in zip(parts[first], parts[second], strict=True)]
    lines += _joining(joined, first, second, np.array(others, dtype=object), built)
    return [_link(line, carriageways) for line in lines]


def _joining(
    joined: DisjointSet,
    first: IntArray,
    second: IntArray,
    lines: "np.ndarray",
    built: shapely.Geometry,
) -> list[shapely.Geometry]:
    """Those of the lines from first to second parts that join what is not yet joined."""
    found = []
    lengths = shapely.length(lines)
    is_free = _are_free(lines, built)
    for number in np.argsort(lengths, kind="stable"):
        is_link = lengths[number] > 0.0 and is_free[number]
        if is_link and joined.merge(first[number], second[number]):
            found.append(lines[number])
    return found


def _are_free(lines: "np.ndarray", built: shapely.Geometry) -> BoolArray:
    free: BoolArray = ~shapely.intersects(built, shapely.buffer(lines, HALF))
    return free


def _free_line(
    first: shapely.Geometry, second: shapely.Geometry, built: shapely.Geometry
) -> shapely.Geometry:
    """The shortest free line between the borders of two parts; empty: none of those tried is."""
    small, large = sorted((first, second), key=shapely.area)
    border = small.boundary
    along = np.arange(0.0, border.length, _STEP)
    points = shapely.line_interpolate_point(border, along)
    shapely.prepare(large)
    points = points[shapely.dwithin(points, large, _REACH)]
    lines = shapely.shortest_line(points, large)
    lines = lines[_are_free(lines, built)]
    if not len(lines):
        return shapely.LineString()
    return lines[int(np.argmin(shapely.length(lines)))]


def _link(line: shapely.Geometry, carriageways: shapely.Geometry) -> Walk:
    kind, width = "footway", RULES.walk_widths["path"]
    if shapely.intersection(carriageways, line).length > 1.0:
        kind, width = "crossing", RULES.walk_widths["crossing"]
    return Walk(kind, _longer(line), width, "rule")


def _longer(line: shapely.Geometry) -> shapely.Geometry:
    """A straight line with half a metre more at both ends."""
    (first, last), by = shapely.get_coordinates(line), 0.5 / line.length
    return shapely.LineString((first + by * (first - last), last + by * (last - first)))
