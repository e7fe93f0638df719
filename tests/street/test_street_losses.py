"""Where on a district's streets money was lost."""

import numpy as np
import pytest

from harness.analysis.street_losses import StreetLosses, in_pieces, lose
from harness.economics.prices import load_prices
from harness.metrics.columns import EPISODE_COLUMNS
from harness.street.route_graph import RouteGraph, WayEdge


def test_metres_of_a_long_straight_way_are_of_the_squares_that_they_are_in() -> None:
    """A way of 100 m is one edge of the graph; a leg covers it from 10 to 90 m."""
    edge = WayEdge("sidewalk", 2.5)
    graph = RouteGraph(np.array([(0.0, 1.0), (100.0, 1.0)]), np.array([(0, 1)]), [edge], "credit")
    ends = {"start_x_m": 10.0, "start_y_m": 1.0, "end_x_m": 90.0, "end_y_m": 1.0}
    row = dict.fromkeys(EPISODE_COLUMNS, 0.0)
    row |= {"episode": 0, "outcome": "sla", "way_back": None}
    pieces = in_pieces(graph)
    found = lose([row], [], [[ends]], pieces, load_prices())
    driven = [found.driven[column, 0] for column in range(4)]
    assert driven == pytest.approx([15.0, 25.0, 25.0, 15.0], abs=2.0)
    assert sum(driven) == pytest.approx(80.0, abs=2.0)
    assert pieces.credit == "credit"
    assert pieces.lengths.sum() == pytest.approx(100.0)


def test_dollars_where_nobody_drove_have_no_rate() -> None:
    found = StreetLosses({(0, 0): 6.98}, {(1, 0): 20.0})
    assert found.per_metre((0, 0)) is None
    assert found.per_metre((1, 0)) == 0.0
