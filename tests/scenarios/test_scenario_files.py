"""Scenario files are strict, scripts are followed, and the command says what came of them."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from harness.scenarios.actors import ScriptedPedestrians
from harness.scenarios.drawing import CELL, draw_scene, with_things
from harness.scenarios.runner import run_scenario
from harness.scenarios.scenario import Drawing, PersonScript, Thing, load_scenario
from harness.storage.shipped import shipped
from harness.world.physics.body_state import BodyState
from navbench.cli.app import main
from navstack.costmap.occupancy_grid import FREE, OCCUPIED
from navstack.errors import InputError
from navstack.types import Pose2D

SHORT = """\
title: "The robot drives a few metres."
drawing: {letter: 0.5, rows: "............"}
start: {x: 1.0, y: 0.25, yaw: 0.0}
goal: {x: 4.5, y: 0.25, yaw: 0.0}
time_limit: 10.0
checks: {arrives_within: 10.0}
"""


ON_THE_SIDEWALK = """\
title: "It stands on the sidewalk."
map: sidewalk
start: {x: -67.9, y: -71.9, yaw: 0.0}
goal: {x: -89.7, y: -63.5, yaw: 0.0}
time_limit: 0.5
checks: {stays_off: [road]}
"""
ZERO = "moves_at_most: 0, never_closer_than: 0.0, no_collision: false"


def write(folder: Path, text: str) -> Path:
    path = folder / "short.yaml"
    path.write_text(text)
    return path


def seen_at(x: float) -> BodyState:
    return BodyState(x, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("time_limit", "timelimit", "did you mean 'time_limit'"),
        ("arrives_within", "arive_within", "did you mean 'arrives_within'"),
        ("{arrives_within: 10.0}", "{}", "checks: none is given"),
        ("checks:", "expect: known_to_fail\nchecks:", "go with 'expect: known_to_fail'"),
        ("checks:", "reason: because\nchecks:", "go with 'expect: known_to_fail'"),
        (
            "checks:",
            "expect: known_to_fail\nreason: x\nfails: [no_collision]\nchecks:",
            "is not among its checks",
        ),
        ("metres.", "metres", "is not a sentence"),
        ("drawing:", "map: sidewalk\ndrawing:", "either 'map' or 'drawing'"),
        ("{arrives_within: 10.0}", "{moves_at_most: -1}", "moves_at_most -1 is below 0"),
        ("{arrives_within: 10.0}", "{keeps_out_of: [[1, 1, 0, 2]]}", "has no area"),
        ("{arrives_within: 10.0}", "{gives_up_with: NO_PATH}", "did you mean 'NO_VALID_PATH'"),
        ("{arrives_within: 10.0}", "{arrives_within: 11}", "is beyond the time_limit 10 s"),
        ("checks:", "things: [{box: [1, 1, 0, 2]}]\nchecks:", "x0 < x1"),
        (
            "checks:",
            "people: [{waypoints: [[1, 1]], starts_near: 0.0}]\nchecks:",
            "starts_near 0 m, where the robot never is",
        ),
    ],
)
def test_files_are_strict(tmp_path: Path, old: str, new: str, words: str) -> None:
    with pytest.raises(InputError, match="short.yaml") as error:
        load_scenario(write(tmp_path, SHORT.replace(old, new)))
    assert words in str(error.value)


def test_a_check_of_zero_is_a_check(tmp_path: Path) -> None:
    checks = load_scenario(write(tmp_path, SHORT.replace("arrives_within: 10.0", ZERO))).checks
    assert checks.asked == {"moves_at_most": 0.0, "never_closer_than": 0.0}


def test_ground_that_the_place_does_not_have_is_refused(tmp_path: Path) -> None:
    text = SHORT.replace("arrives_within: 10.0", "stays_off: [sidewolk]")
    with pytest.raises(InputError, match="did you mean 'sidewalk'"):
        run_scenario(write(tmp_path, text))


def test_a_drawing_becomes_ground_and_walls() -> None:
    scene = draw_scene(Drawing("#.\n=x", 0.5, (10.0, 20.0)), "place")
    assert scene.geometry.data.shape == (20, 20)
    assert scene.geometry.origin == Pose2D(10.0, 20.0, 0.0)
    assert (scene.geometry.data[10:, :10] == OCCUPIED).all()
    assert (scene.geometry.data[:10] == FREE).all() and (scene.geometry.data[:, 10:] == FREE).all()
    assert (scene.walkable.data == FREE).sum() == 200
    corners = {
        zone.kind: [*zone.polygon.min(axis=0), *zone.polygon.max(axis=0)] for zone in scene.zones
    }
    assert corners["road"] == [10.0, 20.0, 10.5, 20.5] and corners["crosswalk"] == [
        10.5,
        20.0,
        11.0,
        20.5,
    ]
    assert {zone.kind: zone.elevation for zone in scene.zones} == {
        "sidewalk": 0.0,
        "crosswalk": 0.0,
        "road": -0.12,
    }


def test_things_are_solid_and_leave_the_ground_as_it_is() -> None:
    scene = draw_scene(Drawing("....\n....", 0.5), "place")
    full = with_things(scene, (Thing((0.5, 0.0, 1.0, 0.5), "van", 2.0),))
    assert (full.geometry.data == OCCUPIED).sum() == round(0.25 / CELL**2)
    assert (scene.geometry.data == FREE).all() and full.walkable is scene.walkable
    assert [obstacle.kind for obstacle in full.obstacles] == ["van"]


@pytest.mark.parametrize("box", [(100.0, 0.0, 101.0, 0.5), (0.51, 0.0, 0.52, 0.5)])
def test_a_thing_that_no_lidar_would_see_is_refused(box: tuple[float, ...]) -> None:
    scene = draw_scene(Drawing("....\n....", 0.5), "place")
    with pytest.raises(InputError, match=r"covers no cell of 0.05 m .* x 0..2, y 0..1 m"):
        with_things(scene, (Thing(box, "van", 2.0),))


def test_people_follow_their_scripts() -> None:
    scripts = (
        PersonScript(((0.0, 0.0), (2.0, 0.0), (2.0, 2.0)), speed=1.0, starts_at=1.0),
        PersonScript(((5.0, 0.0), (5.0, 1.0)), speed=2.0, starts_near=1.5, leaves=True),
        PersonScript(((9.0, 9.0),)),
    )
    people = ScriptedPedestrians(scripts)
    people.reset(np.random.default_rng(0), Pose2D())
    for _ in range(100):
        people.step(0.01)
    np.testing.assert_allclose(
        people.states[:, :2], [[0.01, 0.0], [5.0, 0.0], [9.0, 9.0]], atol=0.011
    )
    people.see_robot(seen_at(4.0))
    for _ in range(300):
        people.step(0.01)
    np.testing.assert_allclose(people.states[0], [2.0, 1.0, 0.0, 1.0], atol=0.02)
    assert people.states[1, 0] == math.inf
    np.testing.assert_array_equal(people.states[2], [9.0, 9.0, 0.0, 0.0])
    people.reset(np.random.default_rng(0), Pose2D())
    np.testing.assert_array_equal(people.states[0], [0.0, 0.0, 0.0, 0.0])


def test_a_check_that_fails_and_a_failure_that_passes_are_reported(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write(tmp_path, SHORT)
    first, second = run_scenario(path), run_scenario(path)
    assert (
        first.as_expected
        and first.findings == second.findings
        and first.duration == second.duration
    )
    for text, passed in (
        (SHORT.replace("arrives_within: 10.0", "arrives_within: 0.1"), False),
        (SHORT + "expect: known_to_fail\nfails: [arrives_within]\nreason: it cannot\n", True),
    ):
        with pytest.raises(SystemExit) as leaving:
            main(["scenario", str(write(tmp_path, text)), "--json"])
        assert leaving.value.code == 1
        said = capsys.readouterr()
        (outcome,) = json.loads(said.out)["scenarios"]
        assert (outcome["passed"], outcome["as_expected"]) == (passed, False)
        assert said.err.count("\n") == 1 and "not as expected: short" in said.err


def test_a_belief_is_held_against_the_truth_of_the_same_moment(tmp_path: Path) -> None:
    given = (shipped("params") / "stacks" / "nav2-gps.yaml").read_text()
    (tmp_path / "told.yaml").write_text(
        f"{given}localizer: ground_truth\n".replace("localizer: gps\n", "")
    )
    result = run_scenario(
        write(
            tmp_path, f"{SHORT}stack: told.yaml\n".replace("{arr", "{believes_within: 1.0e-9, arr")
        )
    )
    assert result.holds, result.findings


def test_the_command_wants_files_or_all(capsys: pytest.CaptureFixture[str]) -> None:
    for arguments in (["scenario"], ["scenario", "--all", "a.yaml"]):
        with pytest.raises(SystemExit) as leaving:
            main(arguments)
        assert leaving.value.code == 2
        assert "give scenario files, or --all" in capsys.readouterr().err


def test_of_grounds_that_overlap_the_later_counts(tmp_path: Path) -> None:
    """On a built-in map the road lies below all sidewalks."""
    result = run_scenario(write(tmp_path, ON_THE_SIDEWALK))
    assert [finding.holds for finding in result.findings] == [True]
