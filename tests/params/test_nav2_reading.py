"""Spellings that differ between releases and robots, all read as Nav2 reads them."""

import pytest

from navstack.control.dwb.critics import build_critics
from navstack.control.dwb.critics.align import PathAlignCritic
from navstack.errors import ParameterError
from navstack.lint import lint
from navstack.params.dwb import AlignParams, NamedCritic
from navstack.params.nav2_file.views import (
    read_controller,
    read_controller_server,
    read_costmap,
    read_dwb,
    read_primary_controller,
)

SHIM = "nav2_rotation_shim_controller::RotationShimController"
MAP = "map_server: {ros__parameters: {use_sim_time: true}}\n"
HEAD = "controller_server:\n  ros__parameters:\n    FollowPath:\n"
CRITICS = (
    HEAD
    + "      max_vel_x: 0.5\n      critics: [Narrow, 'dwb_critics::GoalDistCritic', PathDist]\n"
    "      Narrow: {class: 'dwb_critics::PathAlign', scale: 7.0, forward_point_distance: 0.6}\n"
    "      dwb_critics::GoalDistCritic.scale: 3.0\n"
)


def only_error(nav2):
    assert len(nav2.errors) == 1, nav2.errors
    return nav2.errors[0]


def test_critics_under_names_of_their_own(inspect):
    nav2 = inspect(CRITICS)
    assert not nav2.errors
    params = read_dwb(nav2)
    assert params.named_critics["Narrow"] == NamedCritic("PathAlign", AlignParams(7.0, "last", 0.6))
    assert params.named_critics["dwb_critics::GoalDistCritic"].params.scale == 3.0
    assert read_controller(nav2).params == params
    critics = build_critics(params)
    assert list(critics) == ["Narrow", "dwb_critics::GoalDistCritic", "PathDist"]
    assert isinstance(critics["Narrow"], PathAlignCritic)
    assert "aggregation_type: last" in nav2.dump_merged().partition("Narrow")[2]


def test_two_critics_of_one_kind(inspect):
    text = CRITICS.replace("PathDist]", "PathAlign]")
    assert list(build_critics(read_dwb(inspect(text))))[::2] == ["Narrow", "PathAlign"]


def test_misspelt_parameters_of_a_named_critic(inspect):
    assert "did you mean 'scale'" in only_error(inspect(CRITICS.replace("scale: 7.0", "scle: 7.0")))
    assert "Narrow.scale: 'big' is not a number" in only_error(
        inspect(CRITICS.replace("scale: 7.0", "scale: big"))
    )


def test_critics_of_other_packages_are_not_taken_for_nav2s(inspect):
    error = only_error(
        inspect(CRITICS.replace("dwb_critics::PathAlign", "their_critics::PathAlign"))
    )
    assert "unknown plugin 'their_critics::PathAlign'" in error


def test_primary_controller_as_in_jazzy_and_as_in_main(inspect):
    jazzy = (
        f"{HEAD}      plugin: {SHIM}\n      primary_controller: dwb_core/DWBLocalPlanner\n"
        f"      max_vel_x: 0.7\n"
    )
    main = (
        f"{HEAD}      plugin: {SHIM}\n      simulate_ahead_time: 2.0\n"
        "      primary_controller: {plugin: 'dwb_core::DWBLocalPlanner', max_vel_x: 0.7, "
        "critics: [PathDist]}\n"
    )
    for text, name in ((jazzy, "FollowPath"), (main, "FollowPath.primary_controller")):
        nav2 = inspect(text)
        assert not nav2.errors, text
        primary = read_primary_controller(nav2, read_controller(nav2))
        assert (primary.name, primary.type) == (name, "dwb_core::DWBLocalPlanner")
        assert primary.params.max_vel_x == 0.7
    assert read_controller(nav2).params.simulate_ahead_time == 2.0
    merged = inspect(nav2.dump_merged())
    assert merged.value("controller_server", "FollowPath.primary_controller.sim_time") == 1.7
    assert read_primary_controller(merged, read_controller(merged)) == primary
    misspelt = inspect(main.replace("max_vel_x", "max_vel_xx"))
    assert "FollowPath.primary_controller.max_vel_xx" in only_error(misspelt)


@pytest.mark.parametrize(
    "rest", ["", "      max_angular_accel: 1.0\n", "      primary_controller: {max_vel_x: 1.0}\n"]
)
def test_a_missing_primary_controller_is_named(inspect, rest):
    nav2 = inspect(f"{HEAD}      plugin: {SHIM}\n{rest}")
    assert (
        "FollowPath.primary_controller: is missing; name the plugin that does the work"
        in only_error(nav2)
    )
    with pytest.raises(
        ParameterError, match=r"primary_controller is missing; .* e.g. dwb_core::DWBLocalPlanner"
    ):
        read_primary_controller(nav2, read_controller(nav2))


def test_a_shim_cannot_be_its_own_primary_controller(inspect):
    nav2 = inspect(f"{HEAD}      plugin: {SHIM}\n      primary_controller: {SHIM}\n")
    with pytest.raises(ParameterError, match="cannot be its own primary controller"):
        read_primary_controller(nav2, read_controller(nav2))


@pytest.mark.parametrize(
    ("text", "home"),
    [
        (HEAD + "      smoothing_frequency: 20.0\n", "velocity_smoother"),
        ("controller_server: {ros__parameters: {max_vel_x: 0.5}}", "dwb_core::DWBLocalPlanner"),
        ("amcl: {ros__parameters: {inflation_radius: 0.5}}", "nav2_costmap_2d::InflationLayer"),
        (
            "local_costmap: {local_costmap: {ros__parameters: {raytrace_max_range: 3.0}}}",
            "(its observation_sources)",
        ),
    ],
)
def test_misplaced_parameters_are_told_where_they_belong(inspect, text, home):
    message = only_error(inspect(text))
    assert "unknown to Nav2 in this place; it belongs to" in message
    assert home in message


def test_names_of_eloquent_are_told_what_to_become(inspect):
    message = only_error(
        inspect("planner_server: {ros__parameters: {planner_plugin_ids: [GridBased]}}")
    )
    assert "is of Nav2 Eloquent; since Foxy it is a list planner_plugins" in message


def test_nodes_of_other_packages_are_left_alone(inspect):
    nav2 = inspect(
        "gazebo: {ros__parameters: {publish_rate: 100.0}}\namcl: {ros__parameters: {alpha1: 0.1}}"
    )
    assert not nav2.errors
    assert any(
        "gazebo: no node of Nav2; its parameters are not read" in warning
        for warning in nav2.warnings
    )
    assert "did you mean 'amcl'" in only_error(
        inspect(f"{MAP}acml: {{ros__parameters: {{alpha1: 0.1}}}}")
    )


def test_plugins_of_other_packages_do_not_keep_a_file_from_loading(inspect):
    nav2 = inspect(
        f"{HEAD}      plugin: teb_local_planner::TebLocalPlannerROS\n"
        f"      max_vel_x_backwards: 0.2\n"
        "planner_server: {ros__parameters: {planner_plugins: [A], A: {plugin: "
        "mine/Planner, x: {y: 1}}}}\n"
        "local_costmap: {local_costmap: {ros__parameters: {plugins: [g], g: {plugin: "
        "mine/GradientLayer, z: 1}}}}\n"
    )
    assert not nav2.errors
    unknown = [notice.path for notice in nav2.notices if notice.id == "unknown-plugin"]
    assert unknown == ["controller_server: FollowPath", "planner_server: A", "local_costmap: g"]
    with pytest.raises(
        ParameterError,
        match="unknown plugin 'teb_local_planner::TebLocalPlannerROS'; .*available: ",
    ):
        read_controller(nav2)
    assert [notice.id for notice in lint(nav2) if notice.is_error] == ["unknown-plugin"] * 3


def test_placeholders_of_launch_files(inspect):
    layer = "      obstacle_layer: {plugin: 'nav2_costmap_2d::ObstacleLayer', enabled: %s}\n"
    head = "<robot_namespace>:\n  local_costmap:\n    local_costmap:\n     ros__parameters:\n"
    nav2 = inspect(head + "      plugins: [obstacle_layer]\n" + layer % "OBSTACLES_ENABLED")
    assert not nav2.errors
    assert any(
        "'OBSTACLES_ENABLED' is left to a launch file; Nav2's default is read" in text
        for text in nav2.warnings
    )
    assert read_costmap(nav2, "local_costmap").layers["obstacle_layer"].enabled
    for value in ("$(var speed)", "${SPEED}", "{{ speed }}", "<speed>", "MAX_SPEED"):
        error = only_error(inspect(f"{HEAD}      max_vel_x: '{value}'\n"))
        assert f"max_vel_x: '{value}' is left to a launch file; write a number" in error


def test_all_bad_values_of_a_section_are_reported(inspect):
    nav2 = inspect(f"{HEAD}      max_vel_x: fast\n      sim_time: long\n      vx_samples: 1.5\n")
    assert [notice.line for notice in nav2.notices if notice.id == "bad-value"] == [4, 5, 6]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "amcl: {ros__parameters: {save_pose_rate: often}}",
            "amcl: save_pose_rate: 'often' is not a number",
        ),
        (
            "amcl: {ros__parameters: {tf_broadcast: 1}}",
            "amcl: tf_broadcast: 1 is not true or false",
        ),
        (
            "map_server: {ros__parameters: {use_sim_time: 'true'}}",
            "map_server: use_sim_time: 'true' is not true or false",
        ),
    ],
)
def test_wrong_kinds_are_found_in_what_is_not_read_here(inspect, text, message):
    assert message in only_error(inspect(text))
    assert not inspect(
        "amcl: {ros__parameters: {use_sim_time: $(var use_sim_time), max_beams: 60}}"
    ).errors


def test_names_of_the_last_duplicate_count(inspect):
    nav2 = inspect(f"{HEAD}      max_vel_x: 0.5\n      max_vel_x: 0.9\n")
    assert read_dwb(nav2).max_vel_x == 0.9
    assert [notice.line for notice in nav2.notices if notice.id == "duplicate"] == [5]


def test_values_are_coerced_as_ros_does(inspect):
    nav2 = inspect(
        f"{HEAD}      max_vel_x: 1\n      prune_plan: off\n      vx_samples: 0x10\n"
        f"      sim_time: 1e0\n"
    )
    dwb = read_dwb(nav2)
    assert (dwb.max_vel_x, dwb.prune_plan, dwb.vx_samples, dwb.sim_time) == (1.0, False, 16, 1.0)
    assert [notice.path for notice in nav2.notices if notice.id == "whole-number"] == [
        "controller_server: FollowPath.max_vel_x"
    ]
    assert "'true' is not true or false" in only_error(inspect(f"{HEAD}      prune_plan: 'true'\n"))


@pytest.mark.parametrize(
    ("given", "is_told"), [("[1.0, 2, 3.0]", True), ("[1, 2, 3]", True), ("[1.0, 2.0, 3.0]", False)]
)
def test_one_whole_number_in_a_list_of_decimals_is_told(inspect, given, is_told):
    nav2 = inspect(f"velocity_smoother: {{ros__parameters: {{max_velocity: {given}}}}}\n")
    assert [notice.id for notice in nav2.notices].count("whole-number") == is_told


def test_merge_keys_between_nodes(inspect):
    nav2 = inspect(
        "local_costmap: {local_costmap: {ros__parameters: &body {robot_radius: 0.4, "
        "resolution: 0.1}}}\n"
        "global_costmap: {global_costmap: {ros__parameters: {<<: *body, resolution: 0.2}}}\n"
    )
    world = read_costmap(nav2, "global_costmap")
    assert (world.robot_radius, world.resolution) == (0.4, 0.2)


def test_limits_that_ros_accepts_are_accepted(inspect):
    nav2 = inspect(f"{HEAD}      min_vel_x: 0.6\n      max_vel_x: 0.5\n      vx_samples: 0\n")
    assert not nav2.errors  # the linter says what is wrong with them
    assert read_controller_server(nav2).controller_plugins == ("FollowPath",)


def test_a_node_with_parameters_of_its_own_is_named_once(inspect):
    error = only_error(inspect("amcl: {ros__parameters: {laser_model_type: foo}}\n"))
    assert error.count("amcl") == 1 and "laser_model_type foo must be one of" in error
