"""Numbers that size an array or a loop: too large ones are refused in one line, by lint, too."""

import math

import numpy as np
import pytest

from navstack.control.rpp.arc_check import ArcCheck
from navstack.costmap.costmap import Costmap
from navstack.errors import ParameterError
from navstack.geometry import make_footprint
from navstack.params.nav2_file.file import load_nav2
from navstack.params.rpp import RppParams
from navstack.params.smac import SmacHybridParams, iterations_of
from navstack.planning.smac.pose_planner import SmacHybrid
from navstack.types import Pose2D, Twist2D

PLANNER = "planner_server: {ros__parameters: {GridBased: {plugin: %s, %%s}}}"
CONTROLLER = "controller_server: {ros__parameters: {FollowPath: {plugin: %s, %%s}}}"
LOCAL = "local_costmap: {local_costmap: {ros__parameters: {rolling_window: true, %s}}}"
LAYER = LOCAL % "plugins: [it], it: {plugin: nav2_costmap_2d::InflationLayer, %s}"
HYBRID = PLANNER % "nav2_smac_planner::SmacPlannerHybrid"
TWO_D = PLANNER % "nav2_smac_planner::SmacPlanner2D"
NAVFN = PLANNER % "nav2_navfn_planner::NavfnPlanner"
OMPL = PLANNER % "navstack::OmplPlanner"
DWB = CONTROLLER % "dwb_core::DWBLocalPlanner"
RPP = CONTROLLER % "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController"
GRACEFUL = CONTROLLER % "nav2_graceful_controller::GracefulController"
SHIM = CONTROLLER % (
    "nav2_rotation_shim_controller::RotationShimController, "
    "primary_controller: dwb_core::DWBLocalPlanner"
)
COST = CONTROLLER % "navstack::ExpectedCostController"
AMCL = "amcl: {ros__parameters: {%s}}"
BEHAVIORS = "behavior_server: {ros__parameters: {%s}}"
MONITOR = (
    "collision_monitor: {ros__parameters: {polygons: [zone], "
    "zone: {type: circle, radius: 1.0, action_type: approach, %s}}}"
)
STVL = (
    "local_costmap: {local_costmap: {ros__parameters: {plugins: [it], "
    "it: {plugin: spatio_temporal_voxel_layer/SpatioTemporalVoxelLayer, %s}}}}"
)


@pytest.mark.parametrize(
    ("file", "line", "said"),
    [
        (HYBRID, "angle_quantization_bins: 2000000000", "must be 4 to 720"),
        (HYBRID, "angle_quantization_bins: 1", "must be 4 to 720"),
        (HYBRID, "minimum_turning_radius: 1.0e+9", "must be more than 0 to 100"),
        (HYBRID, "downsampling_factor: 1000000", "must be 1 to 100"),
        (HYBRID, "smoother.max_iterations: 2000000000", "must be 0 to 100000"),
        (HYBRID, "smoother.refinement_num: 1000000", "must be 0 to 100"),
        (TWO_D, "downsampling_factor: 2000000000", "must be 1 to 100"),
        (NAVFN, "tolerance: 1.0e+6", "must be 0 to 100"),
        (OMPL, "tolerance: 1.0e+6", "must be 0 to 100"),
        (OMPL, "max_iterations: 2000000000", "at most 10,000,000 without a max_planning_time"),
        (OMPL, "minimum_turning_radius: 1.0e+9", "must be more than 0 to 100"),
        (DWB, "sim_time: 0.0", "sim_time 0.0 must be more than 0"),
        (DWB, "sim_time: -1.0", "sim_time -1.0 must be more than 0"),
        (DWB, "linear_granularity: 0.0", "linear_granularity 0.0 must be more than 0"),
        (DWB, "angular_granularity: 0.0", "angular_granularity 0.0 must be more than 0"),
        (DWB, "sim_time: 1.0e+9, max_vel_x: 1.0", "at most 2,000,000 poses in all"),
        (RPP, "max_allowed_time_to_collision_up_to_carrot: 1.0e+9", "must be 0 to 100"),
        (RPP, "min_distance_to_obstacle: 1.0e+9", "must be at most 100"),
        (GRACEFUL, "in_place_collision_resolution: 1.0e-9", "must be 0.001 or more"),
        (SHIM, "simulate_ahead_time: 1.0e+9", "must be at most 100"),
        (COST, "cell: 1.0e-6", "must be 0.02 to 10"),
        (AMCL, "max_particles: 2000000000", "must be 0 to 1e+06"),
        (AMCL, "recovery_candidates: 2000000000", "must be 0 to 1e+06"),
        (AMCL, "laser_likelihood_max_dist: 1.0e+9", "must be more than 0 to 1000"),
        (BEHAVIORS, "simulate_ahead_time: 1.0e+9", "must be 0 to 100"),
        (MONITOR, "simulation_time_step: 1.0e-9", "at least time_before_collision / 10,000"),
        (LAYER, "inflation_radius: 1.0e+6", "must be 0 to 100"),
        (STVL, "voxel_size: 1.0e-9", "must be 0.001 to 1000"),
        (LOCAL, "width: 100000", "at most 20,000,000"),
        (LOCAL, "resolution: 1.0e-6", "must be 0.0001 to 1000"),
    ],
)
def test_a_number_that_eats_the_machine_is_refused_in_one_line(inspect, tmp_path, file, line, said):
    nav2 = inspect(file % line)
    errors = [error for error in nav2.errors if said in error]
    assert len(errors) == 1, nav2.notices
    with pytest.raises(ParameterError, match=line.partition(":")[0].rpartition(".")[2]) as caught:
        load_nav2(tmp_path / "robot.yaml")
    assert "\n" not in str(caught.value)


def test_times_without_end_are_iterations_without_limit():
    assert iterations_of(SmacHybridParams(max_planning_time=math.inf)) == 1_000_000


@pytest.mark.parametrize("bins", [4, 5, 8, 720])
def test_the_fewest_and_the_most_headings_find_a_way(bins):
    planner = SmacHybrid(SmacHybridParams(angle_quantization_bins=bins, smooth_path=False))
    costmap = Costmap(np.zeros((80, 80), dtype=np.uint8), 0.05, 0.0, 0.0)
    path = planner.plan(Pose2D(0.5, 0.5, 0.0), Pose2D(3.0, 3.0, 1.5), costmap)
    assert len(path.poses) > 10


def test_a_turn_on_the_spot_is_looked_at_once_around():
    footprint = make_footprint([[0.2, 0.1], [0.2, -0.1], [-0.2, -0.1], [-0.2, 0.1]])
    params = RppParams(min_distance_to_obstacle=1.0, min_approach_linear_velocity=0.0)
    check = ArcCheck(params, footprint, 0.23)
    costmap = Costmap(np.zeros((80, 80), dtype=np.uint8), 0.05, 0.0, 0.0)
    turn = Twist2D(angular_z=0.5)
    assert not check.collides(turn, Pose2D(2.0, 2.0, 0.0), 1.0, costmap)
    costmap.data[40, 35] = 254  # 0.22 m behind the robot's centre, beside its corners
    assert not check.collides(Twist2D(), Pose2D(2.0, 2.0, 1.0), 1.0, costmap)
    assert check.collides(turn, Pose2D(2.0, 2.0, 0.5 * math.pi), 1.0, costmap)
