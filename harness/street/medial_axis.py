"""The middle lines of an area: where a robot that keeps off its edges can go."""

import numpy as np
import shapely
from scipy.spatial import Voronoi

from navstack.types import FloatArray, IntArray

_FEWEST = 4  # points that have a Voronoi diagram
_SPACING = 0.4  # [m] of points along the area's edges


def medial_axis(
    area: shapely.Geometry, clearance: float
) -> tuple[FloatArray, FloatArray, IntArray]:
    """The medial axis of an area as far as it keeps off the edges.

    Ridges of the Voronoi diagram of points along the edges (Brandt & Algazi 1992, "Continuous
    skeleton computation by Voronoi diagram"). Ridges between neighbouring points of one edge are
    left out, as they lead to the edge.

    Args:
        area: polygon or multipolygon [m].
        clearance: [m] to the edges, more than ``_SPACING``.

    Returns:
        Points (N, 2) [m], their distance (N,) to the edge [m], and pairs (M, 2) of points that a
        line joins.
    """
    edges = shapely.segmentize(shapely.boundary(area), _SPACING)
    samples = np.unique(np.round(shapely.get_coordinates(edges), 4), axis=0)
    if len(samples) < _FEWEST:
        return np.empty((0, 2)), np.empty(0), np.empty((0, 2), dtype=np.int64)
    diagram = Voronoi(samples)
    ridges: IntArray = np.asarray(diagram.ridge_vertices, dtype=np.int64)
    between: IntArray = np.asarray(diagram.ridge_points, dtype=np.int64)
    apart = np.hypot(*(samples[between[:, 0]] - samples[between[:, 1]]).T)
    is_wide = (ridges >= 0).all(axis=1) & (apart >= 2.0 * clearance)
    ridges, between = ridges[is_wide], between[is_wide]
    points = np.asarray(diagram.vertices)
    radii = np.zeros(len(points))
    for side in (0, 1):
        offsets = points[ridges[:, side]] - samples[between[:, 0]]
        radii[ridges[:, side]] = np.hypot(*offsets.T)
    is_clear = radii >= clearance
    is_clear[is_clear] = _inside(area, points[is_clear])
    ridges = ridges[is_clear[ridges].all(axis=1)]
    used, renumbered = np.unique(ridges, return_inverse=True)
    pairs = np.unique(np.sort(renumbered.reshape(-1, 2), axis=1), axis=0)
    return points[used], radii[used], pairs[pairs[:, 0] != pairs[:, 1]]


def _inside(area: shapely.Geometry, points: FloatArray) -> FloatArray:
    shapely.prepare(area)
    inside: FloatArray = shapely.contains_xy(area, points)
    return inside


def chains_of(count: int, pairs: IntArray) -> list[list[int]]:
    """The lines of a graph between its ends and junctions, and its loops, as lists of points.

    Args:
        count: of the points.
        pairs: (M, 2) of them that are joined.
    """
    neighbours: list[list[int]] = [[] for _ in range(count)]
    for a, b in pairs.tolist():
        neighbours[a].append(b)
        neighbours[b].append(a)
    used: set[tuple[int, int]] = set()
    chains: list[list[int]] = []
    is_through = [len(each) == 2 for each in neighbours]
    ends = [point for point in range(count) if not is_through[point]]
    for first in [*ends, *range(count)]:  # what is left after the ends are loops
        for second in neighbours[first]:
            if (first, second) in used:
                continue
            chain = [first, second]
            while is_through[chain[-1]] and chain[-1] != first:
                one, other = neighbours[chain[-1]]
                chain.append(other if one == chain[-2] else one)
            used.update(zip(chain, chain[1:], strict=False))
            used.update(zip(chain[1:], chain, strict=False))
            chains.append(chain)
    return chains
