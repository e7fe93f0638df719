"""Each rule fires where it should and only there, and says what to write instead."""

import json
import math
import os
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from navstack.build import NavigatorParts
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.lint import lint
from navstack.params.costmap import robot_footprint
from navstack.params.lint.reader import MEANINGS
from navstack.params.lint.robot import _distance_outside
from navstack.params.lint.rules import GROUPS, RULES, catalog
from navstack.params.lint.subject import RobotLimits
from navstack.params.nav2_file.file import inspect_nav2
from navstack.params.nav2_file.nodes import default_path
from navstack.params.nav2_file.views import read_costmap
from navstack.params.strict import load_yaml
from navstack.types import Pose2D

ROOT = Path(__file__).parents[2]
BODY = RobotLimits(
    "testbot",
    np.array([[0.2, 0.1], [0.2, -0.1], [-0.2, -0.1], [-0.2, 0.1]]),
    1.0,
    2.0,
    3.0,
    3.0,
    4.0,
)
READER = {each: meaning for meanings in MEANINGS.values() for each, meaning in meanings.items()}
DATA = Path(__file__).parent / "lint"
EXAMPLES = load_yaml(DATA / "examples.yaml")
NUMBERS = "none one two three four five six seven eight nine ten eleven twelve".split()
MPPI = ("mppi-capped-speed", "mppi-biased-noise")
DOCUMENT = (ROOT / "docs" / "lint.md").read_text(encoding="utf-8")


MASK = """\
image: mask.pgm
resolution: 0.1
origin: [0.0, 0.0, {yaw}]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.25
"""


@pytest.fixture
def robot_with(tmp_path):
    """The good robot's file with parameters changed; None removes one.

    Beside it stand the masks ``straight.yaml`` and ``turned.yaml``.
    """
    (tmp_path / "mask.pgm").write_text("P2 1 1 255 0")
    for name, yaw in (("straight", 0.0), ("turned", 0.3)):
        (tmp_path / f"{name}.yaml").write_text(MASK.format(yaw=yaw))

    def _robot_with(changes):
        tree = load_yaml(DATA / "robot.yaml")
        for name, value in changes.items():
            node, *parts = name.split(".")
            _change(
                tree, (*default_path(node), "ros__parameters", *parts) if parts else (node,), value
            )
        path = tmp_path / "robot.yaml"
        path.write_text(json.dumps(tree).replace("Infinity", ".inf").replace("NaN", ".nan"))
        return inspect_nav2(path)

    return _robot_with


def _change(place, parts, value):
    """Set or remove a value; a dotted name in the file is found under its dots."""
    for i, part in enumerate(parts):
        rest = ".".join(parts[i:])
        if rest in place or i == len(parts) - 1:
            if value is None:
                place.pop(rest, None)
            else:
                place[rest] = value
            return
        if not isinstance(place.get(part), dict):
            place[part] = {}
        place = place[part]


def found(nav2):
    return {notice.id: notice for notice in lint(nav2, BODY)}


def test_the_good_robot_is_left_alone(robot_with):
    nav2 = robot_with({})
    assert not nav2.notices
    assert not lint(nav2, BODY)


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.id)
def test_a_rule_fires_and_keeps_silent(robot_with, rule):
    changes, nearby = EXAMPLES[rule.id]["fires"], EXAMPLES[rule.id]["silent"]
    notice = found(robot_with(changes))[rule.id]
    assert notice.is_error == rule.is_error
    assert rule.why in notice.message
    assert notice.advice
    assert notice.line > 0 or not notice.path.startswith(
        tuple(name.partition(".")[0] for name in changes)
    )
    assert rule.id not in found(robot_with(nearby))


def test_the_table_is_complete_and_its_ids_are_unique():
    ids = [rule.id for rule in RULES] + [*READER]
    assert len(ids) == len(set(ids))
    assert {rule.id for rule in RULES} == set(EXAMPLES)
    assert all(rule.title and rule.why for rule in RULES)
    assert all(re.fullmatch(r"[a-z0-9]+(-[a-z0-9]+)*", each) for each in ids)


def test_every_finding_of_the_reader_is_in_the_table():
    source = "".join(path.read_text() for path in (ROOT / "navstack" / "params").rglob("*.py"))
    used = set(re.findall(r'(?:Notice|_error|_warn|_remark)\(\s*"([a-z-]+)"', source))
    assert used
    assert used <= READER.keys()


def test_the_catalog_has_every_finding_with_its_meaning():
    text = catalog()
    for rule in RULES:
        kind = " (Error)" if rule.is_error else ""
        assert f"- **`{rule.id}`** {rule.title}: {rule.why}.{kind}\n" in text
    for each, meaning in READER.items():
        assert f"- **`{each}`** {meaning}\n" in text
    documented = re.findall(r"^- \*\*`(.*?)`\*\*", text, re.MULTILINE)
    assert sorted(documented) == sorted([rule.id for rule in RULES] + [*READER])
    assert re.findall("(?m)^## (.*)", text)[2:] == [group.title for group in GROUPS]


def test_the_document_tells_how_many_real_files_are_left_alone():
    said = re.search(r"(\w+) of (\d+) files of real robots\s\(.*?\) have none", DOCUMENT)
    assert said is not None
    if "NAVSTACK_DATA" not in os.environ:
        pytest.skip("NAVSTACK_DATA is not set: no real Nav2 files here")
    files = sorted((Path(os.environ["NAVSTACK_DATA"]) / "nav2_params").glob("*.yaml"))
    ids = {rule.id for rule in RULES}
    silent = [
        path for path in files if not ids & {notice.id for notice in lint(inspect_nav2(path))}
    ]
    assert (said[1], said[2]) == (NUMBERS[len(silent)], str(len(files)))


def test_the_published_tuned_file():
    nav2 = inspect_nav2(ROOT / "params" / "nav2" / "tuned.yaml")
    notices = {notice.id: notice for notice in lint(nav2)}
    assert not [notice for notice in notices.values() if notice.is_error]
    assert {
        "far-goal",
        "beyond-the-plan",
        "idle-minimum",
        "centre-only",
        "flat-inflation",
        "smoother-is-softer",
        "smoother-is-slower",
        "monitor-never-triggers",
    } <= set(notices)
    assert "2.5 times the robot's outer radius of 0.72 m" in notices["far-goal"].message
    assert "3 m/s x sim_time 1 s reach 3.00 m" in notices["beyond-the-plan"].message
    assert "6000000000" in notices["monitor-never-triggers"].message


def test_the_published_stock_file():
    notices = {
        notice.id: notice for notice in lint(inspect_nav2(ROOT / "params" / "nav2" / "stock.yaml"))
    }
    expected = {
        "beyond-the-plan",
        "beyond-the-window",
        "centre-only",
        "not-inflated",
        "never-cleared",
        "blind-drive",
    }
    assert {*expected, "static-hides-scan"} <= set(notices)
    order = "plugins: [static_layer, voxel_layer, keepout_filter, inflation_layer]"
    assert notices["not-inflated"].advice == notices["static-hides-scan"].advice == order
    assert "smoother-is-softer" not in notices  # its limits are the smoother's defaults


def test_following_the_advice_silences_the_rule(robot_with):
    """The concrete values that are given are right."""
    for rule in (
        *(
            "beyond-the-plan",
            "flat-inflation",
            "smoother-is-slower",
            "sees-too-late",
            "short-horizon",
        ),
        *MPPI,
    ):
        changes = EXAMPLES[rule]["fires"]
        notice = found(robot_with(changes))[rule]
        key, _, value = re.split(r"[,;( ]", notice.advice.replace(": ", "=", 1))[0].partition("=")
        node, _, dotted = notice.path.partition(": ")
        name = dotted.rpartition(".")[0]
        full = f"{node}.{name}.{key}" if name else f"{node}.{key}"
        assert rule not in found(robot_with(changes | {full: float(value)})), notice


def test_a_named_critic_guards_against_obstacles_too(robot_with):
    critics = {
        "controller_server.FollowPath.critics": ["Guard", "PathDist"],
        "controller_server.FollowPath.Guard.class": "dwb_critics::ObstacleFootprint",
    }
    assert "no-obstacle-critic" not in found(robot_with(critics))
    without = {"controller_server.FollowPath.critics": ["PathDist"]}
    assert "no-obstacle-critic" in found(robot_with(without))


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"amcl.min_particles": 3000}, "but min_particles 3000: Nav2 raises max_particles to 3000"),
        (
            {"amcl.max_particles": 400},
            "but min_particles 500 by default: Nav2 raises max_particles to 500",
        ),
    ],
)
def test_crossed_particles_are_a_warning_as_nav2_goes_on(robot_with, values, said):
    notice = found(robot_with(values))["crossed-particles"]
    assert not notice.is_error
    assert said in notice.message
    assert notice.line > 0


def test_particles_that_nav2_replaces_are_judged_as_replaced(robot_with):
    nav2 = robot_with({"amcl.max_particles": -1, "amcl.laser_likelihood_max_dist": -2.0})
    told = [(each.path, each.advice) for each in nav2.notices if each.id == "replaced-value"]
    assert told == [
        ("amcl: laser_likelihood_max_dist", "laser_likelihood_max_dist: 2.0"),
        ("amcl: max_particles", "max_particles: 2000"),
    ]
    notices = found(robot_with({"amcl.max_particles": -1, "amcl.min_particles": -3}))
    assert not {"crossed-particles", "few-particles"} & set(notices)


def test_a_critic_whose_package_is_listed_runs_on_a_robot(tmp_path):
    text = (ROOT / "params" / "nav2" / "dwb_contact.yaml").read_text(encoding="utf-8")
    critics = text.index("      critics: [")
    listed = '      default_critic_namespaces: ["dwb_critics", "nav2_contact_critic"]\n'
    file = tmp_path / "mine.yaml"
    for content, is_told in ((text, True), (text[:critics] + listed + text[critics:], False)):
        file.write_text(content, encoding="utf-8")
        notices = {notice.id: notice for notice in lint(inspect_nav2(file), BODY)}
        assert ("not-in-nav2" in notices) is is_told
        if is_told:
            assert "docs/examples/nav2_contact_critic" in notices["not-in-nav2"].advice


@pytest.mark.parametrize(
    ("name", "value", "kind"),
    [
        ("local_costmap.publish_frequency", 2, "whole-number"),
        ("local_costmap.obstacle_layer.scan.max_obstacle_height", 2, "whole-number"),
        ("planner_server.expected_planner_frequency", 20, "whole-number"),
        ("bt_navigator.bt_loop_duration", 10.0, "decimal-number"),
    ],
)
def test_numbers_that_are_not_read_here_have_the_form_that_nav2_wants(
    robot_with,
    name,
    value,
    kind,
):
    notice = found(robot_with({name: value}))[kind]
    assert not notice.is_error
    assert notice.path == name.replace(".", ": ", 1)
    assert notice.line > 0
    other = int(value) if kind == "decimal-number" else float(value)
    assert notice.advice == f"write {other}"
    assert kind not in found(robot_with({name: other}))


@pytest.mark.parametrize(
    ("name", "value", "usual"), [("combination_method", 99, 1), ("group_connectivity_type", 6, 8)]
)
def test_choices_that_nav2_replaces_are_replaced_with_a_notice(robot_with, name, value, usual):
    kind = "ObstacleLayer" if name == "combination_method" else "DenoiseLayer"
    layer = (
        f"local_costmap.obstacle_layer.{name}"
        if name == "combination_method"
        else f"local_costmap.extra.{name}"
    )
    changes = {
        "local_costmap.plugins": ["obstacle_layer", "extra", "inflation_layer"],
        "local_costmap.extra.plugin": f"nav2_costmap_2d::{kind}",
        layer: value,
    }
    nav2 = robot_with(changes)
    notice = found(nav2)["replaced-value"]
    assert not notice.is_error
    assert f"Nav2 warns and takes {usual}" in notice.message
    layers = read_costmap(nav2, "local_costmap").layers
    assert getattr(layers[layer.split(".")[1]], name) == usual


def test_a_footprint_with_blanks_for_commas_is_read(robot_with):
    values = {"local_costmap.footprint": "[[0.3 0.2] [0.3 -0.2] [-0.3 -0.2] [-0.3 0.2]]"}
    nav2 = robot_with(values | {"local_costmap.robot_radius": None})
    assert "unreadable-footprint" not in found(nav2)
    expected = np.array([[0.3, 0.2], [0.3, -0.2], [-0.3, -0.2], [-0.3, 0.2]])
    assert np.allclose(robot_footprint(read_costmap(nav2, "local_costmap")), expected)


def test_the_robots_brakes_count(robot_with):
    nav2 = robot_with({"local_costmap.obstacle_layer.scan.obstacle_max_range": 0.5})
    assert "sees-too-late" not in {notice.id for notice in lint(nav2)}
    weak = RobotLimits("weak", BODY.footprint, 1.0, 2.0, 3.0, 0.3, 4.0)
    assert "sees-too-late" in {notice.id for notice in lint(nav2, weak)}


def test_a_file_that_cannot_run_here_is_an_error_only_where_it_matters(robot_with):
    old = "nav2_smac_planner::SmacPlanner"
    used = robot_with({"planner_server.GridBased.plugin": old})
    assert found(used)["unavailable-plugin"].is_error
    spare = robot_with(
        {
            "planner_server.planner_plugins": ["GridBased", "Other"],
            "planner_server.Other.plugin": old,
        }
    )
    assert not [notice for notice in lint(spare) if notice.is_error]


def test_a_point_is_not_beside_itself(robot_with):
    notices = found(robot_with({"local_costmap.robot_radius": 0.0}))
    assert "no-robots-size" in notices and "base-beside-footprint" not in notices


def test_a_file_may_have_no_progress_checker(robot_with):
    """Jazzy allows it since January 2026: the robot is never stuck."""
    nav2 = robot_with({"controller_server.progress_checker_plugins": []})
    assert not [notice for notice in lint(nav2, BODY) if notice.is_error]
    empty = OccupancyGrid(np.zeros((9, 9), np.int8), 0.1, Pose2D())
    checker = NavigatorParts(nav2, empty).progress_checker
    assert all(checker.check(Pose2D(), stamp) for stamp in (0.0, 1e6))


def test_a_file_with_errors_is_linted_as_far_as_it_can_be_read(robot_with):
    nav2 = robot_with({"controller_server.FollowPath.max_vel_x": "fast", "amcl.max_beams": 5})
    notices = found(nav2)
    assert notices["bad-value"].path == "controller_server: FollowPath.max_vel_x"
    assert notices["bad-value"].line > 0
    assert "few-beams" in notices
    assert "unusable" not in notices


def zone(points, action="stop", **more):
    return {"type": "polygon", "action_type": action, "points": points, **more}


@pytest.mark.parametrize(
    ("action", "kind"), [("stop", "short-stop-zone"), ("slowdown", "hidden-slow-zone")]
)
def test_a_zone_behind_the_robot_need_not_reach_ahead(robot_with, action, kind):
    behind = "[[-0.3, 0.4], [-0.3, -0.4], [-1.2, -0.4], [-1.2, 0.4]]"
    inside = "[[0.1, 0.05], [0.1, -0.05], [-0.1, -0.05], [-0.1, 0.05]]"
    for points, is_told in ((behind, False), (inside, True)):
        nav2 = robot_with(
            {"collision_monitor.polygons": ["Mine"], "collision_monitor.Mine": zone(points, action)}
        )
        assert (kind in found(nav2)) == is_told, points


def test_the_number_of_points_that_counts_is_judged(robot_with):
    """Nav2 takes max_points, where it is given, in place of min_points."""
    points = "[[2.0, 0.4], [2.0, -0.4], [-0.5, -0.4], [-0.5, 0.4]]"
    for more, is_told in (({"min_points": 0}, True), ({"min_points": 0, "max_points": 3}, False)):
        mine = zone(points, **more)
        nav2 = robot_with({"collision_monitor.polygons": ["Mine"], "collision_monitor.Mine": mine})
        assert ("triggered-by-nothing" in found(nav2)) == is_told


def test_a_source_that_is_off_is_never_overdue(robot_with):
    scan = "collision_monitor.scan"
    for is_on in (True, False):
        nav2 = robot_with({f"{scan}.source_timeout": 0.0005, f"{scan}.enabled": is_on})
        assert ("overdue-scan" in found(nav2)) == is_on


def test_behaviors_pass_the_smoother_since_jazzy(robot_with, monkeypatch):
    changes = {"velocity_smoother.min_velocity": [0.0, 0.0, -2.5]}
    for release, is_told in (("jazzy", True), ("humble", False)):
        monkeypatch.setattr(
            "navstack.params.nav2_file.file.release_of", lambda names, release=release: release
        )
        assert ("no-way-back" in found(robot_with(changes))) == is_told
    assert "no-way-back" not in found(robot_with({}))


def test_a_smoother_that_turns_right_more_slowly_than_dwb_is_told(robot_with):
    slow = robot_with({"velocity_smoother.min_velocity": [-0.5, 0.0, -0.5]})
    notice = found(slow)["smoother-caps"]
    assert notice.path == "velocity_smoother: min_velocity" and "turns right" in notice.message
    assert "-0.5 rad/s" in notice.message and "max_vel_theta: 0.5" in notice.advice


NAMES = sorted({name for each in EXAMPLES.values() for name in each["fires"] if "." in name})
ODD = [
    None,
    True,
    0,
    -1,
    -2.5,
    math.inf,
    -math.inf,
    math.nan,
    1e30,
    -1e30,
    "inf",
    "",
    "x",
    [],
    [1.0],
    [[1]],
    {},
    {"a": 1},
    2**40,
    [1e30] * 3,
]
CONTROLLERS = [{}] + [
    EXAMPLES[rule]["fires"] for rule in ("shim-turns-too-fast", "blind-pursuit", *MPPI)
]


@settings(
    max_examples=50,
    deadline=None,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(
    st.sampled_from(CONTROLLERS),
    st.dictionaries(st.sampled_from(NAMES), st.sampled_from(ODD), min_size=1, max_size=4),
)
def test_no_values_make_the_linter_fail(robot_with, controller, values):
    lint(robot_with(controller | values), BODY)


@pytest.mark.parametrize(
    "values",
    [
        {"controller_server.FollowPath.max_vel_x": math.inf},
        {"local_costmap.robot_radius": 0.0, "local_costmap.footprint_padding": 0.0},
        {
            "local_costmap.footprint": "[[0, 0], [0, 0], [0, 0]]",
            "local_costmap.footprint_padding": 0.0,
        },
    ],
)
def test_endless_speeds_and_robots_without_extent_are_linted(robot_with, values):
    lint(robot_with({"controller_server.goal_checker.xy_goal_tolerance": 0.7} | values), BODY)


@pytest.mark.parametrize(
    ("point", "distance"),
    [((0.0, 0.0), 0.0), ((1.0, 0.0), 0.5), ((0.8, 0.9), 0.5), ((0.4, 0.4), 0.0)],
)
def test_distance_outside_a_polygon(point, distance):
    square = np.array([[0.5, 0.5], [0.5, -0.5], [-0.5, -0.5], [-0.5, 0.5]])
    assert math.isclose(_distance_outside(square, np.array(point)), distance, abs_tol=1e-12)
