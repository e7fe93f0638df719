"""Files of Nav2 main: the motion model is a plugin's, and a path handler prunes the plan."""

import pytest

from navstack.errors import ParameterError
from navstack.params.nav2_file.file import load_nav2
from navstack.params.nav2_file.views import read_controller, read_mppi, read_primary_controller

MAIN = """
bt_navigator:
  ros__parameters:
    navigators: ["navigate_to_pose", "navigate_through_poses"]
    navigate_to_pose: {plugin: "nav2_bt_navigator::NavigateToPoseNavigator", search_window: 2.0}
    navigate_through_poses:
      plugin: "nav2_bt_navigator::NavigateThroughPosesNavigator"
      search_window: 2.0
controller_server:
  ros__parameters:
    path_handler_plugins: ["PathHandler"]
    PathHandler:
      plugin: "nav2_controller::FeasiblePathHandler"
      prune_distance: 2.0
      enforce_path_inversion: true
      inversion_xy_tolerance: 0.3
      inversion_yaw_tolerance: 0.5
    FollowPath:
      plugin: "nav2_mppi_controller::MPPIController"
      critics: ["ConstraintCritic"]
      model_delay_vx: 0.0
      model_delay_vy: 0.0
      model_delay_wz: 0.0
      MODEL
planner_server:
  ros__parameters:
    GridBased: {plugin: "nav2_navfn_planner::NavfnPlanner", max_cycles_factor: 4}
"""
CAR = '{plugin: "mppi::AckermannMotionModel", min_turning_r: 0.7}'


def lines(*given):
    return MAIN.replace("MODEL", "\n      ".join(given))


@pytest.mark.parametrize(
    ("given", "model", "radius"),
    [
        (
            ["motion_model: diff_drive", "diff_drive: {plugin: mppi::DiffDriveMotionModel}"],
            "DiffDrive",
            0.2,
        ),
        (["motion_model: truck", f"truck: {CAR}"], "Ackermann", 0.7),
        (["motion_model: DiffDrive", f"DiffDrive: {CAR}"], "Ackermann", 0.7),
        (["motion_model: swerve", "swerve: {plugin: mppi/OmniMotionModel}"], "Omni", 0.2),
        (["diff_drive: {plugin: mppi::OmniMotionModel}"], "Omni", 0.2),
        (
            ["motion_model: one", "one: {plugin: mppi::OmniMotionModel}", f"other: {CAR}"],
            "Omni",
            0.2,
        ),
        (["motion_model: Ackermann"], "Ackermann", 0.2),
        ([], "DiffDrive", 0.2),
    ],
    ids=["default", "named", "jazzy-name", "omni", "unnamed", "two-groups", "jazzy", "none"],
)
def test_the_plugin_of_the_named_group_is_the_motion_model(inspect, given, model, radius):
    nav2 = inspect(lines(*given))
    assert not nav2.notices
    params = read_mppi(nav2)
    assert params.motion_model == model
    assert params.AckermannConstraints.min_turning_r == radius


def test_the_radius_of_the_named_group_is_changed_where_it_stands(inspect):
    nav2 = inspect(lines("motion_model: truck", f"truck: {CAR}"))
    name = "controller_server.FollowPath.AckermannConstraints.min_turning_r"
    assert read_mppi(nav2.with_values({name: 1.3})).AckermannConstraints.min_turning_r == 1.3
    with pytest.raises(ParameterError, match="motion model DiffDrive is not available here"):
        nav2.with_values({"controller_server.FollowPath.motion_model": "DiffDrive"})


def test_a_value_of_the_path_handler_is_changed_where_it_stands(inspect):
    """Nav2 main reads it there alone; a tuned file must drive as it was tuned."""
    nav2 = inspect(lines("motion_model: DiffDrive"))
    name = "controller_server.FollowPath.prune_distance"
    assert read_mppi(nav2).prune_distance == 2.0
    tuned = nav2.with_values({name: 1.2})
    assert read_mppi(tuned).prune_distance == 1.2
    assert tuned.document.text == nav2.document.text.replace(
        "prune_distance: 2.0", "prune_distance: 1.2"
    )


def test_a_motion_model_that_is_not_available_is_named(inspect, tmp_path):
    nav2 = inspect(lines("motion_model: mine", 'mine: {plugin: "my_models::Tank"}'))
    (error,) = nav2.errors
    assert "FollowPath.mine.plugin: motion model my_models::Tank is not available here" in error
    assert "mppi::DiffDriveMotionModel, mppi::AckermannMotionModel, mppi::OmniMotionModel" in error
    with pytest.raises(ParameterError, match="my_models::Tank"):
        load_nav2(tmp_path / "robot.yaml")


def test_the_path_handler_prunes_the_plan(inspect):
    params = read_controller(inspect(lines("prune_distance: 9.0"))).params
    assert params.prune_distance == 2.0
    assert params.enforce_path_inversion
    assert (params.inversion_xy_tolerance, params.inversion_yaw_tolerance) == (0.3, 0.5)


@pytest.mark.parametrize(
    ("kind", "name", "value"),
    [
        ("dwb_core::DWBLocalPlanner", "forward_prune_distance", 3.5),
        (
            "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController",
            "max_robot_pose_search_dist",
            7.0,
        ),
        ("nav2_graceful_controller::GracefulController", "max_robot_pose_search_dist", 7.0),
    ],
)
def test_the_path_handler_serves_every_controller(inspect, kind, name, value):
    handler = (
        "PathHandler: {plugin: 'nav2_controller::FeasiblePathHandler', "
        "prune_distance: 3.5, max_robot_pose_search_dist: 7.0}"
    )
    body = f"path_handler_plugins: [PathHandler], {handler}, FollowPath: {{plugin: '{kind}'}}"
    nav2 = inspect(f"controller_server: {{ros__parameters: {{{body}}}}}")
    assert not nav2.errors
    assert getattr(read_controller(nav2).params, name) == value


def test_below_a_rotation_shim_too(inspect):
    shim = 'plugin: "nav2_rotation_shim_controller::RotationShimController"'
    text = lines("motion_model: truck", f"truck: {CAR}")
    primary = 'primary_controller: "nav2_mppi_controller::MPPIController"'
    text = text.replace(
        'plugin: "nav2_mppi_controller::MPPIController"', f"{shim}\n      {primary}"
    )
    nav2 = inspect(text)
    assert not nav2.notices
    params = read_primary_controller(nav2, read_controller(nav2)).params
    assert (params.motion_model, params.prune_distance) == ("Ackermann", 2.0)


def test_the_merged_file_means_the_same(inspect, tmp_path):
    nav2 = inspect(lines("motion_model: truck", f"truck: {CAR}"))
    merged = tmp_path / "merged.yaml"
    merged.write_text(nav2.dump_merged())
    assert read_mppi(load_nav2(merged)) == read_mppi(nav2)
