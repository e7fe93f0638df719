"""Plugins of the remaining servers: checkers, behaviors, navigators, waypoint tasks, docks, routes."""

from navstack.params.behaviors import DriveParams
from navstack.params.checkers import (
    PoseProgressCheckerParams,
    PositionGoalCheckerParams,
    SimpleGoalCheckerParams,
    SimpleProgressCheckerParams,
    StoppedGoalCheckerParams,
)
from navstack.params.registry.block import OPEN, Block, keys, of_fields
from navstack.params.registry.entry import Entry, Family, Params


def _goal_checker(name: str, params: Params, *unread: str) -> Entry:
    """A goal checker; ``unread``: parameters of Nav2's that its dataclass does not have."""
    return Entry(of_fields(params, "plugin", *unread), f"navstack.control.goal_checker:{name}", params)


def _progress_checker(name: str, params: Params) -> Entry:
    return Entry(of_fields(params, "plugin"), f"navstack.control.progress_checker:{name}", params)


_PLAN = "path_length_tolerance"
GOAL_CHECKERS: Family = {
    "nav2_controller::SimpleGoalChecker": _goal_checker("SimpleGoalChecker", SimpleGoalCheckerParams, _PLAN),
    "nav2_controller::StoppedGoalChecker": _goal_checker("StoppedGoalChecker", StoppedGoalCheckerParams, _PLAN),
    "nav2_controller::PositionGoalChecker": _goal_checker("PositionGoalChecker", PositionGoalCheckerParams, _PLAN),
    "nav2_controller::SymmetricGoalChecker": Entry(
        keys("plugin xy_goal_tolerance yaw_goal_tolerance stateful path_length_tolerance"),
        "navstack.control.goal_checker:SymmetricGoalChecker",
        SimpleGoalCheckerParams,
    ),
    "nav2_controller::AxisGoalChecker": Entry(
        keys("plugin along_path_tolerance cross_track_tolerance path_length_tolerance is_overshoot_valid")
    ),
    "nav2_controller::AdaptiveToleranceGoalChecker": Entry(OPEN),
    "nav2_controller::PathCompleteGoalChecker": Entry(OPEN),
    "nav2_controller::ProgressGoalChecker": Entry(OPEN),
}

PROGRESS_CHECKERS: Family = {
    "nav2_controller::SimpleProgressChecker": _progress_checker("SimpleProgressChecker", SimpleProgressCheckerParams),
    "nav2_controller::PoseProgressChecker": _progress_checker("PoseProgressChecker", PoseProgressCheckerParams),
    "nav2_controller::RotationProgressChecker": Entry(OPEN),
}

PATH_HANDLERS: Family = {
    "nav2_controller::FeasiblePathHandler": Entry(OPEN),
    "nav2_controller::SimplePathHandler": Entry(OPEN),
    "nav2_controller::MPPIPathHandler": Entry(OPEN),
}

_SPIN = "plugin simulate_ahead_time max_rotational_vel min_rotational_vel rotational_acc_lim"
_DRIVE = of_fields(DriveParams, "plugin", "simulate_ahead_time")
BEHAVIORS: Family = {
    "nav2_behaviors::Spin": Entry(keys(_SPIN), "navstack.behaviors.spin:Spin"),
    "nav2_behaviors::BackUp": Entry(_DRIVE, "navstack.behaviors.drive:BackUp", DriveParams),
    "nav2_behaviors::DriveOnHeading": Entry(_DRIVE, "navstack.behaviors.drive:DriveOnHeading", DriveParams),
    "nav2_behaviors::Wait": Entry(keys("plugin"), "navstack.behaviors.wait:Wait"),
    "nav2_behaviors::AssistedTeleop": Entry(keys("plugin projection_time simulation_time_step cmd_vel_teleop")),
}

_NAVIGATOR = keys("plugin enable_groot_monitoring groot_server_port")
NAVIGATORS: Family = {
    "nav2_bt_navigator::NavigateToPoseNavigator": Entry(_NAVIGATOR),
    "nav2_bt_navigator::NavigateThroughPosesNavigator": Entry(_NAVIGATOR),
    "opennav_coverage_navigator::CoverageNavigator": Entry(OPEN),
}

WAYPOINT_TASKS: Family = {
    "nav2_waypoint_follower::WaitAtWaypoint": Entry(keys("plugin enabled waypoint_pause_duration")),
    "nav2_waypoint_follower::PhotoAtWaypoint": Entry(keys("plugin enabled image_topic save_dir image_format")),
    "nav2_waypoint_follower::InputAtWaypoint": Entry(keys("plugin enabled timeout input_topic")),
}

_DOCK = keys(
    """plugin staging_x_offset staging_yaw_offset use_battery_status use_external_detection_pose
    external_detection_timeout external_detection_translation_x external_detection_translation_y
    external_detection_rotation_yaw external_detection_rotation_pitch external_detection_rotation_roll filter_coef
    charging_threshold use_stall_detection stall_joint_names stall_velocity_threshold stall_effort_threshold
    docking_threshold dock_direction rotate_to_dock rotate_to_dock_threshold detector_service_name
    detector_service_timeout subscribe_toggle"""
)
DOCKS: Family = {
    "opennav_docking::SimpleChargingDock": Entry(_DOCK),
    "opennav_docking::SimpleNonChargingDock": Entry(_DOCK),
}
DOCK_INSTANCE = keys("type frame pose id")

_ORIENTATION = keys("plugin orientation_weight use_orientation_threshold orientation_tolerance")
EDGE_SCORERS: Family = {
    "nav2_route::CostmapScorer": Entry(
        keys(
            """plugin weight costmap_topic max_cost use_maximum invalid_on_collision invalid_off_map
        check_resolution"""
        )
    ),
    "nav2_route::DistanceScorer": Entry(keys("plugin weight speed_tag")),
    "nav2_route::TimeScorer": Entry(keys("plugin weight speed_tag time_tag max_vel")),
    "nav2_route::PenaltyScorer": Entry(keys("plugin weight penalty_tag")),
    "nav2_route::SemanticScorer": Entry(Block(is_open=True)),
    "nav2_route::StartPoseOrientationScorer": Entry(_ORIENTATION),
    "nav2_route::GoalPoseOrientationScorer": Entry(_ORIENTATION),
    "nav2_route::GoalOrientationScorer": Entry(_ORIENTATION),
    "nav2_route::DynamicEdgesScorer": Entry(keys("plugin")),
}
ROUTE_OPERATIONS: Family = {
    "nav2_route::AdjustSpeedLimit": Entry(keys("plugin speed_limit_topic speed_tag")),
    "nav2_route::CollisionMonitor": Entry(
        keys("plugin costmap_topic rate max_cost max_collision_dist check_resolution reroute_on_collision")
    ),
    "nav2_route::TimeMarker": Entry(keys("plugin time_tag")),
    "nav2_route::ReroutingService": Entry(keys("plugin")),
    "nav2_route::TriggerEvent": Entry(OPEN),
}
GRAPH_LOADERS: Family = {"nav2_route::GeoJsonGraphFileLoader": Entry(keys("plugin"))}
