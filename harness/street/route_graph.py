"""The graph of a district's ways, in the form of Nav2's route server."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import shapely
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from harness.street.district import District
from harness.street.medial_axis import chains_of, medial_axis
from harness.street.osm_file import CREDIT
from harness.world.map.shapes import Rect
from navstack.errors import MapError
from navstack.types import BoolArray, FloatArray, IntArray

CLEARANCE = 0.45  # [m] of the ways to what is not walkable: a sidewalk robot's half width and more
_SPUR = 3.0  # [m] shorter dead ends are left out
_ISLAND = 15.0  # [m] ways of less total length that nothing joins are left out
_TOLERANCE = 0.05  # [m] by which lines are straightened
# [m] ways that end as near as this to the box's edge may go on beyond it; the middle of a way ends
# half its width before, or at a corner, by a dead end of _SPUR or more
_AT_EDGE = 2.7
_PLAZA = "pedestrian_area"


@dataclass(frozen=True, slots=True)
class WayEdge:
    """What a straight piece of a way is."""

    kind: str  # 'crossing', 'pedestrian_area', or the rules' kind of way
    width: float  # [m] of walkable ground across it, where that is narrowest
    crossing: int = -1  # number of the crossing
    has_signals: bool = False


@dataclass(frozen=True, eq=False)
class RouteGraph:
    """Points and the straight pieces between them, which lead both ways."""

    points: FloatArray  # (N, 2) [m] map frame
    pairs: IntArray  # (M, 2) points that an edge joins
    edges: list[WayEdge]  # M
    credit: str = ""  # whose data it is made of, as their licence asks to say
    shops: IntArray | None = None  # (N,) number at each point; None: not known
    homes: IntArray | None = None  # (N,)
    box: Rect | None = None  # [m] that the ways were cut to; None: not known

    @cached_property
    def lengths(self) -> FloatArray:
        """Of the edges (M,), in [m]."""
        ends = self.points[self.pairs]
        lengths: FloatArray = np.hypot(*(ends[:, 1] - ends[:, 0]).T)
        return lengths

    @cached_property
    def matrix(self) -> csr_matrix:
        """The lengths [m] as a sparse matrix (N, N)."""
        (a, b), n = self.pairs.T, len(self.points)
        both = np.concatenate((a, b)), np.concatenate((b, a))
        # two ways of equal ends would be added up
        shortest = csr_matrix((np.full(2 * len(a), 1.0), both), shape=(n, n))
        matrix = csr_matrix((np.tile(self.lengths, 2), both), shape=(n, n))
        matrix.data /= shortest.data
        return matrix

    @cached_property
    def components(self) -> IntArray:
        """The connected part (N,) that each point belongs to."""
        labels: IntArray = connected_components(self.matrix, directed=False)[1]
        return labels

    @cached_property
    def goes_on(self) -> BoolArray:
        """Whether the part (N,) of each point reaches the box's edge, and may go on beyond it."""
        if self.box is None:
            return np.zeros(len(self.points), dtype=np.bool_)
        x, y = self.points.T
        inner = self.box.grown(-_AT_EDGE)
        ends = (x < inner.x0) | (x > inner.x1) | (y < inner.y0) | (y > inner.y1)
        return np.isin(self.components, self.components[ends])

    @cached_property
    def tree(self) -> cKDTree:
        """The points, searchable by place."""
        return cKDTree(self.points)

    @cached_property
    def edge_of(self) -> dict[tuple[int, int], int]:
        """The edge between two points, in either order."""
        found = {}
        for number, (a, b) in enumerate(self.pairs.tolist()):
            found[a, b] = found[b, a] = number
        return found


def build_graph(district: District) -> RouteGraph:
    """The ways of a district along the middle of its walkable ground.

    Raises:
        MapError: no way is wide or long enough.
    """
    stands = [shapely.Polygon(each.polygon) for each in district.furniture.pieces]
    area = shapely.difference(district.ground.walkable, shapely.union_all(stands))
    points, radii, chains = _middle_lines(area)
    crossing_at = _crossings_at(district, points)
    used, joined, spans = _segments(chains, points, crossing_at)
    kinds = _kinds(district, points[used[joined]].mean(axis=1))
    edges = []
    for kind, span in zip(kinds, spans, strict=True):
        width = round(2.0 * float(radii[span].min()), 2)
        number = int(crossing_at[span[len(span) // 2]])
        if number < 0:
            edges.append(WayEdge(kind, width))
            continue
        has_signals = district.crossings[number][0].has_signals
        edges.append(WayEdge("crossing", width, number, has_signals))
    graph = RouteGraph(np.round(points[used], 3), joined, edges, CREDIT, box=district.ground.box)
    return _without_islands(graph)


def graph_of_area(area: shapely.Geometry, box: Rect) -> RouteGraph:
    """The ways along the middle of an area [m] of which nothing more is known than its shape.

    Raises:
        MapError: no way is wide or long enough.
    """
    points, radii, chains = _middle_lines(area)
    used, joined, spans = _segments(chains, points, np.full(len(points), -1))
    edges = [WayEdge("way", round(2.0 * float(radii[span].min()), 2)) for span in spans]
    return _without_islands(RouteGraph(np.round(points[used], 3), joined, edges, box=box))


def _middle_lines(area: shapely.Geometry) -> tuple[FloatArray, FloatArray, list[list[int]]]:
    """Points (N, 2) [m], how far the edge is from each (N,) [m], and the lines between junctions.

    Raises:
        MapError: no way is wide enough.
    """
    points, radii, pairs = medial_axis(area, CLEARANCE)
    if not len(pairs):
        raise MapError(f"no way is {2 * CLEARANCE:.1f} m wide; choose another box or map")
    return points, radii, _without_spurs(points, pairs)


def _without_spurs(points: FloatArray, pairs: IntArray) -> list[list[int]]:
    """The lines between junctions, without short dead ends."""
    while True:
        chains = chains_of(len(points), pairs)
        degrees = np.bincount(pairs.ravel(), minlength=len(points))
        kept = [chain for chain in chains if not _is_spur(chain, points, degrees)]
        if len(kept) == len(chains):
            return kept
        steps = [np.stack((chain[:-1], chain[1:]), axis=1) for chain in kept]
        pairs = np.concatenate([np.empty((0, 2), dtype=np.int64), *steps])


def _is_spur(chain: list[int], points: FloatArray, degrees: IntArray) -> bool:
    at_ends = sorted((degrees[chain[0]], degrees[chain[-1]]))
    if at_ends[0] != 1 or at_ends[1] < 3:
        return False
    return _length(points[chain]) < _SPUR


def _length(line: FloatArray) -> float:
    return float(np.hypot(*np.diff(line, axis=0).T).sum())


def _crossings_at(district: District, points: FloatArray) -> IntArray:
    """The number of the crossing (N,) at each point; -1: none."""
    found = np.full(len(points), -1)
    tree = shapely.STRtree([over for _, over in district.crossings])
    where, number = tree.query(shapely.points(points), predicate="intersects")
    found[where] = number
    return found


def _straightened(
    chain: list[int], points: FloatArray, crossing_at: IntArray
) -> list[list[list[int]]]:
    """A line as parts of one crossing or none, each as the spans between its bends."""
    numbers = crossing_at[chain]
    cuts = np.flatnonzero(np.diff(numbers)) + 1
    bounds = [0, *cuts.tolist(), len(chain) - 1]
    parts = []
    for low, high in zip(bounds[:-1], bounds[1:], strict=True):
        if high > low:
            parts.append(_spans(chain[low : high + 1], points))
    return parts


def _spans(chain: list[int], points: FloatArray) -> list[list[int]]:
    line = shapely.LineString(points[chain])
    corners = shapely.get_coordinates(line.simplify(_TOLERANCE))
    is_corner = [0]
    for corner in corners[1:-1]:
        rest = points[chain[is_corner[-1] + 1 :]]
        step = int(np.argmin(np.abs(rest - corner).sum(axis=1)))
        is_corner.append(is_corner[-1] + 1 + step)
    is_corner.append(len(chain) - 1)
    return [
        chain[low : high + 1]
        for low, high in zip(is_corner[:-1], is_corner[1:], strict=True)
        if high > low
    ]


def _segments(
    chains: list[list[int]], points: FloatArray, crossing_at: IntArray
) -> tuple[IntArray, IntArray, list[list[int]]]:
    """The points that are used, the pairs of them (M, 2), and the span that each pair stands for.

    Of several edges between the same points one stays.
    """
    spans: dict[tuple[int, int], list[int]] = {}
    for chain in chains:
        for line in _straightened(chain, points, crossing_at):
            for span in line:
                ends = min(span[0], span[-1]), max(span[0], span[-1])
                if ends[0] != ends[1]:
                    spans.setdefault(ends, span)
    used, joined = np.unique(np.array(list(spans)), return_inverse=True)
    return used, joined.reshape(-1, 2), list(spans.values())


def _kinds(district: District, middles: FloatArray) -> list[str]:
    """The kind of way at each point: that of the nearest line, or an area for people."""
    walks = [walk for walk in district.ground.walks if walk.kind != "crossing"]
    shapely.prepare(district.ground.plazas)
    is_plaza = shapely.contains_xy(district.ground.plazas, middles)
    if not walks:
        return [_PLAZA] * len(middles)
    nearest = shapely.STRtree([walk.line for walk in walks]).nearest(shapely.points(middles))
    return [
        _PLAZA if plaza else walks[number].kind
        for plaza, number in zip(is_plaza.tolist(), nearest.tolist(), strict=True)
    ]


def _without_islands(graph: RouteGraph) -> RouteGraph:
    part = graph.components[graph.pairs[:, 0]]
    totals = np.bincount(part, weights=graph.lengths)
    kept: BoolArray = totals[part] >= _ISLAND
    used, joined = np.unique(graph.pairs[kept], return_inverse=True)
    edges = [edge for edge, stays in zip(graph.edges, kept.tolist(), strict=True) if stays]
    if not edges:
        raise MapError(f"no way is {_ISLAND:.0f} m long; choose another box or map")
    return replace(graph, points=graph.points[used], pairs=joined.reshape(-1, 2), edges=edges)
