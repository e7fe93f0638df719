"""Plugins of the remaining servers: checkers, behaviors, navigators, waypoint tasks, docks, routes."""

from navstack.params.nav2_file.schema.block import OPEN, Block, keys

GOAL_CHECKERS = {
    "nav2_controller::SimpleGoalChecker": keys(
        "plugin xy_goal_tolerance yaw_goal_tolerance stateful path_length_tolerance symmetric_yaw_tolerance"
    ),
    "nav2_controller::StoppedGoalChecker": keys(
        """plugin xy_goal_tolerance yaw_goal_tolerance stateful path_length_tolerance symmetric_yaw_tolerance
        trans_stopped_velocity rot_stopped_velocity"""
    ),
    "nav2_controller::PositionGoalChecker": keys("plugin xy_goal_tolerance stateful path_length_tolerance"),
    "nav2_controller::SymmetricGoalChecker": keys(
        "plugin xy_goal_tolerance yaw_goal_tolerance stateful path_length_tolerance"
    ),
    "nav2_controller::AxisGoalChecker": keys(
        "plugin along_path_tolerance cross_track_tolerance path_length_tolerance is_overshoot_valid"
    ),
    "nav2_controller::AdaptiveToleranceGoalChecker": OPEN,
    "nav2_controller::PathCompleteGoalChecker": OPEN,
    "nav2_controller::ProgressGoalChecker": OPEN,
}

PROGRESS_CHECKERS = {
    "nav2_controller::SimpleProgressChecker": keys("plugin required_movement_radius movement_time_allowance"),
    "nav2_controller::PoseProgressChecker": keys(
        "plugin required_movement_radius required_movement_angle movement_time_allowance"
    ),
    "nav2_controller::RotationProgressChecker": OPEN,
}

PATH_HANDLERS = {
    "nav2_controller::FeasiblePathHandler": OPEN,
    "nav2_controller::SimplePathHandler": OPEN,
    "nav2_controller::MPPIPathHandler": OPEN,
}

_SPIN = "plugin simulate_ahead_time max_rotational_vel min_rotational_vel rotational_acc_lim"
_DRIVE = "plugin simulate_ahead_time acceleration_limit deceleration_limit minimum_speed"
BEHAVIORS = {
    "nav2_behaviors::Spin": keys(_SPIN),
    "nav2_behaviors::BackUp": keys(_DRIVE),
    "nav2_behaviors::DriveOnHeading": keys(_DRIVE),
    "nav2_behaviors::Wait": keys("plugin"),
    "nav2_behaviors::AssistedTeleop": keys("plugin projection_time simulation_time_step cmd_vel_teleop"),
}

_NAVIGATOR = keys("plugin enable_groot_monitoring groot_server_port")
NAVIGATORS = {
    "nav2_bt_navigator::NavigateToPoseNavigator": _NAVIGATOR,
    "nav2_bt_navigator::NavigateThroughPosesNavigator": _NAVIGATOR,
    "opennav_coverage_navigator::CoverageNavigator": OPEN,
}

WAYPOINT_TASKS = {
    "nav2_waypoint_follower::WaitAtWaypoint": keys("plugin enabled waypoint_pause_duration"),
    "nav2_waypoint_follower::PhotoAtWaypoint": keys("plugin enabled image_topic save_dir image_format"),
    "nav2_waypoint_follower::InputAtWaypoint": keys("plugin enabled timeout input_topic"),
}

_DOCK = keys(
    """plugin staging_x_offset staging_yaw_offset use_battery_status use_external_detection_pose
    external_detection_timeout external_detection_translation_x external_detection_translation_y
    external_detection_rotation_yaw external_detection_rotation_pitch external_detection_rotation_roll filter_coef
    charging_threshold use_stall_detection stall_joint_names stall_velocity_threshold stall_effort_threshold
    docking_threshold dock_direction rotate_to_dock rotate_to_dock_threshold detector_service_name
    detector_service_timeout subscribe_toggle"""
)
DOCKS = {"opennav_docking::SimpleChargingDock": _DOCK, "opennav_docking::SimpleNonChargingDock": _DOCK}
DOCK_INSTANCE = keys("type frame pose id")

EDGE_SCORERS = {
    "nav2_route::CostmapScorer": keys(
        """plugin weight costmap_topic max_cost use_maximum invalid_on_collision invalid_off_map
        check_resolution"""
    ),
    "nav2_route::DistanceScorer": keys("plugin weight speed_tag"),
    "nav2_route::TimeScorer": keys("plugin weight speed_tag time_tag max_vel"),
    "nav2_route::PenaltyScorer": keys("plugin weight penalty_tag"),
    "nav2_route::SemanticScorer": Block(is_open=True),
    "nav2_route::StartPoseOrientationScorer": keys(
        "plugin orientation_weight use_orientation_threshold orientation_tolerance"
    ),
    "nav2_route::GoalPoseOrientationScorer": keys(
        "plugin orientation_weight use_orientation_threshold orientation_tolerance"
    ),
    "nav2_route::GoalOrientationScorer": keys(
        "plugin orientation_weight use_orientation_threshold orientation_tolerance"
    ),
    "nav2_route::DynamicEdgesScorer": keys("plugin"),
}
ROUTE_OPERATIONS = {
    "nav2_route::AdjustSpeedLimit": keys("plugin speed_limit_topic speed_tag"),
    "nav2_route::CollisionMonitor": keys(
        "plugin costmap_topic rate max_cost max_collision_dist check_resolution reroute_on_collision"
    ),
    "nav2_route::TimeMarker": keys("plugin time_tag"),
    "nav2_route::ReroutingService": keys("plugin"),
    "nav2_route::TriggerEvent": OPEN,
}
GRAPH_LOADERS = {"nav2_route::GeoJsonGraphFileLoader": keys("plugin")}
