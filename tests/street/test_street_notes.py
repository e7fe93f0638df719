"""What a run on streets says of its deliveries."""

from pathlib import Path

import numpy as np
import pytest

from harness.street.graph_file import save_graph
from harness.street.route_graph import RouteGraph, WayEdge
from harness.study.preflight import leg_notes
from harness.task.study import make_study


@pytest.mark.parametrize("rules", ["costnav", "there_and_back"])
def test_legs_and_metres_of_the_first_delivery_are_of_the_same_way(
    tmp_path: Path, rules: str
) -> None:
    """Its way is 250 m at most, which makes 3 legs."""
    points = [(50.0 * number, 0.0) for number in range(6)]
    pairs = [(number, number + 1) for number in range(5)]
    save_graph(
        RouteGraph(np.array(points), np.array(pairs), [WayEdge("sidewalk", 2.5)] * 5),
        tmp_path / "town_graph.geojson",
    )
    study = make_study(
        stacks=["parked"],
        episodes=1,
        map_name=str(tmp_path),
        workers=1,
        rules=rules,
        distance=(0.21, 1),
    )
    (note,) = leg_notes(study)
    assert "the first has 3 legs and 250 m" in note
    assert note.endswith("as many back") == (rules == "there_and_back")
