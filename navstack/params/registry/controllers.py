"""Controller plugins and their critics."""

from navstack.params.dwb import DwbParams
from navstack.params.expected_contact import DwbContactParams, MppiContactParams
from navstack.params.expected_cost import ExpectedCostParams
from navstack.params.graceful import GracefulParams
from navstack.params.mpc import MpcParams
from navstack.params.mppi import MppiParams
from navstack.params.registry.block import OPEN, Block, PluginList, keys, of_fields, words
from navstack.params.registry.entry import Entry, Family
from navstack.params.rotation_shim import RotationShimParams
from navstack.params.rpp import RppParams

_MAP_GRID = "class scale aggregation_type"
_ALIGN = _MAP_GRID + " forward_point_distance"

_CONTACT = ("navstack.control.contact_risk", "navstack.perception.scan_clusters")
DWB_CRITICS: Family = {
    "BaseObstacle": Entry(
        keys("class scale sum_scores"), "navstack.control.dwb.critics.base_obstacle:BaseObstacleCritic", needs=("dwb",)
    ),
    "ObstacleFootprint": Entry(
        keys("class scale sum_scores max_scaling_factor scaling_speed"),
        "navstack.control.dwb.critics.obstacle_footprint:ObstacleFootprintCritic",
        needs=("dwb",),
    ),
    "PathDist": Entry(keys(_MAP_GRID), "navstack.control.dwb.critics.dist:PathDistCritic", needs=("dwb",)),
    "GoalDist": Entry(keys(_MAP_GRID), "navstack.control.dwb.critics.dist:GoalDistCritic", needs=("dwb",)),
    "PathAlign": Entry(
        keys(_ALIGN),
        "navstack.control.dwb.critics.align:PathAlignCritic",
        needs=("dwb",),
    ),
    "GoalAlign": Entry(
        keys(_ALIGN),
        "navstack.control.dwb.critics.align:GoalAlignCritic",
        needs=("dwb",),
    ),
    "RotateToGoal": Entry(
        keys(
            "class scale slowing_factor lookahead_time xy_goal_tolerance path_length_tolerance trans_stopped_velocity"
        ),
        "navstack.control.dwb.critics.rotate_to_goal:RotateToGoalCritic",
        needs=("dwb",),
    ),
    "Oscillation": Entry(
        keys("class scale oscillation_reset_dist oscillation_reset_angle oscillation_reset_time x_only_threshold"),
        "navstack.control.dwb.critics.oscillation:OscillationCritic",
        needs=("dwb",),
    ),
    "PreferForward": Entry(
        keys("class scale penalty strafe_x strafe_theta theta_scale"),
        "navstack.control.dwb.critics.prefer_forward:PreferForwardCritic",
        needs=("dwb",),
    ),
    "Twirling": Entry(keys("class scale"), "navstack.control.dwb.critics.twirling:TwirlingCritic", needs=("dwb",)),
    "ExpectedContact": Entry(
        of_fields(DwbContactParams, "class"),
        "navstack.control.dwb.critics.expected_contact:ExpectedContactCritic",
        needs=("dwb",),
        kernels=_CONTACT,
    ),
}

_DWB_KINEMATICS = words(
    """min_vel_x min_vel_y max_vel_x max_vel_y max_vel_theta min_speed_xy max_speed_xy min_speed_theta
    acc_lim_x acc_lim_y acc_lim_theta decel_lim_x decel_lim_y decel_lim_theta"""
)
_DWB = Block(
    words(
        """plugin default_critic_namespaces prune_plan prune_distance forward_prune_distance shorten_transformed_plan
        debug_trajectory_details trajectory_generator_name goal_checker_name transform_tolerance
        short_circuit_trajectory_evaluation path_distance_bias goal_distance_bias occdist_scale max_scaling_factor
        scaling_speed vx_samples vy_samples vtheta_samples sim_time discretize_by_time time_granularity
        linear_granularity angular_granularity include_last_point sim_period use_dwa
        xy_goal_tolerance yaw_goal_tolerance trans_stopped_velocity rot_stopped_velocity stateful
        path_length_tolerance limit_vel_cmd_in_traj
        forward_point_distance slowing_factor lookahead_time oscillation_reset_dist oscillation_reset_angle
        oscillation_reset_time x_only_threshold penalty strafe_x strafe_theta theta_scale
        publish_evaluation publish_global_plan publish_transformed_plan publish_local_plan publish_trajectories
        publish_cost_grid_pc publish_cost_grid marker_lifetime"""
    )
    | _DWB_KINEMATICS,
    plugins={"critics": PluginList("dwb_critics", selector="class", name_is_type=True)},
)

_SHIM = Block(
    words(
        """plugin angular_dist_threshold angular_disengage_threshold forward_sampling_distance
        rotate_to_heading_angular_vel max_angular_accel simulate_ahead_time rotate_to_goal_heading
        rotate_to_heading_once closed_loop use_path_orientations transform_tolerance"""
    ),
    delegates={"primary_controller": "controllers"},
)

_RPP = Block(
    words(
        """plugin desired_linear_vel min_linear_vel max_angular_vel min_angular_vel
        lookahead_dist min_lookahead_dist max_lookahead_dist lookahead_time
        rotate_to_heading_angular_vel transform_tolerance use_velocity_scaled_lookahead_dist
        min_approach_linear_velocity approach_velocity_scaling_dist use_approach_linear_velocity_scaling
        use_collision_detection max_allowed_time_to_collision max_allowed_time_to_collision_up_to_carrot
        min_distance_to_obstacle use_regulated_linear_velocity_scaling use_cost_regulated_linear_velocity_scaling
        cost_scaling_dist cost_scaling_gain inflation_cost_scaling_factor regulated_linear_scaling_min_radius
        regulated_linear_scaling_min_speed use_fixed_curvature_lookahead curvature_lookahead_dist
        use_rotate_to_heading rotate_to_heading_min_angle allow_reversing max_linear_accel max_linear_decel
        max_angular_accel max_robot_pose_search_dist use_interpolation interpolate_curvature_after_goal
        use_cancel_deceleration cancel_deceleration stateful use_dynamic_window velocity_feedback
        use_path_aware_obstacle_distance goal_dist_tol max_angular_decel
        lookahead_along_path"""  # the last is this program's own
    ),
    newer={"max_linear_vel": "desired_linear_vel"},
)

_GRACEFUL = Block(
    words(
        """plugin transform_tolerance min_lookahead max_lookahead max_robot_pose_search_dist
        k_phi k_delta beta lambda v_linear_min v_linear_max v_angular_max v_angular_min_in_place slowdown_radius
        initial_rotation initial_rotation_tolerance initial_rotation_threshold final_rotation
        prefer_final_rotation rotation_scaling_factor allow_backward in_place_collision_resolution
        in_place_collision_tolerance use_collision_detection footprint_scaling_factor footprint_scaling_linear_vel
        footprint_scaling_step obstacle_cost_margin final_rotation_search_step"""
    ),
    renamed={"motion_target_dist": "max_lookahead", "initial_rotation_min_angle": "initial_rotation_tolerance"},
)

_COST = "enabled cost_weight cost_power"
MPPI_CRITICS: Family = {
    "ConstraintCritic": Entry(keys(_COST), "navstack.control.mppi.motion_critics:ConstraintCritic"),
    "GoalCritic": Entry(keys(_COST + " threshold_to_consider"), "navstack.control.mppi.path_critics:GoalCritic"),
    "GoalAngleCritic": Entry(
        keys(_COST + " threshold_to_consider symmetric_yaw_tolerance"),
        "navstack.control.mppi.path_critics:GoalAngleCritic",
    ),
    "ObstaclesCritic": Entry(
        keys(
            """enabled cost_power critical_weight repulsion_weight consider_footprint collision_cost
        collision_margin_distance near_goal_distance cost_scaling_factor inflation_radius inflation_layer_name"""
        ),
        "navstack.control.mppi.obstacle_critics:ObstaclesCritic",
        needs=("footprint",),
    ),
    "CostCritic": Entry(
        keys(
            _COST
            + """ critical_cost near_collision_cost consider_footprint collision_cost near_goal_distance
        inflation_layer_name trajectory_point_step"""
        ),
        "navstack.control.mppi.obstacle_critics:CostCritic",
        needs=("footprint",),
    ),
    "PathAlignCritic": Entry(
        keys(
            _COST
            + """ threshold_to_consider offset_from_furthest max_path_occupancy_ratio use_path_orientations
        trajectory_point_step score_arc_length visualize"""
        ),
        "navstack.control.mppi.path_critics:PathAlignCritic",
    ),
    "PathAlignLegacyCritic": Entry(
        keys(
            _COST
            + """ threshold_to_consider offset_from_furthest max_path_occupancy_ratio use_path_orientations
        trajectory_point_step"""
        )
    ),
    "PathAngleCritic": Entry(
        keys(_COST + " threshold_to_consider offset_from_furthest max_angle_to_furthest mode forward_preference"),
        "navstack.control.mppi.path_critics:PathAngleCritic",
    ),
    "PathFollowCritic": Entry(
        keys(_COST + " threshold_to_consider offset_from_furthest"),
        "navstack.control.mppi.path_critics:PathFollowCritic",
    ),
    "PreferForwardCritic": Entry(
        keys(_COST + " threshold_to_consider"), "navstack.control.mppi.motion_critics:PreferForwardCritic"
    ),
    "TwirlingCritic": Entry(
        keys(_COST + " twirling_cost_power twirling_cost_weight"),
        "navstack.control.mppi.motion_critics:TwirlingCritic",
        needs=("xy_goal_tolerance",),
    ),
    "VelocityDeadbandCritic": Entry(
        keys(_COST + " deadband_velocities"), "navstack.control.mppi.motion_critics:VelocityDeadbandCritic"
    ),
    "PathHugCritic": Entry(OPEN),
    "ExpectedContactCritic": Entry(
        of_fields(MppiContactParams),
        "navstack.control.mppi.contact_critic:ExpectedContactCritic",
        needs=("footprint",),
        kernels=_CONTACT,
    ),
}

_MOTION_MODEL = keys("plugin min_turning_r")
_MPPI = Block(
    words(
        """plugin motion_model iteration_count batch_size time_steps model_dt vx_std vy_std wz_std vx_max vx_min
        vy_max wz_max ax_max ax_min ay_max ay_min az_max temperature gamma visualize critic_index_to_visualize
        publish_critics_stats publish_optimal_trajectory retry_attempt_limit reset_period regenerate_noises open_loop
        transform_tolerance prune_distance max_robot_pose_search_dist enforce_path_inversion
        inversion_xy_tolerance inversion_yaw_tolerance advanced controller_frequency"""
    ),
    groups={
        "TrajectoryVisualizer": keys("trajectory_step time_step"),
        "TrajectoryValidator": keys("plugin collision_lookahead_time consider_footprint"),
        "AckermannConstraints": keys("min_turning_r"),
        "AckermannMotionModel": keys("min_turning_r"),
        "diff_drive": _MOTION_MODEL,
        "omni": _MOTION_MODEL,
        "ackermann": _MOTION_MODEL,
        "advanced": OPEN,
    },
    plugins={"critics": PluginList("mppi_critics", selector="class", name_is_type=True)},
)

_CONTROL = ("footprint", "control_frequency", "xy_goal_tolerance")  # padded polygon (V, 2) in [m], [Hz], [m]
CONTROLLERS: Family = {
    "dwb_core::DWBLocalPlanner": Entry(
        _DWB,
        "navstack.control.dwb.dwb_controller:DwbController",
        DwbParams,
        _CONTROL[:2],
        ("navstack.control.dwb.choice_kernels", "navstack.control.plan_handling"),
    ),
    "nav2_rotation_shim_controller::RotationShimController": Entry(
        _SHIM,
        "navstack.control.rotation_shim:RotationShimController",
        RotationShimParams,
        ("primary_controller", *_CONTROL),
        ("navstack.control.footprint_cost",),
    ),
    "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController": Entry(
        _RPP,
        "navstack.control.rpp.rpp_controller:RegulatedPurePursuitController",
        RppParams,
        _CONTROL,
        ("navstack.control.path_window", "navstack.control.rpp.lookahead", "navstack.control.rpp.arc_check"),
    ),
    "nav2_mppi_controller::MPPIController": Entry(
        _MPPI,
        "navstack.control.mppi.mppi_controller:MppiController",
        MppiParams,
        _CONTROL,
        (
            "navstack.control.mppi.obstacle_kernels",
            "navstack.control.mppi.path_kernels",
            "navstack.control.mppi.motion_kernels",
            "navstack.control.mppi.rollouts",
            "navstack.control.mppi.control_sequence",
            "navstack.control.mppi.path_handler",
        ),
    ),
    "navstack::JerkLimitedMPC": Entry(
        of_fields(MpcParams, "plugin"),
        "navstack.control.mpc.mpc_controller:JerkLimitedMpcController",
        MpcParams,
        _CONTROL,
        (
            "navstack.control.mpc.stages",
            "navstack.control.mpc.command_guard",
            "navstack.control.mpc.path_line",
            "navstack.control.mpc.motion",
            "navstack.perception.scan_clusters",
        ),
    ),
    "navstack::ExpectedCostController": Entry(
        of_fields(ExpectedCostParams, "plugin"),
        "navstack.control.expected_cost.expected_cost_controller:ExpectedCostController",
        ExpectedCostParams,
        (*_CONTROL, "global_costmap", "cost_to_go", "prices"),
        (
            "navstack.control.expected_cost.motion_cost",
            "navstack.control.expected_cost.people",
            "navstack.control.expected_cost.clearance",
            "navstack.control.expected_cost.field",
            "navstack.perception.scan_clusters",
        ),
    ),
    "nav2_graceful_controller::GracefulController": Entry(
        _GRACEFUL,
        "navstack.control.graceful.graceful_controller:GracefulController",
        GracefulParams,
        _CONTROL,
        ("navstack.control.path_window", "navstack.control.graceful.control_law"),
    ),
}
