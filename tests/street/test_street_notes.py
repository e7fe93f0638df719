"""What a run on streets says of its deliveries."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from harness.street.graph_file import save_graph
from harness.street.route_graph import RouteGraph, WayEdge
from harness.study.preflight import leg_notes
from harness.task.stack import ROS2
from harness.task.study import make_study
from navstack.errors import InputError


@pytest.fixture
def town(tmp_path: Path) -> str:
    """A street of 250 m: three legs."""
    points = [(50.0 * number, 0.0) for number in range(6)]
    pairs = [(number, number + 1) for number in range(5)]
    save_graph(
        RouteGraph(np.array(points), np.array(pairs), [WayEdge("sidewalk", 2.5)] * 5),
        tmp_path / "town_graph.geojson",
    )
    return str(tmp_path)


@pytest.mark.parametrize("rules", ["costnav", "there_and_back"])
def test_legs_and_metres_of_the_first_delivery_are_of_the_same_way(town: str, rules: str) -> None:
    study = make_study(
        stacks=["parked"],
        episodes=1,
        map_name=town,
        workers=1,
        rules=rules,
        distance=(0.21, 1),
    )
    (note,) = leg_notes(study)
    assert "the first has 3 legs and 250 m" in note
    assert note.endswith("as many back") == (rules == "there_and_back")


def test_another_programs_stack_drives_on_one_map_and_not_on_a_district(town: str) -> None:
    study = make_study(stacks=["parked"], episodes=1, map_name=town, workers=1)
    peer = dataclasses.replace(study.stacks[0], name="mine", navigator=ROS2)
    with pytest.raises(InputError, match=r"'mine' drives over ROS 2.* one of the district"):
        leg_notes(dataclasses.replace(study, stacks=(peer,)))
