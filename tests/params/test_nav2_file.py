import os
from dataclasses import replace
from pathlib import Path

import pytest

from navstack.errors import ParameterError
from navstack.geometry import footprint_radii
from navstack.lint import refusals
from navstack.params.costmap import CostmapParams, robot_footprint
from navstack.params.dwb import DwbParams
from navstack.params.nav2_file.file import load_nav2
from navstack.params.nav2_file.findings import ParameterSection
from navstack.params.nav2_file.place import Namespace
from navstack.params.nav2_file.ros_yaml import ParameterEntry
from navstack.params.nav2_file.views import (
    read_controller,
    read_controller_server,
    read_costmap,
    read_dwb,
    read_goal_checker,
    read_planner,
    read_progress_checker,
    read_velocity_smoother,
)
from navstack.params.registry.block import ParameterBlock

SHIPPED = Path(__file__).parents[2] / "params" / "nav2"
FOLDER = os.environ.get("NAVSTACK_DATA")
REAL = sorted((Path(FOLDER) / "nav2_params").glob("*.yaml")) if FOLDER else []
real_files = pytest.mark.parametrize(
    "path", REAL or [None], ids=lambda path: path.name if path else "none"
)


def views(nav2):
    parts = (
        read_controller_server,
        read_controller,
        read_planner,
        read_goal_checker,
        read_progress_checker,
    )
    costmaps = [read_costmap(nav2, node) for node in ("local_costmap", "global_costmap")]
    return [*(part(nav2) for part in parts), read_velocity_smoother(nav2), *costmaps]


def written(nav2, folder):
    nav2.dump(folder / "written.yaml")
    return (folder / "written.yaml").read_text()


@real_files
def test_real_files_load_and_survive(path, tmp_path):
    if path is None:
        pytest.skip("NAVSTACK_DATA is not set: no real Nav2 files here")
    nav2 = load_nav2(path)
    assert written(nav2, tmp_path) == path.read_text()
    (tmp_path / "merged.yaml").write_text(nav2.dump_merged())
    assert views(load_nav2(tmp_path / "merged.yaml")) == views(nav2)


@pytest.mark.parametrize("name", ["stock", "tuned"])
def test_shipped_files_have_nothing_unknown(name, tmp_path):
    nav2 = load_nav2(SHIPPED / f"{name}.yaml")
    assert not nav2.errors
    assert not [notice for notice in nav2.notices if notice.id != "substitute"]
    (tmp_path / "merged.yaml").write_text(nav2.dump_merged())
    assert views(load_nav2(tmp_path / "merged.yaml")) == views(nav2)


@pytest.mark.parametrize(
    "text", ["on", "y", "No", "0x1F", "010", "1e3", ".inf", "true", "3", "a b", "~", ""]
)
def test_texts_that_look_like_other_values_stay_texts_in_the_merged_file(text, tmp_path, inspect):
    nav2 = inspect(
        f'amcl:\n  ros__parameters:\n    scan_topic: "{text}"\n    base_frame_id: base_link\n'
    )
    (tmp_path / "merged.yaml").write_text(nav2.dump_merged())
    merged = load_nav2(tmp_path / "merged.yaml")
    assert merged.value("amcl", "scan_topic") == text
    assert merged.value("amcl", "base_frame_id") == "base_link"


def test_of_several_robots_the_last_one_is_read_and_changed(inspect):
    head = "{}/controller_server:\n  ros__parameters:\n    controller_frequency: {}\n"
    text = head.format("robot1", 3.0) + "    min_x_velocity_threshold: 0.3\n"
    nav2 = inspect(text + head.format("robot2", 7.0))
    assert nav2.value("controller_server", "controller_frequency") == 7.0
    assert nav2.value("controller_server", "min_x_velocity_threshold") is None
    after = nav2.with_values({"controller_server.min_x_velocity_threshold": 0.1})
    assert after.document.text.startswith(text)


@pytest.mark.parametrize("name", ["behavior_server", "recoveries_server"])
def test_sections_of_one_robot_and_of_any_are_joined(inspect, name):
    any_robot = f"/**/{name}: {{ros__parameters: {{cycle_frequency: 7.0}}}}\n"
    one = f"robot1/{name}: {{ros__parameters: {{max_rotational_vel: 0.5}}}}\n"
    assert inspect(any_robot).value("behavior_server", "cycle_frequency") == 7.0
    for text in (any_robot + one, one + any_robot):
        nav2 = inspect(text)
        assert nav2.value("behavior_server", "cycle_frequency") == 7.0
        assert nav2.value("behavior_server", "max_rotational_vel") == 0.5


def test_a_tilde_is_a_text_as_rcl_reads_it(inspect):
    nav2 = inspect("amcl:\n  ros__parameters:\n    scan_topic: ~\n    base_frame_id: null\n")
    assert not nav2.notices
    assert nav2.value("amcl", "scan_topic") == "~"
    assert nav2.value("amcl", "base_frame_id") == "null"


def test_dotted_and_nested_files_are_equal(inspect):
    head = "controller_server:\n  ros__parameters:\n"
    nested = "    FollowPath:\n      max_vel_x: 0.7\n      PathAlign:\n        scale: 9.0\n"
    dotted = "    FollowPath.max_vel_x: 0.7\n    FollowPath.PathAlign.scale: 9.0\n"
    assert read_dwb(inspect(head + nested)) == read_dwb(inspect(head + dotted)) != DwbParams()


def test_namespaces_and_single_nesting(inspect):
    body = "ros__parameters: {robot_radius: 0.4}"
    for text in (
        f"local_costmap: {{local_costmap: {{{body}}}}}",
        f"/local_costmap/local_costmap: {{{body}}}",
        f"robot1: {{local_costmap: {{local_costmap: {{{body}}}}}}}",
        f"local_costmap: {{{body}}}",
    ):
        assert read_costmap(inspect(text), "local_costmap").robot_radius == 0.4, text


def test_wildcards_apply_in_the_order_of_the_file(inspect):
    star = (
        '"/**": {ros__parameters: {use_sim_time: true, update_frequency: 7.0, '
        "controller_frequency: 15.0}}\n"
    )
    own = "controller_server: {ros__parameters: {controller_frequency: 25.0}}\n"
    nav2 = inspect(star + own)
    assert not nav2.errors
    assert read_controller_server(nav2).controller_frequency == 25.0
    assert read_costmap(nav2, "local_costmap").update_frequency == 7.0
    assert read_controller_server(inspect(own + star)).controller_frequency == 15.0


def test_a_wildcard_parameter_that_no_node_has_is_unknown(inspect):
    known = inspect('"/**": {ros__parameters: {bt_loop_duration: 10, goal_reached_tol: 0.3}}')
    assert not known.errors
    (error,) = inspect('"/**": {ros__parameters: {controler_frequency: 15.0}}').errors
    assert error.startswith("line 1: /**: controler_frequency: unknown to Nav2")
    several = inspect('"/**": {ros__parameters: {controler_frequency: 15.0, wheel_diameter: 0.2}}')
    assert [notice.path for notice in several.notices] == [
        "/**: controler_frequency",
        "/**: wheel_diameter",
    ]
    assert not inspect('"/**/local_costmap": {ros__parameters: {width: 3}}').errors
    # of a single node
    (error,) = inspect('"/**/local_costmap": {ros__parameters: {widht: 3}}').errors
    assert error.startswith("line 1: local_costmap: widht: unknown to Nav2; did you mean 'width'?")


def test_what_a_file_leaves_out_has_no_line():
    place = Namespace(
        ParameterBlock(), ParameterSection({"width": ParameterEntry(3, 7, 0, 0, 0)}), "", ()
    )
    assert (place.line_of("width"), place.line_of("height")) == (7, 0)


def test_absent_nodes_have_nav2s_defaults(inspect):
    nav2 = inspect("amcl: {ros__parameters: {max_beams: 60}}")
    assert read_costmap(nav2, "global_costmap") == CostmapParams()
    scales = {
        "PathAlign": 32.0,
        "PathDist": 32.0,
        "GoalAlign": 24.0,
        "GoalDist": 24.0,
        "ObstacleFootprint": 0.01,
    }
    critics = {
        name: replace(getattr(DwbParams(), name), scale=scale) for name, scale in scales.items()
    }
    assert read_dwb(nav2) == DwbParams(**critics)
    assert read_planner(nav2).type == "nav2_navfn_planner::NavfnPlanner"
    merged = nav2.merged()
    assert merged["local_costmap"]["local_costmap"]["ros__parameters"]["resolution"] == 0.1
    assert (
        merged["controller_server"]["ros__parameters"]["FollowPath"]["plugin"]
        == "dwb_core::DWBLocalPlanner"
    )
    assert merged["amcl"]["ros__parameters"]["max_beams"] == 60
    assert merged["amcl"]["ros__parameters"]["sigma_hit"] == 0.2


def test_older_names_are_read(inspect):
    nav2 = inspect(
        "controller_server:\n  ros__parameters:\n    goal_checker_plugin: mine\n"
        "    mine: {plugin: nav2_controller::SimpleGoalChecker, xy_goal_tolerance: 0.7}\n"
        "local_costmap:\n  local_costmap:\n    ros__parameters:\n      plugins: [obstacle_layer]\n"
        "      obstacle_layer: {observation_sources: scan, scan: {obstacle_range: 4.5}}\n"
    )
    assert not nav2.errors
    assert read_goal_checker(nav2).params.xy_goal_tolerance == 0.7
    (source,) = read_costmap(nav2, "local_costmap").layers["obstacle_layer"].active_sources
    assert source.obstacle_max_range == 4.5


def test_a_merged_file_merges_to_itself_where_nav2_chooses_the_critics(inspect):
    nav2 = inspect("controller_server: {ros__parameters: {odom_topic: /odom}}\nlocal_costmap: {}")
    merged = nav2.dump_merged()
    assert "RotateToGoal:" in merged
    assert inspect(merged).dump_merged() == merged


@pytest.mark.parametrize(
    "text", ["[[1, 2], [3", "[[1, 2], [3, 4]]", "[[a, b], [1, 2], [2, 3]]", "__import__('os')"]
)
def test_in_place_of_a_footprint_that_nav2_cannot_read_the_radius_counts(inspect, text):
    values = f'footprint: "{text}", robot_radius: 0.4'
    nav2 = inspect(f"local_costmap: {{local_costmap: {{ros__parameters: {{{values}}}}}}}")
    (notice,) = [each for each in nav2.notices if each.id == "unreadable-footprint"]
    assert (notice.path, notice.line) == ("local_costmap: footprint", 1)
    assert notice.message.endswith("Nav2 warns and takes robot_radius, 0.4 m")
    assert not refusals(nav2)
    radii = footprint_radii(robot_footprint(read_costmap(nav2, "local_costmap")))
    assert radii == pytest.approx((0.4, 0.4), rel=0.02)


@pytest.mark.parametrize(
    ("corners", "is_crossed"),
    [
        ("[0.3, 0.2], [0.3, -0.2], [-0.3, 0.2], [-0.3, -0.2]", True),
        ("[0.3, 0.2], [0.3, -0.2], [-0.3, -0.2], [-0.3, 0.2]", False),
        ("[0.3, 0.2], [0.3, -0.2], [0.1, 0.0], [-0.3, -0.2], [-0.3, 0.2]", False),
        ("[0.3, 0.0], [-0.3, 0.2], [-0.3, -0.2]", False),
    ],
)
def test_a_footprint_that_crosses_itself_is_noted_as_nav2_takes_it(inspect, corners, is_crossed):
    values = f'footprint: "[{corners}]"'
    nav2 = inspect(f"local_costmap: {{local_costmap: {{ros__parameters: {{{values}}}}}}}")
    told = [str(each) for each in nav2.notices if each.id == "crossed-footprint"]
    assert not refusals(nav2)
    assert told == is_crossed * [
        f"line 1: local_costmap: footprint: '[{corners}]' crosses itself; Nav2 takes it, and tests "
        "edges inside the robot; give the corners in order around the robot"
    ]


def test_a_bad_value_names_file_node_and_parameter(inspect):
    nav2 = inspect("controller_server: {ros__parameters: {FollowPath: {max_vel_x: fast}}}")
    with pytest.raises(ParameterError) as error:
        read_dwb(nav2)
    assert str(error.value) == (
        "robot.yaml: controller_server: FollowPath.max_vel_x: 'fast' is not a number (line 1)"
    )
