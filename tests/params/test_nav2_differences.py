"""What another release or Nav2 itself takes differently: read as meant, and told."""

import pytest

from navstack.lint import lint
from navstack.params.nav2_file.sources import source_notices
from navstack.params.nav2_file.views import (
    read_collision_monitor,
    read_controller,
    read_costmap,
    read_dwb,
    read_planner,
    read_primary_controller,
)

RPP = "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController"
SHIM = "nav2_rotation_shim_controller::RotationShimController"
NAVFN = "nav2_navfn_planner::NavfnPlanner"
SEVERAL = f"""
controller_server:
  ros__parameters:
    controller_plugins: [Docking, FollowPath]
    Docking: {{plugin: "{RPP}", desired_linear_vel: 0.1}}
    FollowPath: {{plugin: "{RPP}", desired_linear_vel: 0.7}}
planner_server:
  ros__parameters:
    planner_plugins: [Straight, GridBased]
    Straight: {{plugin: "{NAVFN}", tolerance: 0.1}}
    GridBased: {{plugin: "{NAVFN}", tolerance: 0.7}}
velocity_smoother:
  ros__parameters:
    max_velocity: [0.5, 0.0, 1.0]
"""
MONITOR = """
collision_monitor:
  ros__parameters:
    polygons: [Stop]
    Stop:
      type: polygon
      action_type: stop
      points: [0.4, 0.3, 0.4, -0.3, 0, -0.3, 0, 0.3]  # by hand
"""
LAYERS = """
local_costmap:
  local_costmap:
    ros__parameters:
      plugins: [front, rear]
      front:
        plugin: "nav2_costmap_2d::ObstacleLayer"
        max_obstacle_height: 1.5
        observation_sources: scan cloud
        scan: {topic: /scan, max_obstacle_height: 2.0}
        cloud: {topic: /points, data_type: PointCloud2, max_obstacle_height: 2.0}
      rear:
        plugin: "nav2_costmap_2d::ObstacleLayer"
        observation_sources: same other
        same: {topic: scan, max_obstacle_height: 2.0}
        other: {topic: /rear_scan, max_obstacle_height: 2.0}
"""
BEHAVIORS = """
behavior_server:
  ros__parameters:
    behavior_plugins: [spin, wait]
    spin: {plugin: "nav2_behaviors::Spin", max_rotational_vel: 0.5, simulate_ahead_time: 1.0}
    wait: {plugin: "nav2_behaviors::Wait"}
    max_rotational_vel: 1.2
"""
DWB = """
controller_server:
  ros__parameters:
    FollowPath:
      plugin: "dwb_core::DWBLocalPlanner"
      path_distance_bias: 20.0
      PathDist.scale: 5.0
"""


def told(nav2, kind):
    return {notice.path: notice for notice in lint(nav2) if notice.id == kind}


def test_the_plugins_of_the_default_tree_drive_wherever_they_are_listed(inspect):
    nav2 = inspect(SEVERAL)
    assert (read_controller(nav2).name, read_planner(nav2).name) == ("FollowPath", "GridBased")
    assert not told(nav2, "tree-finds-no-plugin")
    # lint looks at the same
    assert "0.7 m/s" in told(nav2, "smoother-caps")["velocity_smoother: max_velocity"].message


def test_without_them_the_first_of_the_list_drives_and_that_is_told(inspect):
    nav2 = inspect(SEVERAL.replace("FollowPath", "Fast").replace("GridBased", "Round"))
    assert (read_controller(nav2).name, read_planner(nav2).name) == ("Docking", "Straight")
    notices = told(nav2, "tree-finds-no-plugin")
    assert set(notices) == {
        "controller_server: controller_plugins",
        "planner_server: planner_plugins",
    }
    assert "asks for FollowPath" in notices["controller_server: controller_plugins"].message
    assert not any(notice.is_error for notice in notices.values())


def test_a_tree_of_the_files_own_may_ask_for_any_plugin(inspect):
    text = SEVERAL.replace("FollowPath", "Fast") + "bt_navigator: {ros__parameters: {%s: %s}}"
    key = "default_nav_to_pose_bt_xml"
    assert not told(inspect(text % (key, "my_tree.xml")), "tree-finds-no-plugin")
    assert told(
        inspect(text % (key, "navigate_to_pose_w_replanning_and_recovery.xml")),
        "tree-finds-no-plugin",
    )


@pytest.mark.parametrize("kind", ["goal", "progress"])
def test_several_checkers_are_told_and_the_first_is_read(inspect, kind):
    types = f"plugin: nav2_controller::Simple{kind.title()}Checker"
    text = (
        f"controller_server: {{ros__parameters: {{{kind}_checker_plugins: [a, b], a: "
        f"{{{types}}}, b: {{{types}}}}}}}"
    )
    notices = told(inspect(text), "ambiguous-checker")
    assert notices[f"controller_server: {kind}_checker_plugins"].message.startswith("a, b, but ")
    assert not told(inspect(text.replace("[a, b]", "[a]")), "ambiguous-checker")


@pytest.mark.parametrize(
    ("head", "release"),
    [
        (f'plugin: "{RPP}"', "lyrical"),
        (f'plugin: "{SHIM}", primary_controller: "{RPP}"', "jazzy"),
    ],
)
def test_rollings_name_of_pure_pursuits_speed(inspect, head, release):
    """It is told where the file reads like one of a release that does not have it."""
    nav2 = inspect(
        f"controller_server: {{ros__parameters: {{FollowPath: {{{head}, max_linear_vel: 1.3}}}}}}"
    )
    plugin = read_controller(nav2)
    params = (read_primary_controller(nav2, plugin) if plugin.type == SHIM else plugin).params
    assert params.desired_linear_vel == 1.3
    assert nav2.release == release
    notices = told(nav2, "renamed")
    if release == "lyrical":
        assert not notices
    else:
        (notice,) = notices.values()
        assert notice.path == "controller_server: FollowPath.max_linear_vel"
        assert notice.message == "is another name (since lyrical); read as 'desired_linear_vel'"
    after = nav2.with_values({"controller_server.FollowPath.desired_linear_vel": 0.9})
    assert after.document.text == nav2.document.text.replace("1.3", "0.9")


def test_of_two_names_jazzys_counts(inspect):
    body = f'{{plugin: "{RPP}", max_linear_vel: 1.3, desired_linear_vel: 0.4}}'
    nav2 = inspect(f"controller_server: {{ros__parameters: {{FollowPath: {body}}}}}")
    assert read_controller(nav2).params.desired_linear_vel == 0.4
    assert (
        "controller_server: FollowPath.max_linear_vel (desired_linear_vel is given)" in nav2.ignored
    )


def test_polygons_as_lists_of_numbers(inspect):
    nav2 = inspect(MONITOR)
    today = "[[0.4, 0.3], [0.4, -0.3], [0.0, -0.3], [0.0, 0.3]]"
    assert read_collision_monitor(nav2).zones["Stop"].points == today
    (notice,) = told(nav2, "older-form").values()
    assert (notice.path, notice.advice) == ("collision_monitor: Stop.points", f'points: "{today}"')
    assert "points: [0.4" in MONITOR.splitlines()[notice.line - 1]
    after = nav2.with_values({"collision_monitor.Stop.min_points": 6})
    assert "points: [0.4, 0.3, 0.4, -0.3, 0, -0.3, 0, 0.3]  # by hand\n" in after.document.text


@pytest.mark.parametrize(
    "points",
    ["[0.4, 0.3, 0.4, -0.3, 0, -0.3]", "[1, 2, 3, 4, 5, 6, 7, 8, 9]", "[a, 1, 2, 3, 4, 5, 6, 7]"],
)
def test_lists_that_are_no_polygon_are_refused(inspect, points):
    nav2 = inspect(MONITOR.replace("[0.4, 0.3, 0.4, -0.3, 0, -0.3, 0, 0.3]", points))
    assert len(nav2.errors) == 1
    assert "collision_monitor: Stop.points" in nav2.errors[0]
    assert not told(nav2, "older-form")


def test_sources_that_read_the_one_scan_instead_of_their_own_sensor(inspect):
    notices = told(inspect(LAYERS), "substitute")
    assert set(notices) == {"local_costmap: front.cloud", "local_costmap: rear.other"}
    assert (
        notices["local_costmap: front.cloud"].message
        == "a PointCloud2 runs on the robot's planar scan"
    )
    assert "'rear_scan' is that of 'scan' here" in notices["local_costmap: rear.other"].message
    assert not told(
        inspect(LAYERS.replace("rear:", "rear:\n        enabled: false")), "substitute"
    ).keys() - {"local_costmap: front.cloud"}


@pytest.mark.parametrize(
    ("layer", "enabled", "told"),
    [
        ("ObstacleLayer", "true", ["cloud", "other"]),
        ("ObstacleLayer", "false", ["other"]),
        ("VoxelLayer", "true", []),
    ],
)
def test_sources_of_enabled_obstacle_layers_are_looked_at(inspect, layer, enabled, told):
    """Where the first layer is left out, the second one's first topic is the robot's scan."""
    text = LAYERS.replace("max_obstacle_height: 1.5", f"enabled: {enabled}").replace(
        "ObstacleLayer", layer
    )
    notices = source_notices(inspect(text).parameters)
    assert [notice.path.rpartition(".")[2] for notice in notices] == told
    assert [text.splitlines()[notice.line - 1].split(":")[0].strip() for notice in notices] == told


def test_heights_of_a_layer_have_no_effect(inspect):
    nav2 = inspect(LAYERS)
    assert "local_costmap: front.max_obstacle_height" in nav2.ignored
    # for points with heights
    assert read_costmap(nav2, "local_costmap").layers["front"].max_obstacle_height == 1.5


def test_a_threshold_that_further_scans_or_a_point_cloud_may_reach(inspect):
    voxel = LAYERS.replace("ObstacleLayer", "VoxelLayer").replace(
        "max_obstacle_height: 1.5", "mark_threshold: 1"
    )
    assert not told(inspect(voxel), "unreached-threshold")
    assert not told(inspect(voxel.replace("PointCloud2", "LaserScan")), "unreached-threshold")
    cloud = voxel.replace("observation_sources: scan cloud", "observation_sources: cloud")
    assert not told(inspect(cloud), "unreached-threshold")
    single = voxel.replace("observation_sources: scan cloud", "observation_sources: scan")
    assert set(told(inspect(single), "unreached-threshold")) == {
        "local_costmap: front.mark_threshold"
    }


def test_a_costmap_that_comes_within_a_longer_timeout(inspect):
    text = LAYERS.replace("plugins:", "update_frequency: 2.0\n      plugins:", 1)
    slow = "controller_server: {ros__parameters: {costmap_update_timeout: %s}}"
    advice = told(inspect(text + slow % 0.5), "late-costmap")[
        "local_costmap: update_frequency"
    ].advice
    assert (
        advice == "update_frequency: 3.0, or costmap_update_timeout: 1.0 in the controller server"
    )
    assert not told(inspect(text + slow % 0.6), "late-costmap")
    assert told(inspect(text + slow % 0.0), "late-costmap")[
        "local_costmap: update_frequency"
    ].advice.startswith("costmap_")


def test_parameters_of_spin_belong_to_its_server(inspect):
    nav2 = inspect(BEHAVIORS)
    misplaced = [each.path for each in nav2.notices if "belongs to behavior_server" in each.message]
    assert misplaced == [
        "behavior_server: spin.max_rotational_vel",
        "behavior_server: spin.simulate_ahead_time",
    ]
    assert not {
        name
        for name in nav2.ignored
        if name.endswith("plugin") or name == "behavior_server: max_rotational_vel"
    }


def test_dwb_without_critics_has_the_scales_that_foxy_gave_them(inspect):
    nav2 = inspect(DWB)
    missing = told(nav2, "missing-value")["controller_server: FollowPath.critics"]
    assert "needs it to start; list them, as in critics: [Rot" in str(missing)
    assert str(missing).startswith("line 5: ") and not missing.is_error
    scales = {name: getattr(read_dwb(nav2), name).scale for name in read_dwb(nav2).critics}
    assert scales == {
        "RotateToGoal": 1.0,
        "Oscillation": 1.0,
        "ObstacleFootprint": 0.01,
        "GoalAlign": 24.0,
        "PathAlign": 20.0,  # from path_distance_bias
        "PathDist": 5.0,  # its own
        "GoalDist": 24.0,
    }
    assert not any("bias" in name for name in nav2.ignored)
    after = nav2.with_values({"controller_server.FollowPath.GoalDist.scale": 7.0})
    assert after.document.text == nav2.document.text + "      GoalDist.scale: 7.0\n"
    assert read_dwb(after).GoalDist.scale == 7.0
    assert read_dwb(inspect(nav2.dump_merged())) == read_dwb(nav2)


def test_what_nav2_sets_by_itself_is_no_parameter_of_the_file(inspect):
    nav2 = inspect("amcl: {ros__parameters: {max_beams: 60}}")
    assert read_dwb(nav2).PathDist.scale == 32.0
    assert not lint(nav2)


def test_dwb_with_critics_takes_no_scale_from_elsewhere(inspect):
    nav2 = inspect(DWB + "      critics: [PathAlign, PathDist]\n")
    assert not told(nav2, "missing-value")
    assert (read_dwb(nav2).PathAlign.scale, read_dwb(nav2).PathDist.scale) == (1.0, 5.0)
    assert "controller_server: FollowPath.path_distance_bias" in nav2.ignored
