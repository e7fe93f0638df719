"""Values that Nav2 takes, odd as they are: no limit, no updates, a quoted number."""

import math

import numpy as np
import pytest

from harness.episode.brains import steps_per_tick
from navstack.control.controller import Surroundings
from navstack.control.mppi.mppi_controller import MppiController
from navstack.costmap.costmap import Costmap
from navstack.costmap.layered_costmap import LayeredCostmap
from navstack.costmap.map_io import load_metadata
from navstack.errors import MapError
from navstack.lint import lint
from navstack.params.costmap import CostmapParams, ObservationSourceParams, ObstacleLayerParams
from navstack.params.nav2_file.views import (
    read_costmap,
    read_mppi,
    read_planner,
    read_velocity_smoother,
)
from navstack.safety.velocity_smoother import VelocitySmoother
from navstack.types import LaserScan, Path, Pose2D, RobotState, Twist2D

FOOTPRINT = np.array(((0.2, 0.2), (0.2, -0.2), (-0.2, -0.2), (-0.2, 0.2)))
ENDLESS = """
controller_server:
  ros__parameters:
    controller_frequency: 20.0
    FollowPath: {plugin: "dwb_core::DWBLocalPlanner", critics: ["PathDist"]}
velocity_smoother:
  ros__parameters:
    max_velocity: [.inf, 0.0, .inf]
    min_velocity: [-.inf, 0.0, -.inf]
    max_accel: [.inf, 0.0, .inf]
    max_decel: [-.inf, 0.0, -.inf]
local_costmap:
  local_costmap:
    ros__parameters:
      update_frequency: 0.0
      rolling_window: true
      plugins: ["obstacle_layer"]
      obstacle_layer:
        plugin: "nav2_costmap_2d::ObstacleLayer"
        observation_sources: scan
        scan: {obstacle_max_range: .inf, raytrace_max_range: .inf, clearing: true}
"""


def test_no_limit_and_no_updates_are_read(inspect):
    nav2 = inspect(ENDLESS)
    assert not nav2.errors
    costmap = read_costmap(nav2, "local_costmap")
    assert costmap.update_frequency == 0.0
    (source,) = costmap.layers["obstacle_layer"].sources.values()
    assert (source.obstacle_max_range, source.raytrace_max_range) == (1e6, 1e6)  # [m]
    assert read_velocity_smoother(nav2).max_velocity == (math.inf, 0.0, math.inf)
    told = [each for each in lint(nav2) if each.path == "local_costmap: update_frequency"]
    assert len(told) == 1
    assert told[0].message.startswith("0 Hz: it is never updated, and the robot does not move")


def test_what_is_never_updated_sets_no_length_of_a_tick(inspect):
    usual = ENDLESS.replace("update_frequency: 0.0", "update_frequency: 20.0")
    assert steps_per_tick(inspect(ENDLESS), 120.0) == steps_per_tick(inspect(usual), 120.0) == 6


@pytest.mark.parametrize("scale", [True, False])
def test_a_smoother_without_limits_passes_commands_on(inspect, scale):
    params = read_velocity_smoother(
        inspect(ENDLESS.replace("max_decel:", f"scale_velocities: {scale}\n    max_decel:"))
    )
    smoother = VelocitySmoother(params)
    command = Twist2D(1.5, 0.0, -2.0)
    for stamp in (0.05, 0.1):
        assert smoother.smooth(command, Twist2D(), stamp) == command


@pytest.mark.parametrize("prefer_fast", [True, False])
def test_a_source_without_range_marks_what_the_scan_shows(prefer_fast):
    def shown(reach):
        source = ObservationSourceParams(
            clearing=True,
            obstacle_max_range=reach,
            raytrace_max_range=reach,
        )
        layer = ObstacleLayerParams(observation_sources=("scan",), sources={"scan": source})
        params = CostmapParams(
            width=8.0,
            height=8.0,
            rolling_window=True,
            plugins=("it",),
            layers={"it": layer},
        )
        costmap = LayeredCostmap(params, prefer_fast=prefer_fast)
        ranges = np.linspace(1.0, 3.0, 90)
        scan = LaserScan(0.0, ranges, -math.pi, math.pi / 45.0, 0.1, 30.0)
        costmap.update(Pose2D(1.0, 2.0, 0.3), scan, 0.0)
        return costmap.master.data

    assert (shown(100.0) == 254).any()
    np.testing.assert_array_equal(shown(math.inf), shown(100.0))


@pytest.mark.parametrize(
    ("text", "negate"),
    [("0", False), ('"0"', False), ("'1'", True), ('"-1"', True), ('"true"', True), ("no", False)],
)
def test_a_maps_negate_may_be_quoted(tmp_path, text, negate):
    path = tmp_path / "map.yaml"
    path.write_text(
        f"image: map.png\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: {text}\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.2\n"
    )
    assert load_metadata(path).negate is negate


@pytest.mark.parametrize("text", ['"0.5"', "maybe", "0.0", '""'])
def test_a_maps_negate_is_a_whole_number_or_a_switch(tmp_path, text):
    path = tmp_path / "map.yaml"
    path.write_text(
        f"image: map.png\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: {text}\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.2\n"
    )
    with pytest.raises(MapError, match="negate"):
        load_metadata(path)


MPPI = """
controller_server:
  ros__parameters:
    FollowPath:
      plugin: "nav2_mppi_controller::MPPIController"
      motion_model: "Omni"
      ay_max: 0.0
      ay_min: 0.0
      critics: ["GoalCritic", "PathFollowCritic"]
"""
PLANNER = """
planner_server:
  ros__parameters:
    GridBased: {plugin: "nav2_theta_star_planner::ThetaStarPlanner", how_many_corners: 6}
"""
DWB = """
controller_server:
  ros__parameters:
    FollowPath:
      plugin: "dwb_core::DWBLocalPlanner"
      critics: ["ExpectedContact"]
      ExpectedContact: {contact_usd: [1.0, 2.0, 3.0, 4.0, 5.0, .inf]}
"""


def test_a_robot_that_cannot_drive_sideways_has_no_sideways_acceleration(inspect):
    nav2 = inspect(MPPI)
    assert not nav2.errors
    params = read_mppi(nav2)
    controller = MppiController(params, FOOTPRINT, 20.0, 0.25)
    controller.seed(np.random.default_rng(1))
    controller.reset()
    plan = Path(np.column_stack((np.linspace(0.0, 2.0, 41), np.full(41, 0.3), np.zeros(41))))
    free = Costmap(np.zeros((80, 80), dtype=np.uint8), 0.05, -2.0, -2.0)
    state = RobotState(Pose2D(), Twist2D())
    command = controller.compute_velocity(state, plan, Surroundings(free))
    assert command.linear_x > 0.0
    assert command.linear_y == 0.0


@pytest.mark.parametrize(("value", "is_told"), [(4, False), (8, False), (6, True), (0, True)])
def test_a_number_that_nav2_replaces_is_told_of_every_plugin(inspect, value, is_told):
    nav2 = inspect(PLANNER.replace("6", str(value)))
    told = [each.advice for each in nav2.notices if each.id == "replaced-value"]
    assert told == ["how_many_corners: 8"] * is_told
    assert read_planner(nav2).params.how_many_corners == (8 if is_told else value)


@pytest.mark.parametrize("value", ["-1.0", "many"])
def test_what_is_no_whole_number_is_refused_at_once(inspect, value):
    """Not sought among all two thousand million that are known."""
    smac = "planner_server: {ros__parameters: {planner_plugins: [GridBased], GridBased: {plugin: "
    nav2 = inspect(f"{smac}nav2_smac_planner::SmacPlanner2D, max_iterations: {value}}}}}}}\n")
    assert any("is not a whole number" in each.message for each in nav2.notices)


@pytest.mark.parametrize("value", [".inf", "-.inf", "1e10"])
def test_endless_numbers_in_a_list_are_judged_as_others_are(inspect, value):
    alone = DWB.replace("contact_usd: [1.0, 2.0, 3.0, 4.0, 5.0, .inf]", f"speed_std: {value}")
    for text in (DWB.replace(".inf", value), alone):
        (error,) = inspect(text).errors
        assert "ExpectedContact" in error
        assert "must be" in error or "out of range" in error
