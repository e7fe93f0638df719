"""Kinds of the parameters that this program does not read, by name: each name means the same wherever Nav2 has it."""

from navstack.params.registry.block import words

SWITCHES = words(
    """use_sim_time do_beamskip set_initial_pose tf_broadcast first_map_only always_reset_initial_pose
    always_send_full_costmap track_unknown_space map_subscribe_transient_local subscribe_to_updates publish_voxel_map
    allow_partial_planning use_realtime_priority enable_stamped_cmd_vel enable_groot_monitoring stop_on_failure
    publish_zero_velocity debug_trajectory_details always_reload_bt_xml use_astar allow_unknown visualize
    use_battery_status use_stall_detection use_external_detection_pose dock_backwards autostart"""
)
DECIMALS = words(
    """alpha1 alpha2 alpha3 alpha4 alpha5 beam_skip_distance beam_skip_error_threshold beam_skip_threshold lambda_short
    laser_likelihood_max_dist laser_max_range laser_min_range pf_err pf_z recovery_alpha_fast recovery_alpha_slow
    save_pose_rate sigma_hit transform_tolerance update_min_a update_min_d z_hit z_max z_rand z_short filter_duration
    costmap_update_timeout odom_duration publish_frequency map_vis_z initial_transform_timeout origin_z z_resolution
    min_obstacle_height max_obstacle_height expected_update_rate tf_filter_tolerance expected_planner_frequency
    projection_time simulation_time_step free_thresh_default occupied_thresh_default stop_pub_timeout
    min_height max_height max_planning_time minimum_turning_radius reverse_penalty change_penalty non_straight_penalty
    cost_penalty model_dt vx_std vy_std wz_std vx_max vx_min vy_max wz_max temperature gamma cost_weight
    wait_charge_timeout dock_approach_timeout"""
)
WHOLE_NUMBERS = words(
    """max_beams max_particles min_particles resample_interval bt_loop_duration default_server_timeout
    wait_for_service_timeout unknown_cost_value z_voxels unknown_threshold mark_threshold loop_rate
    waypoint_pause_duration max_iterations angle_quantization_bins time_steps batch_size iteration_count cost_power
    max_retries"""
)
NUMBERS = DECIMALS | WHOLE_NUMBERS | words("save_map_timeout transform_timeout")  # of these two both forms are in use


def wrong_kind(name: str, value: object) -> str:
    """What a value should be and is not; empty if it is, or if nothing is known about its name."""
    if name in SWITCHES:
        return "" if isinstance(value, bool) else "true or false"
    if name in NUMBERS:
        return "" if isinstance(value, int | float) and not isinstance(value, bool) else "a number"
    return ""
