"""Where on a district's streets a stack lost money."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from harness.economics.cost_model import running
from harness.economics.prices import Prices
from harness.economics.valuation import deliveries
from harness.metrics.columns import Row
from harness.street.route_graph import RouteGraph, WayEdge
from harness.street.routes import find_route
from navstack.types import FloatArray

SQUARE = 25.0  # [m] side of the squares by which streets are summed up
_PIECE = 2.0  # [m] of a way that lies in one square as a whole
Square = tuple[int, int]  # column and row


@dataclass(frozen=True, slots=True)
class StreetLosses:
    """Dollars and metres by square."""

    usd: Mapping[Square, float]  # [USD] of contacts there, and of missions that ended there
    driven: Mapping[Square, float]  # [m] of the routes there that were driven

    def per_metre(self, square: Square) -> float | None:
        """[USD/m] driven there; None where nobody drove, as where a robot stood only."""
        driven = self.driven.get(square, 0.0)
        if driven <= 0.0:
            return None
        return self.usd.get(square, 0.0) / driven


def square_of(x: float, y: float) -> Square:
    """The square of a place [m]."""
    return int(x // SQUARE), int(y // SQUARE)


def in_pieces(graph: RouteGraph) -> RouteGraph:
    """The same ways in short pieces, each of one square; shops and homes are left out.

    A straight way is one edge, however long.
    """
    points, pairs, edges = [graph.points], list[list[int]](), list[WayEdge]()
    counts = np.maximum(np.ceil(graph.lengths / _PIECE), 1.0).astype(int).tolist()
    used = len(graph.points)
    for (start, end), edge, count in zip(graph.pairs.tolist(), graph.edges, counts, strict=True):
        points.append(np.linspace(graph.points[start], graph.points[end], count + 1)[1:-1])
        along = [start, *range(used, used + count - 1), end]
        pairs += [list(pair) for pair in pairwise(along)]
        edges += [edge] * count
        used += count - 1
    return RouteGraph(np.concatenate(points), np.array(pairs), edges, graph.credit)


def lose(
    rows: Sequence[Row],
    events: Sequence[Row],
    legs: Sequence[Sequence[Row]],
    graph: RouteGraph,
    prices: Prices,
) -> StreetLosses:
    """Put the losses of a stack's missions where they arose.

    Contacts count where they happened, by their shares in the delivery's contact costs. The fee
    that was missed and refunds count where the way there ended, repair where the robot did.

    Args:
        rows: of missions whose cargo was simulated.
        events: of the stack.
        legs: of each mission.
        graph: of the district, :func:`in_pieces`.
        prices: the price file.
    """
    usd: dict[Square, float] = defaultdict(float)
    driven: dict[Square, float] = defaultdict(float)
    costs = running(deliveries(rows, prices.rolling_resistance_force), prices)
    of_contacts = _each(costs.terms["pedestrian_safety"], rows)
    of_contacts = of_contacts + _each(costs.terms["property_damage"], rows)
    missed = prices.delivery_fee.value - _each(costs.revenue, rows)
    of_end = missed + _each(costs.terms["service_compensation"], rows)
    repairs = _each(costs.terms["repair"], rows)
    for number, (row, own) in enumerate(zip(rows, legs, strict=True)):
        paid = [each for each in events if each["episode"] == row["episode"] and each["cost_usd"]]
        total = sum(each["cost_usd"] for each in paid)
        for each in paid:
            share = each["cost_usd"] / total
            usd[square_of(each["x_m"], each["y_m"])] += share * float(of_contacts[number])
        last = own[-1]["end_x_m"], own[-1]["end_y_m"]
        usd[square_of(*last)] += float(repairs[number])
        turn = last
        if row["way_back"] is not None:
            turn = row["goal_x_m"], row["goal_y_m"]
        usd[square_of(*turn)] += float(of_end[number])
        for leg in own:
            for square, length in _squares_of(leg, graph):
                driven[square] += length
    return StreetLosses(usd, driven)


def _each(amount: FloatArray | float | None, rows: Sequence[Row]) -> FloatArray:
    """A term of each delivery [USD], shape (n,)."""
    return np.broadcast_to(np.asarray(amount, dtype=np.float64), len(rows))


def _squares_of(leg: Row, graph: RouteGraph) -> list[tuple[Square, float]]:
    """Squares and lengths [m] of the graph's edges between a leg's start and end."""
    _, ends = graph.tree.query(
        ((leg["start_x_m"], leg["start_y_m"]), (leg["end_x_m"], leg["end_y_m"]))
    )
    route = find_route(graph, *map(int, ends))
    if route is None:
        return []
    middles = graph.points[graph.pairs[list(route.edges)]].mean(axis=1)
    lengths = graph.lengths[list(route.edges)].tolist()
    return [(square_of(*place), length) for place, length in zip(middles, lengths, strict=True)]
