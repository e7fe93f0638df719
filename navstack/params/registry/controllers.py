"""Controller plugins and their critics."""

from navstack.params import dwb, mppi_critics
from navstack.params.expected_contact import DwbContactParams, MppiContactParams
from navstack.params.expected_cost import ExpectedCostParams
from navstack.params.graceful import GracefulParams
from navstack.params.mpc import MpcParams
from navstack.params.mppi import MppiParams
from navstack.params.registry.block import OPEN, Block, PluginList, keys, of_fields, parameters, words
from navstack.params.registry.entry import Entry, Family, Params
from navstack.params.rotation_shim import RotationShimParams
from navstack.params.rpp import RppParams

_CONTACT = ("navstack.control.contact_risk", "navstack.perception.scan_clusters")


def _dwb_critic(make: str, params: Params, *unread: str, kernels: tuple[str, ...] = ()) -> Entry:
    """A critic of DWB; ``unread``: parameters of Nav2's that its dataclass does not have."""
    keys = of_fields(params, "class", *unread)
    return Entry(keys, f"navstack.control.dwb.critics.{make}", needs=("dwb",), kernels=kernels)


DWB_CRITICS: Family = {
    "BaseObstacle": _dwb_critic("base_obstacle:BaseObstacleCritic", dwb.ObstacleParams),
    "ObstacleFootprint": _dwb_critic(
        "obstacle_footprint:ObstacleFootprintCritic", dwb.ObstacleParams, "max_scaling_factor", "scaling_speed"
    ),
    "PathDist": _dwb_critic("dist:PathDistCritic", dwb.DistParams),
    "GoalDist": _dwb_critic("dist:GoalDistCritic", dwb.DistParams),
    "PathAlign": _dwb_critic("align:PathAlignCritic", dwb.AlignParams),
    "GoalAlign": _dwb_critic("align:GoalAlignCritic", dwb.AlignParams),
    "RotateToGoal": _dwb_critic(
        "rotate_to_goal:RotateToGoalCritic",
        dwb.RotateToGoalParams,
        *("xy_goal_tolerance", "path_length_tolerance", "trans_stopped_velocity"),
    ),
    "Oscillation": _dwb_critic("oscillation:OscillationCritic", dwb.OscillationParams),
    "PreferForward": _dwb_critic("prefer_forward:PreferForwardCritic", dwb.PreferForwardParams),
    "Twirling": _dwb_critic("twirling:TwirlingCritic", dwb.TwirlingParams),
    "ExpectedContact": _dwb_critic("expected_contact:ExpectedContactCritic", DwbContactParams, kernels=_CONTACT),
}

# What critics look for in their controller's namespace where their own leaves it out, and what is published only.
_DWB = Block(
    parameters(dwb.DwbParams)
    | words(
        """plugin goal_checker_name transform_tolerance max_scaling_factor scaling_speed use_dwa yaw_goal_tolerance
        rot_stopped_velocity stateful forward_point_distance slowing_factor lookahead_time oscillation_reset_dist
        oscillation_reset_angle oscillation_reset_time x_only_threshold penalty strafe_x strafe_theta theta_scale
        publish_evaluation publish_global_plan publish_transformed_plan publish_local_plan publish_trajectories
        publish_cost_grid_pc publish_cost_grid marker_lifetime"""
    ),
    plugins={"critics": PluginList("dwb_critics", selector="class", name_is_type=True)},
)

_SHIM = Block(
    parameters(RotationShimParams) | words("plugin transform_tolerance"),
    delegates={"primary_controller": "controllers"},
)

_RPP = Block(
    parameters(RppParams)
    | words(
        """plugin transform_tolerance use_approach_linear_velocity_scaling max_allowed_time_to_collision
        use_interpolation use_cancel_deceleration cancel_deceleration use_path_aware_obstacle_distance
        goal_dist_tol"""
    ),
    newer={"max_linear_vel": "desired_linear_vel"},
)

_GRACEFUL = Block(
    parameters(GracefulParams)
    | words(
        """plugin transform_tolerance initial_rotation_threshold final_rotation in_place_collision_tolerance
        footprint_scaling_factor footprint_scaling_linear_vel footprint_scaling_step obstacle_cost_margin
        final_rotation_search_step"""
    ),
    renamed={"motion_target_dist": "max_lookahead", "initial_rotation_min_angle": "initial_rotation_tolerance"},
)


def _mppi_critic(
    make: str, params: Params, *unread: str, needs: tuple[str, ...] = (), kernels: tuple[str, ...] = ()
) -> Entry:
    """A critic of MPPI; ``unread``: parameters of Nav2's that its dataclass does not have."""
    return Entry(of_fields(params, *unread), f"navstack.control.mppi.{make}", needs=needs, kernels=kernels)


MPPI_CRITICS: Family = {
    "ConstraintCritic": _mppi_critic("motion_critics:ConstraintCritic", mppi_critics.ConstraintParams),
    "GoalCritic": _mppi_critic("path_critics:GoalCritic", mppi_critics.GoalParams),
    "GoalAngleCritic": _mppi_critic(
        "path_critics:GoalAngleCritic", mppi_critics.GoalAngleParams, "symmetric_yaw_tolerance"
    ),
    "ObstaclesCritic": _mppi_critic(
        "obstacle_critics:ObstaclesCritic",
        mppi_critics.ObstaclesParams,
        *("cost_scaling_factor", "inflation_radius"),
        needs=("footprint",),
    ),
    "CostCritic": _mppi_critic("obstacle_critics:CostCritic", mppi_critics.CostParams, needs=("footprint",)),
    "PathAlignCritic": _mppi_critic(
        "path_critics:PathAlignCritic", mppi_critics.PathAlignParams, "score_arc_length", "visualize"
    ),
    "PathAlignLegacyCritic": Entry(of_fields(mppi_critics.PathAlignParams)),
    "PathAngleCritic": _mppi_critic("path_critics:PathAngleCritic", mppi_critics.PathAngleParams, "forward_preference"),
    "PathFollowCritic": _mppi_critic("path_critics:PathFollowCritic", mppi_critics.PathFollowParams),
    "PreferForwardCritic": _mppi_critic("motion_critics:PreferForwardCritic", mppi_critics.PreferForwardParams),
    "TwirlingCritic": _mppi_critic(
        "motion_critics:TwirlingCritic",
        mppi_critics.TwirlingParams,
        *("twirling_cost_power", "twirling_cost_weight"),
        needs=("xy_goal_tolerance",),
    ),
    "VelocityDeadbandCritic": _mppi_critic(
        "motion_critics:VelocityDeadbandCritic", mppi_critics.VelocityDeadbandParams
    ),
    "PathHugCritic": Entry(OPEN),
    "ExpectedContactCritic": _mppi_critic(
        "contact_critic:ExpectedContactCritic", MppiContactParams, needs=("footprint",), kernels=_CONTACT
    ),
}

_MOTION_MODEL = keys("plugin min_turning_r")
_MPPI = Block(
    parameters(MppiParams)
    | words(
        """plugin visualize critic_index_to_visualize publish_critics_stats publish_optimal_trajectory open_loop
        transform_tolerance advanced controller_frequency"""
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


def _controller(make: str, params: Params, keys: Block, kernels: str, needs: tuple[str, ...] = _CONTROL) -> Entry:
    """A controller of ``navstack.control``; ``kernels``: modules of ``navstack``, with blanks between."""
    modules = tuple(f"navstack.{module}" for module in kernels.split())
    return Entry(keys, f"navstack.control.{make}", params, needs, modules)


CONTROLLERS: Family = {
    "dwb_core::DWBLocalPlanner": _controller(
        "dwb.dwb_controller:DwbController",
        dwb.DwbParams,
        _DWB,
        "control.dwb.choice_kernels control.plan_handling",
        _CONTROL[:2],
    ),
    "nav2_rotation_shim_controller::RotationShimController": _controller(
        "rotation_shim:RotationShimController",
        RotationShimParams,
        _SHIM,
        "control.footprint_cost",
        ("primary_controller", *_CONTROL),
    ),
    "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController": _controller(
        "rpp.rpp_controller:RegulatedPurePursuitController",
        RppParams,
        _RPP,
        "control.path_window control.rpp.lookahead control.rpp.arc_check",
    ),
    "nav2_mppi_controller::MPPIController": _controller(
        "mppi.mppi_controller:MppiController",
        MppiParams,
        _MPPI,
        """control.mppi.obstacle_kernels control.mppi.path_kernels control.mppi.motion_kernels
        control.mppi.rollouts control.mppi.control_sequence control.mppi.path_handler""",
    ),
    "navstack::JerkLimitedMPC": _controller(
        "mpc.mpc_controller:JerkLimitedMpcController",
        MpcParams,
        of_fields(MpcParams, "plugin"),
        """control.mpc.stages control.mpc.command_guard control.mpc.path_line control.mpc.motion
        perception.scan_clusters""",
    ),
    "navstack::ExpectedCostController": _controller(
        "expected_cost.expected_cost_controller:ExpectedCostController",
        ExpectedCostParams,
        of_fields(ExpectedCostParams, "plugin"),
        """control.expected_cost.motion_cost control.expected_cost.people control.expected_cost.clearance
        control.expected_cost.field perception.scan_clusters""",
        (*_CONTROL, "global_costmap", "cost_to_go", "prices"),
    ),
    "nav2_graceful_controller::GracefulController": _controller(
        "graceful.graceful_controller:GracefulController",
        GracefulParams,
        _GRACEFUL,
        "control.path_window control.graceful.control_law",
    ),
}
