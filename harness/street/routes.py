"""Routes over a graph of ways, and missions to drive along them."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse.csgraph import dijkstra

from harness.street.route_graph import RouteGraph
from navstack.errors import InputError
from navstack.types import FloatArray

_REACH = 15.0  # [m] of a place to the way where its route begins
_MOST_DRAWS = 200  # for a mission


@dataclass(frozen=True, slots=True, eq=False)
class StreetRoute:
    """The shortest way between two points of a graph."""

    points: FloatArray  # (K, 2) [m] map frame
    length: float  # [m]
    edges: tuple[int, ...]  # K - 1
    crossings: int  # different ones
    signals: int  # of those


@dataclass(frozen=True, slots=True)
class RouteMission:
    """A start and a goal among a graph's points, and the route; None: no way leads there."""

    start: int
    goal: int
    route: StreetRoute | None
    beyond: int = 0  # pairs drawn before it whose ways could meet beyond the box only


def find_route(graph: RouteGraph, start: int, goal: int) -> StreetRoute | None:
    """The shortest route (Dijkstra) between two points; None: no way leads there."""
    if graph.components[start] != graph.components[goal]:
        return None
    before = dijkstra(graph.matrix, indices=start, return_predecessors=True)[1]
    nodes = [goal]
    while nodes[-1] != start:
        nodes.append(int(before[nodes[-1]]))
    nodes.reverse()
    edges = [graph.edge_of[a, b] for a, b in zip(nodes[:-1], nodes[1:], strict=True)]
    crossed = {graph.edges[edge].crossing: graph.edges[edge].has_signals for edge in edges}
    crossed.pop(-1, None)
    length = float(graph.lengths[edges].sum())
    return StreetRoute(
        graph.points[nodes], length, tuple(edges), len(crossed), sum(crossed.values())
    )


def reverse(route: StreetRoute) -> StreetRoute:
    """The same way from its end to its begin."""
    return replace(route, points=route.points[::-1], edges=route.edges[::-1])


def nearest_point(graph: RouteGraph, x: float, y: float) -> int:
    """The graph's point that is nearest to a place [m].

    Raises:
        InputError: none is within 15 m.
    """
    distance, number = graph.tree.query((x, y))
    if distance > _REACH:
        raise InputError(
            f"({x:.1f}, {y:.1f}) m: the nearest way is {distance:.0f} m away; at most "
            f"{_REACH:.0f} m: choose a place on a sidewalk"
        )
    return int(number)


def _ends_along_ways(graph: RouteGraph, rng: np.random.Generator) -> tuple[int, int]:
    share = graph.lengths / graph.lengths.sum()
    first, second = rng.choice(len(share), size=2, p=share)
    start, goal = (int(graph.pairs[edge][rng.integers(2)]) for edge in (first, second))
    return start, goal


def _ends_by_places(graph: RouteGraph, rng: np.random.Generator) -> tuple[int, int]:
    ends = []
    for what, counts in (("shop", graph.shops), ("home", graph.homes)):
        if counts is None or not counts.any():
            raise InputError(
                f"no {what} of OpenStreetMap is near a way here; make the maps anew with navbench "
                "map osm, choose a larger box, or draw missions anywhere (--missions published)"
            )
        ends.append(int(rng.choice(len(counts), p=counts / counts.sum())))
    return ends[0], ends[1]


def draw_mission(
    graph: RouteGraph,
    low: float,
    high: float,
    rng: np.random.Generator,
    is_by_places: bool = False,
) -> RouteMission:
    """Draw a start and a goal evenly along all ways, or a shop and a home.

    Pairs closer than ``low`` as the crow flies, or with a route that is longer than ``high``, are
    drawn anew. So are pairs without a route whose ways both go on beyond the box, others not.

    Args:
        graph: the ways.
        low: [m] least distance as the crow flies.
        high: [m] most length of the route.
        rng: where it is drawn from.
        is_by_places: from a shop to a home, each as likely as any other.

    Raises:
        InputError: hardly any pair is as far apart as that, or there is no shop or home.
    """
    draw_ends = _ends_by_places if is_by_places else _ends_along_ways
    beyond = 0
    for _ in range(_MOST_DRAWS):
        start, goal = draw_ends(graph, rng)
        apart = float(np.hypot(*(graph.points[start] - graph.points[goal])))
        if not low <= apart <= high:
            continue
        route = find_route(graph, start, goal)
        if route is None and graph.goes_on[start] and graph.goes_on[goal]:
            beyond += 1
        elif route is None or route.length <= high:
            return RouteMission(start, goal, route, beyond)
    raise InputError(
        f"no two places with {low:.0f} to {high:.0f} m between them in {_MOST_DRAWS} draws; the "
        "box is too small for that"
    )
