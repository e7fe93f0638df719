"""Parameters that Nav2's own files set, release by release; every name is known in its place.

Sources: nav2_bringup's ``nav2_params.yaml`` of each release (github.com/ros-navigation/navigation2,
Apache-2.0), its names only; a value is not part of this list.
"""

import json

import pytest

BT = "bt_navigator/global_frame robot_base_frame odom_topic"
AMCL = """amcl/alpha1 alpha2 alpha3 alpha4 alpha5 base_frame_id beam_skip_distance beam_skip_error_threshold
    beam_skip_threshold do_beamskip global_frame_id lambda_short laser_likelihood_max_dist laser_max_range
    laser_min_range laser_model_type max_beams max_particles min_particles odom_frame_id pf_err pf_z recovery_alpha_fast
    recovery_alpha_slow resample_interval robot_model_type save_pose_rate sigma_hit tf_broadcast transform_tolerance
    update_min_a update_min_d z_hit z_max z_rand z_short scan_topic"""
SERVER = """controller_server/controller_frequency min_x_velocity_threshold min_y_velocity_threshold
    min_theta_velocity_threshold controller_plugins progress_checker.plugin progress_checker.required_movement_radius
    progress_checker.movement_time_allowance"""
GOAL = "plugin xy_goal_tolerance yaw_goal_tolerance stateful"
DWB = """plugin debug_trajectory_details min_vel_x min_vel_y max_vel_x max_vel_y max_vel_theta min_speed_xy max_speed_xy
    min_speed_theta acc_lim_x acc_lim_y acc_lim_theta decel_lim_x decel_lim_y decel_lim_theta vx_samples vy_samples
    vtheta_samples sim_time linear_granularity angular_granularity transform_tolerance xy_goal_tolerance
    trans_stopped_velocity short_circuit_trajectory_evaluation stateful critics BaseObstacle.scale PathAlign.scale
    PathAlign.forward_point_distance GoalAlign.scale GoalAlign.forward_point_distance PathDist.scale GoalDist.scale
    RotateToGoal.scale RotateToGoal.slowing_factor RotateToGoal.lookahead_time"""
MPPI = """plugin time_steps model_dt batch_size ax_max ax_min ay_max ay_min az_max vx_std vy_std wz_std vx_max vx_min
    vy_max wz_max iteration_count prune_distance transform_tolerance temperature gamma motion_model visualize
    regenerate_noises TrajectoryVisualizer.trajectory_step TrajectoryVisualizer.time_step
    AckermannConstraints.min_turning_r critics ConstraintCritic.enabled ConstraintCritic.cost_power
    ConstraintCritic.cost_weight GoalCritic.threshold_to_consider GoalAngleCritic.threshold_to_consider
    PreferForwardCritic.threshold_to_consider CostCritic.critical_cost CostCritic.consider_footprint
    CostCritic.collision_cost CostCritic.near_goal_distance CostCritic.trajectory_point_step
    PathAlignCritic.max_path_occupancy_ratio PathAlignCritic.trajectory_point_step
    PathAlignCritic.threshold_to_consider PathAlignCritic.offset_from_furthest
    PathAlignCritic.use_path_orientations PathFollowCritic.offset_from_furthest
    PathFollowCritic.threshold_to_consider PathAngleCritic.offset_from_furthest
    PathAngleCritic.threshold_to_consider PathAngleCritic.max_angle_to_furthest PathAngleCritic.mode"""
COSTMAP = """update_frequency publish_frequency global_frame robot_base_frame rolling_window width height resolution
    robot_radius plugins inflation_layer.plugin inflation_layer.cost_scaling_factor inflation_layer.inflation_radius
    static_layer.map_subscribe_transient_local always_send_full_costmap track_unknown_space"""
VOXEL = "plugin enabled publish_voxel_map origin_z z_resolution z_voxels max_obstacle_height mark_threshold"
OBSTACLE = "plugin enabled"
SCAN = "topic max_obstacle_height clearing marking data_type"
RANGES = "raytrace_max_range raytrace_min_range obstacle_max_range obstacle_min_range"
PLANNER = "planner_server/expected_planner_frequency planner_plugins"
NAVFN = "plugin tolerance use_astar allow_unknown"
SAVER = "map_saver/save_map_timeout free_thresh_default occupied_thresh_default map_subscribe_transient_local"
BEHAVIOR = """cycle_frequency simulate_ahead_time max_rotational_vel min_rotational_vel rotational_acc_lim global_frame
    robot_base_frame spin.plugin wait.plugin"""
SMOOTHER = """velocity_smoother/smoothing_frequency scale_velocities feedback max_velocity min_velocity max_accel
    max_decel odom_topic odom_duration deadband_velocity velocity_timeout"""
WAYPOINTS = """waypoint_follower/loop_rate stop_on_failure waypoint_task_executor_plugin wait_at_waypoint.plugin
    wait_at_waypoint.enabled wait_at_waypoint.waypoint_pause_duration"""
MONITOR = """collision_monitor/base_frame_id odom_frame_id cmd_vel_in_topic cmd_vel_out_topic state_topic
    transform_tolerance source_timeout base_shift_correction stop_pub_timeout polygons observation_sources
    FootprintApproach.type FootprintApproach.action_type FootprintApproach.footprint_topic
    FootprintApproach.time_before_collision FootprintApproach.simulation_time_step FootprintApproach.min_points
    FootprintApproach.visualize FootprintApproach.enabled scan.type scan.topic scan.min_height scan.max_height
    scan.enabled"""
DOCKING = """docking_server/controller_frequency initial_perception_timeout wait_charge_timeout dock_approach_timeout
    undock_linear_tolerance undock_angular_tolerance max_retries base_frame fixed_frame dock_backwards
    dock_prestaging_tolerance dock_plugins simple_charging_dock.plugin simple_charging_dock.docking_threshold
    simple_charging_dock.staging_x_offset simple_charging_dock.use_external_detection_pose
    simple_charging_dock.use_battery_status simple_charging_dock.use_stall_detection
    simple_charging_dock.external_detection_timeout simple_charging_dock.external_detection_translation_x
    simple_charging_dock.external_detection_rotation_roll simple_charging_dock.filter_coef controller.k_phi
    controller.k_delta controller.v_linear_min controller.v_linear_max"""
LOOPBACK = """loopback_simulator/base_frame_id odom_frame_id map_frame_id scan_frame_id update_duration scan_range_min
    scan_range_max scan_angle_min scan_angle_max scan_angle_increment scan_use_inf"""
GROOT = "bt_navigator/enable_groot_monitoring groot_zmq_publisher_port groot_zmq_server_port plugin_lib_names"
ROUTE = """route_server/boundary_radius_to_achieve_node radius_to_achieve_node smooth_corners operations
    ReroutingService.plugin AdjustSpeedLimit.plugin CollisionMonitor.plugin CollisionMonitor.max_collision_dist
    edge_cost_functions DistanceScorer.plugin CostmapScorer.plugin"""
HYBRID = """plugin downsample_costmap downsampling_factor tolerance allow_unknown max_iterations
    max_on_approach_iterations max_planning_time motion_model_for_search angle_quantization_bins
    analytic_expansion_ratio analytic_expansion_max_length analytic_expansion_max_cost
    analytic_expansion_max_cost_override minimum_turning_radius reverse_penalty change_penalty non_straight_penalty
    cost_penalty retrospective_penalty lookup_table_size cache_obstacle_heuristic debug_visualizations
    use_quadratic_cost_penalty downsample_obstacle_heuristic allow_primitive_interpolation coarse_search_resolution
    goal_heading_mode smooth_path smoother.max_iterations smoother.w_smooth smoother.w_data smoother.tolerance
    smoother.do_refinement smoother.refinement_num"""
MASKS = (
    "keepout_filter_mask_server/topic_name",
    "keepout_costmap_filter_info_server/type filter_info_topic mask_topic base multiplier",
)


def below(prefix, names):
    """The names within a sub-namespace."""
    return " ".join(f"{prefix}.{name}" for name in names.split())


def costmaps(layers):
    return tuple(f"{node}/{COSTMAP} {layers}" for node in ("local_costmap", "global_costmap"))


FOXY = (
    *(AMCL, BT, GROOT, "bt_navigator/default_bt_xml_filename", "amcl_map_client/use_sim_time"),
    *("amcl_rclcpp_node/use_sim_time", "bt_navigator_rclcpp_node/use_sim_time"),
    f"{SERVER} progress_checker_plugin goal_checker_plugin {below('goal_checker', GOAL)} {below('FollowPath', DWB)}",
    *costmaps(
        f"{below('voxel_layer', VOXEL)} voxel_layer.observation_sources {below('voxel_layer.scan', SCAN)}"
    ),
    *(
        "map_server/yaml_filename",
        SAVER,
        f"{PLANNER} {below('GridBased', NAVFN)}",
        "planner_server_rclcpp_node/use_sim_time",
    ),
    f"recoveries_server/costmap_topic footprint_topic recovery_plugins back_up.plugin transform_timeout {BEHAVIOR}",
    "robot_state_publisher/use_sim_time",
)
_SCANS = (
    f"{below('voxel_layer', VOXEL)} voxel_layer.observation_sources {below('voxel_layer.scan', SCAN)} "
    f"{below('voxel_layer.scan', RANGES)} {below('obstacle_layer', OBSTACLE)} obstacle_layer.observation_sources "
    f"{below('obstacle_layer.scan', SCAN)} {below('obstacle_layer.scan', RANGES)} static_layer.plugin"
)
_SIMPLE = below("simple_smoother", "plugin tolerance max_its do_refinement")
HUMBLE = (
    *(
        AMCL,
        f"{BT} bt_loop_duration default_server_timeout wait_for_service_timeout plugin_lib_names",
    ),
    *(
        f"bt_navigator_navigate_{how}_rclcpp_node/use_sim_time"
        for how in ("to_pose", "through_poses")
    ),
    f"{SERVER} failure_tolerance progress_checker_plugin goal_checker_plugins {below('general_goal_checker', GOAL)} "
    f"{below('FollowPath', DWB)}",
    *costmaps(_SCANS),
    *("map_server/yaml_filename", SAVER, f"{PLANNER} {below('GridBased', NAVFN)}"),
    f"smoother_server/smoother_plugins {_SIMPLE}",
    f"behavior_server/costmap_topic footprint_topic behavior_plugins backup.plugin drive_on_heading.plugin "
    f"assisted_teleop.plugin transform_tolerance {BEHAVIOR}",
    *("robot_state_publisher/use_sim_time", WAYPOINTS, SMOOTHER),
)
_NAVIGATORS = (
    "navigators navigate_to_pose.plugin navigate_through_poses.plugin navigate_to_pose.enable_groot_monitoring "
    "navigate_to_pose.groot_server_port action_server_result_timeout"
)
_TOPICS = "local_costmap_topic global_costmap_topic local_footprint_topic global_footprint_topic local_frame"
JAZZY = (
    *(
        AMCL,
        f"{BT} bt_loop_duration default_server_timeout wait_for_service_timeout {_NAVIGATORS} error_code_names",
    ),
    f"{SERVER} failure_tolerance costmap_update_timeout progress_checker_plugins goal_checker_plugins "
    f"use_realtime_priority {below('general_goal_checker', GOAL)} {below('FollowPath', MPPI)}",
    *costmaps(_SCANS),
    *(
        "map_server/yaml_filename",
        SAVER,
        f"{PLANNER} costmap_update_timeout {below('GridBased', NAVFN)}",
    ),
    f"smoother_server/smoother_plugins {_SIMPLE}",
    f"behavior_server/{_TOPICS} behavior_plugins backup.plugin drive_on_heading.plugin assisted_teleop.plugin "
    f"transform_tolerance {BEHAVIOR}",
    *(WAYPOINTS, SMOOTHER, MONITOR, DOCKING, LOOPBACK),
    "velocity_smoother/use_realtime_priority enable_stamped_cmd_vel",
)
_FILTERS = (
    "filters keepout_filter.plugin keepout_filter.enabled keepout_filter.filter_info_topic "
    "keepout_filter.override_lethal_cost keepout_filter.lethal_override_cost introspection_mode"
)
_DRIVING = below("backup", "acceleration_limit deceleration_limit minimum_speed")
ROLLING = (
    *(
        f"{AMCL} introspection_mode",
        f"{BT} {_NAVIGATORS} filter_duration bt_search_directories error_code_name_prefixes",
    ),
    f"{SERVER} failure_tolerance costmap_update_timeout progress_checker_plugins goal_checker_plugins "
    f"speed_limit_topic {below('general_goal_checker', GOAL)} {below('FollowPath', MPPI)} "
    "FollowPath.publish_optimal_trajectory FollowPath.TrajectoryValidator.plugin "
    "FollowPath.TrajectoryValidator.collision_lookahead_time FollowPath.TrajectoryValidator.consider_footprint "
    "FollowPath.CostCritic.near_collision_cost",
    *costmaps(f"{_SCANS} {_FILTERS}"),
    *("map_server/introspection_mode", f"{SAVER} introspection_mode", *MASKS),
    f"{PLANNER} {below('GridBased', HYBRID)}",
    f"smoother_server/smoother_plugins {_SIMPLE} simple_smoother.refinement_num simple_smoother.enforce_path_inversion",
    f"behavior_server/{_TOPICS} behavior_plugins backup.plugin drive_on_heading.plugin assisted_teleop.plugin "
    f"{_DRIVING} transform_tolerance {BEHAVIOR}",
    *(WAYPOINTS, SMOOTHER, f"{MONITOR} enabled", f"{DOCKING} introspection_mode", LOOPBACK, ROUTE),
    "docking_server/simple_charging_dock.dock_direction controller.use_collision_detection controller.costmap_topic "
    "controller.footprint_topic controller.transform_tolerance controller.projection_time controller.simulation_step "
    "controller.dock_collision_threshold",
)
# Lists that name sections, and the types of these sections; all other values are of no interest
# here.
LISTS = {
    "controller_plugins": ["FollowPath"],
    "planner_plugins": ["GridBased"],
    "smoother_plugins": ["simple_smoother"],
    "progress_checker_plugins": ["progress_checker"],
    "plugins": ["static_layer", "obstacle_layer", "voxel_layer", "inflation_layer"],
    "filters": ["keepout_filter"],
    "polygons": ["FootprintApproach"],
    "observation_sources": ["scan"],
    "dock_plugins": ["simple_charging_dock"],
    "navigators": ["navigate_to_pose", "navigate_through_poses"],
    "operations": ["ReroutingService", "AdjustSpeedLimit", "CollisionMonitor"],
    "edge_cost_functions": ["DistanceScorer", "CostmapScorer"],
}
TYPES = {
    "progress_checker": "nav2_controller::SimpleProgressChecker",
    "goal_checker": "nav2_controller::SimpleGoalChecker",
    "general_goal_checker": "nav2_controller::SimpleGoalChecker",
    "inflation_layer": "nav2_costmap_2d::InflationLayer",
    "static_layer": "nav2_costmap_2d::StaticLayer",
    "obstacle_layer": "nav2_costmap_2d::ObstacleLayer",
    "voxel_layer": "nav2_costmap_2d::VoxelLayer",
    "keepout_filter": "nav2_costmap_2d::KeepoutFilter",
    "simple_smoother": "nav2_smoother::SimpleSmoother",
    "spin": "nav2_behaviors/Spin",
    "wait": "nav2_behaviors/Wait",
    "backup": "nav2_behaviors/BackUp",
    "back_up": "nav2_recoveries/BackUp",
    "drive_on_heading": "nav2_behaviors/DriveOnHeading",
    "assisted_teleop": "nav2_behaviors/AssistedTeleop",
    "wait_at_waypoint": "nav2_waypoint_follower::WaitAtWaypoint",
    "navigate_to_pose": "nav2_bt_navigator/NavigateToPoseNavigator",
    "navigate_through_poses": "nav2_bt_navigator/NavigateThroughPosesNavigator",
    "simple_charging_dock": "opennav_docking::SimpleChargingDock",
    "ReroutingService": "nav2_route::ReroutingService",
    "AdjustSpeedLimit": "nav2_route::AdjustSpeedLimit",
    "CollisionMonitor": "nav2_route::CollisionMonitor",
    "DistanceScorer": "nav2_route::DistanceScorer",
    "CostmapScorer": "nav2_route::CostmapScorer",
}
DWB_TYPE, MPPI_TYPE = "dwb_core::DWBLocalPlanner", "nav2_mppi_controller::MPPIController"
NAVFN_TYPE, HYBRID_TYPE = "nav2_navfn_planner/NavfnPlanner", "nav2_smac_planner::SmacPlannerHybrid"
UNKNOWN = {
    "unknown-key",
    "misspelt-key",
    "unknown-node",
    "unknown-plugin",
    "missing-plugin",
    "foreign-node",
}


def text_of(release, types):
    """A parameter file with these names."""
    nodes = {}
    for line in release:
        node, _, names = line.partition("/")
        place = nodes.setdefault(node, {})
        for name in names.split():
            section, _, last = name.rpartition(".")
            is_type = last == "plugin" and section in types
            place[name] = types[section] if is_type else LISTS.get(last if not section else "", 1.0)
            if last == "observation_sources":
                place[name] = ["scan"]
    wrapped = {
        node: {node: {"ros__parameters": values}}
        if node.endswith("_costmap")
        else {"ros__parameters": values}
        for node, values in nodes.items()
    }
    return json.dumps(wrapped)


@pytest.mark.parametrize(
    ("release", "controller", "planner"),
    [
        (FOXY, DWB_TYPE, NAVFN_TYPE),
        (HUMBLE, DWB_TYPE, NAVFN_TYPE),
        (JAZZY, MPPI_TYPE, NAVFN_TYPE),
        (ROLLING, MPPI_TYPE, HYBRID_TYPE),
    ],
    ids=["foxy", "humble", "jazzy", "rolling"],
)
def test_the_names_of_a_release_are_known(inspect, release, controller, planner):
    text = text_of(release, TYPES | {"FollowPath": controller, "GridBased": planner})
    assert text.count(":") > 200  # names were written
    nav2 = inspect(text)
    assert not [str(notice) for notice in nav2.notices if notice.id in UNKNOWN]
    misspelt = inspect(
        text.replace('"inflation_layer.inflation_radius"', '"inflation_layer.inflation_radios"')
    )
    assert len([notice for notice in misspelt.notices if notice.id == "misspelt-key"]) == 2
