"""The nodes that appear in a Nav2 parameter file."""

from collections.abc import Mapping

from navstack.params.amcl import AmclParams
from navstack.params.amcl_gps import AmclGpsParams
from navstack.params.filters import FilterInfoServerParams
from navstack.params.gps_ekf import GpsEkfParams
from navstack.params.registry import controllers, costmaps, planners, tasks
from navstack.params.registry.block import OPEN, Block, PluginList, keys, of_fields, parameters, words
from navstack.params.registry.entry import Family
from navstack.params.registry.localizers import OWN_NODE
from navstack.params.safety import VelocitySmootherParams
from navstack.params.tracker import TrackerParams

FAMILIES: Mapping[str, Family] = {
    "controllers": controllers.CONTROLLERS,
    "dwb_critics": controllers.DWB_CRITICS,
    "mppi_critics": controllers.MPPI_CRITICS,
    "planners": planners.PLANNERS,
    "smoothers": planners.SMOOTHERS,
    "layers": costmaps.LAYERS,
    "goal_checkers": tasks.GOAL_CHECKERS,
    "progress_checkers": tasks.PROGRESS_CHECKERS,
    "path_handlers": tasks.PATH_HANDLERS,
    "behaviors": tasks.BEHAVIORS,
    "navigators": tasks.NAVIGATORS,
    "waypoint_tasks": tasks.WAYPOINT_TASKS,
    "docks": tasks.DOCKS,
    "edge_scorers": tasks.EDGE_SCORERS,
    "route_operations": tasks.ROUTE_OPERATIONS,
    "graph_loaders": tasks.GRAPH_LOADERS,
}

# Older packages of plugins that kept their parameters.
RENAMED_PACKAGES = {"nav2_recoveries": "nav2_behaviors"}

# Parameters of every node.
COMMON = Block(
    words(
        """use_sim_time autostart_node bond_heartbeat_period introspection_mode service_introspection_mode
        action_server_result_timeout allow_parameter_qos_overrides start_type_description_service"""
    ),
    groups={"qos_overrides": OPEN, "diagnostic_updater": OPEN},
)

_AMCL = Block(
    parameters(AmclParams)
    | words(
        """always_reset_initial_pose base_frame_id first_map_only freespace_downsampling global_frame_id
        map_topic odom_frame_id save_pose_rate scan_topic set_initial_pose tf_broadcast
        transform_tolerance"""
    ),
    groups={"initial_pose": keys("x y z yaw")},
)

_AMCL_GPS, _GPS_EKF, _TRACKER = map(of_fields, (AmclGpsParams, GpsEkfParams, TrackerParams))  # this program's own

_BT_NAVIGATOR = Block(
    words(
        """default_nav_to_pose_bt_xml default_nav_through_poses_bt_xml always_reload_bt_xml
        plugin_lib_names bt_loop_duration bt_search_directories filter_duration default_server_timeout
        default_cancel_timeout wait_for_service_timeout transform_tolerance global_frame robot_base_frame odom_topic
        goal_blackboard_id path_blackboard_id goals_blackboard_id waypoint_statuses_blackboard_id
        error_code_name_prefixes error_code_names enable_groot_monitoring groot_zmq_publisher_port
        groot_zmq_server_port groot_server_port bt_log_idle_transitions log_idle_transitions"""
    ),
    plugins={
        "navigators": PluginList(
            "navigators",
            {
                "navigate_to_pose": "nav2_bt_navigator::NavigateToPoseNavigator",
                "navigate_through_poses": "nav2_bt_navigator::NavigateThroughPosesNavigator",
            },
        )
    },
    renamed={"default_bt_xml_filename": "default_nav_to_pose_bt_xml"},
)

_CONTROLLER_SERVER = Block(
    words(
        """controller_frequency min_x_velocity_threshold min_y_velocity_threshold min_theta_velocity_threshold
        failure_tolerance speed_limit_topic odom_topic odom_duration publish_zero_velocity costmap_update_timeout
        use_realtime_priority enable_stamped_cmd_vel search_window orient_angle_rad"""
    ),
    plugins={
        "controller_plugins": PluginList("controllers", {"FollowPath": "dwb_core::DWBLocalPlanner"}),
        "goal_checker_plugins": PluginList("goal_checkers", {"goal_checker": "nav2_controller::SimpleGoalChecker"}),
        "progress_checker_plugins": PluginList(
            "progress_checkers", {"progress_checker": "nav2_controller::SimpleProgressChecker"}
        ),
        "path_handler_plugins": PluginList("path_handlers", {"PathHandler": "nav2_controller::FeasiblePathHandler"}),
    },
    renamed={
        "goal_checker_plugin": "goal_checker_plugins",
        "progress_checker_plugin": "progress_checker_plugins",
    },
)

_BEHAVIOR_SERVER = Block(
    words(
        """costmap_topic footprint_topic local_costmap_topic global_costmap_topic local_footprint_topic
        global_footprint_topic cycle_frequency transform_tolerance transform_timeout local_frame global_frame
        robot_base_frame simulate_ahead_time max_rotational_vel min_rotational_vel rotational_acc_lim projection_time
        simulation_time_step cmd_vel_teleop enable_stamped_cmd_vel"""
    ),
    plugins={
        "behavior_plugins": PluginList(
            "behaviors",
            {
                "spin": "nav2_behaviors::Spin",
                "backup": "nav2_behaviors::BackUp",
                "drive_on_heading": "nav2_behaviors::DriveOnHeading",
                "wait": "nav2_behaviors::Wait",
            },
        )
    },
    renamed={"recovery_plugins": "behavior_plugins"},
)

_VELOCITY_POLYGON = keys(
    """points linear_min linear_max theta_min theta_max direction_start_angle direction_end_angle slowdown_ratio
    linear_limit angular_limit time_before_collision simulation_time_step steering_angle_min steering_angle_max"""
)
_POLYGON = Block(
    words(
        """type points polygon_sub_topic polygon_subscribe_transient_local footprint_topic radius action_type
        min_points max_points slowdown_ratio linear_limit angular_limit time_before_collision simulation_time_step
        visualize polygon_pub_topic enabled holonomic sources_names use_steering_angle wheelbase
        low_speed_threshold limit_keeps_curvature"""  # the last is this program's own
    ),
    named={"velocity_polygons": _VELOCITY_POLYGON},
)
_COLLISION_SOURCE = keys(
    """type topic min_height max_height min_range obstacles_angle sampling_distance enabled source_timeout
    use_global_height transport_type"""
)
_COLLISION_MONITOR = Block(
    words(
        """base_frame_id odom_frame_id cmd_vel_in_topic cmd_vel_out_topic state_topic transform_tolerance
        source_timeout base_shift_correction stop_pub_timeout use_realtime_priority enable_stamped_cmd_vel
        toggle_cm_service_name collision_points_marker_topic enabled collision_points_marker_3d"""
    ),
    named={"polygons": _POLYGON, "observation_sources": _COLLISION_SOURCE},
)
_COLLISION_DETECTOR = Block(
    words("frequency base_frame_id odom_frame_id state_topic transform_tolerance source_timeout base_shift_correction"),
    named={"polygons": _POLYGON, "observation_sources": _COLLISION_SOURCE},
)

_DOCKING_SERVER = Block(
    words(
        """controller_frequency initial_perception_timeout wait_charge_timeout dock_approach_timeout
        rotate_to_dock_timeout undock_linear_tolerance undock_angular_tolerance max_retries base_frame fixed_frame
        dock_backwards dock_prestaging_tolerance dock_database navigator_bt_xml odom_topic odom_duration
        enable_stamped_cmd_vel rotation_angular_tolerance backward_blind"""
    ),
    groups={
        "controller": keys(
            """k_phi k_delta beta lambda v_linear_min v_linear_max v_angular_max slowdown_radius
            use_collision_detection costmap_topic footprint_topic transform_tolerance projection_time
            simulation_time_step dock_collision_threshold rotate_to_heading_angular_vel
            rotate_to_heading_max_angular_accel deceleration_max simulation_step"""
        )  # simulation_step is declared nowhere, but Nav2's own files set it
    },
    plugins={"dock_plugins": PluginList("docks")},
    named={"docks": tasks.DOCK_INSTANCE},
)

_ROUTE_SERVER = Block(
    words(
        """base_frame route_frame global_frame path_density max_iterations max_planning_time smooth_corners
        smoothing_corners smoothing_radius costmap_topic tracker_update_rate aggregate_blocked_ids
        boundary_radius_to_achieve_node radius_to_achieve_node max_prune_dist_from_edge min_prune_dist_from_goal
        min_prune_dist_from_start prune_goal enable_nn_search max_nn_search_iterations num_nearest_nodes
        graph_filepath use_feedback_operations"""
    ),
    plugins={
        "graph_file_loader": PluginList(
            "graph_loaders", {"GeoJsonGraphFileLoader": "nav2_route::GeoJsonGraphFileLoader"}
        ),
        "edge_cost_functions": PluginList(
            "edge_scorers",
            {"DistanceScorer": "nav2_route::DistanceScorer", "DynamicEdgesScorer": "nav2_route::DynamicEdgesScorer"},
        ),
        "operations": PluginList(
            "route_operations",
            {"AdjustSpeedLimit": "nav2_route::AdjustSpeedLimit", "ReroutingService": "nav2_route::ReroutingService"},
        ),
    },
)

_MAP_SERVER = keys("yaml_filename topic_name frame_id")

NODES = {
    "amcl": _AMCL,
    "amcl_gps": _AMCL_GPS,
    "gps_ekf": _GPS_EKF,
    "tracker": _TRACKER,
    OWN_NODE: OPEN,  # its keys are those of a localizer of another package
    "bt_navigator": _BT_NAVIGATOR,
    "controller_server": _CONTROLLER_SERVER,
    "local_costmap": costmaps.COSTMAP,
    "global_costmap": costmaps.COSTMAP,
    "planner_server": Block(
        words("expected_planner_frequency costmap_update_timeout allow_partial_planning"),
        plugins={"planner_plugins": PluginList("planners", {"GridBased": "nav2_navfn_planner::NavfnPlanner"})},
    ),
    "smoother_server": Block(
        words("costmap_topic footprint_topic robot_base_frame transform_tolerance"),
        plugins={"smoother_plugins": PluginList("smoothers", {"simple_smoother": "nav2_smoother::SimpleSmoother"})},
    ),
    "behavior_server": _BEHAVIOR_SERVER,
    "velocity_smoother": of_fields(
        VelocitySmootherParams,
        *("odom_topic", "odom_duration", "use_realtime_priority", "enable_stamped_cmd_vel"),
        "stamp_smoothed_velocity_with_smoothing_time",
    ),
    "collision_monitor": _COLLISION_MONITOR,
    "collision_detector": _COLLISION_DETECTOR,
    "waypoint_follower": Block(
        words("loop_rate stop_on_failure global_frame_id"),
        plugins={
            "waypoint_task_executor_plugin": PluginList(
                "waypoint_tasks", {"wait_at_waypoint": "nav2_waypoint_follower::WaitAtWaypoint"}
            )
        },
    ),
    "docking_server": _DOCKING_SERVER,
    "following_server": OPEN,
    "route_server": _ROUTE_SERVER,
    "vector_object_server": OPEN,
    "map_server": _MAP_SERVER,
    "map_saver": keys("save_map_timeout free_thresh_default occupied_thresh_default map_subscribe_transient_local"),
    "costmap_filter_info_server": of_fields(FilterInfoServerParams),
    "filter_mask_server": _MAP_SERVER,
    "lifecycle_manager": keys(
        """node_names autostart bond_timeout bond_respawn_max_duration attempt_respawn_reconnection service_timeout
        parallel_state_transitions"""
    ),
    "loopback_simulator": keys(
        """update_duration base_frame_id odom_frame_id map_frame_id scan_frame_id enable_stamped_cmd_vel
        scan_publish_dur odom_publish_dur publish_map_odom_tf publish_scan publish_clock speed_factor scan_range_min
        scan_range_max scan_angle_min scan_angle_max scan_angle_increment scan_use_inf scan_noise_std"""
    ),
}

# Older and derived node names: (how the name ends or begins, node whose parameters it has).
NODE_ALIASES = {"recoveries_server": "behavior_server"}
NODE_PREFIXES = {"lifecycle_manager_": "lifecycle_manager"}
NODE_SUFFIXES = {
    "_rclcpp_node": "",
    "_client": "",
    "_filter_info_server": "costmap_filter_info_server",
    "_mask_server": "filter_mask_server",
}

# Nodes of other packages that share a file with Nav2.
FOREIGN_NODES = words(
    """robot_state_publisher joint_state_publisher slam_toolbox ekf_filter_node ekf_filter_node_odom
    ekf_filter_node_map ukf_filter_node navsat_transform navsat_transform_node twist_mux rviz2 rviz"""
)
