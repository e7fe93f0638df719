"""Planner and path smoother plugins."""

from navstack.params.planners import IncrementalNavfnParams, NavfnParams, OmplParams, ThetaStarParams
from navstack.params.registry.block import OPEN, Block, keys, of_fields, words
from navstack.params.registry.entry import Entry, Family
from navstack.params.smac import Smac2DParams, SmacHybridParams, SmacLatticeParams
from navstack.params.smoothers import SimpleSmootherParams

_SMAC_SMOOTHER = keys("max_iterations w_smooth w_data tolerance do_refinement refinement_num")
_SMAC_COMMON = words(
    """plugin tolerance allow_unknown max_iterations max_on_approach_iterations terminal_checking_interval
    max_planning_time smooth_path debug_visualizations motion_model_for_search"""
)
_SMAC_DOWNSAMPLING = words("downsample_costmap downsampling_factor")
_SMAC_SE2 = words(
    """analytic_expansion_ratio analytic_expansion_max_length analytic_expansion_max_cost
    analytic_expansion_max_cost_override minimum_turning_radius reverse_penalty change_penalty non_straight_penalty
    cost_penalty rotation_penalty retrospective_penalty lookup_table_size cache_obstacle_heuristic
    allow_primitive_interpolation downsample_obstacle_heuristic use_quadratic_cost_penalty allow_reverse_expansion
    goal_heading_mode coarse_search_resolution"""
)


def _smac(*more: frozenset[str]) -> Block:
    return Block(_SMAC_COMMON.union(*more), groups={"smoother": _SMAC_SMOOTHER})


_NAVFN = ("navstack.planning.navfn_kernels", "navstack.planning.navfn_descent")
PLANNERS: Family = {
    "nav2_navfn_planner::NavfnPlanner": Entry(
        keys("plugin tolerance use_astar allow_unknown use_final_approach_orientation"),
        "navstack.planning.navfn:NavfnPlanner",
        NavfnParams,
        kernels=_NAVFN,
    ),
    "nav2_smac_planner::SmacPlanner2D": Entry(
        _smac(_SMAC_DOWNSAMPLING, words("cost_travel_multiplier use_final_approach_orientation")),
        "navstack.planning.smac.smac_2d:Smac2D",
        Smac2DParams,
    ),
    "nav2_smac_planner::SmacPlannerHybrid": Entry(
        _smac(_SMAC_DOWNSAMPLING, _SMAC_SE2, words("angle_quantization_bins")),
        "navstack.planning.smac.pose_planner:SmacHybrid",
        SmacHybridParams,
        ("robot_shape",),
    ),
    "nav2_smac_planner::SmacPlannerLattice": Entry(
        _smac(_SMAC_SE2, words("lattice_filepath")),
        "navstack.planning.smac.pose_planner:SmacLattice",
        SmacLatticeParams,
        ("robot_shape",),
        note="where lattice_filepath names no file here, a lattice of 0.5 m of turning radius is made",
    ),
    "nav2_smac_planner::SmacPlanner": Entry(
        Block(
            _SMAC_COMMON.union(_SMAC_DOWNSAMPLING, _SMAC_SE2, words("angle_quantization_bins cost_travel_multiplier")),
            groups={"smoother": OPEN},
        )
    ),
    "nav2_theta_star_planner::ThetaStarPlanner": Entry(
        keys(
            """plugin how_many_corners w_euc_cost w_traversal_cost w_heuristic_cost allow_unknown
        terminal_checking_interval use_final_approach_orientation"""
        ),
        "navstack.planning.theta_star:ThetaStarPlanner",
        ThetaStarParams,
    ),
    "navstack::IncrementalNavfn": Entry(
        of_fields(IncrementalNavfnParams, "plugin"),
        "navstack.planning.incremental_navfn:IncrementalNavfn",
        IncrementalNavfnParams,
        kernels=(*_NAVFN, "navstack.planning.incremental_kernels"),
    ),
    "navstack::OmplPlanner": Entry(
        of_fields(OmplParams, "plugin"), "navstack.planning.ompl_planner:OmplPlanner", OmplParams, ("robot_shape",)
    ),
}

_CONSTRAINED = Block(
    words(
        """plugin reversing_enabled path_downsampling_factor path_upsampling_factor keep_start_orientation
        keep_goal_orientation minimum_turning_radius w_curve w_dist w_smooth w_cost w_cost_cusp_multiplier
        cusp_zone_length cost_check_points"""
    ),
    groups={
        "optimizer": keys(
            "max_iterations debug_optimizer linear_solver_type gradient_tol gradient_tolerance fn_tol fn_tolerance "
            "param_tol param_tolerance"
        )
    },
)

SMOOTHERS: Family = {
    "nav2_smoother::SimpleSmoother": Entry(
        keys("plugin tolerance max_its w_data w_smooth do_refinement refinement_num enforce_path_inversion"),
        "navstack.planning.simple_smoother:SimpleSmoother",
        SimpleSmootherParams,
    ),
    "nav2_smoother::SavitzkyGolaySmoother": Entry(
        keys("plugin do_refinement refinement_num enforce_path_inversion window_size poly_order")
    ),
    "nav2_constrained_smoother::ConstrainedSmoother": Entry(_CONSTRAINED),
}
