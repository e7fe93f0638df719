"""Planners and path smoothers that run here."""

from navstack.params.planners import (
    IncrementalNavfnParams,
    NavfnParams,
    OmplParams,
    SimpleSmootherParams,
    ThetaStarParams,
)
from navstack.params.registry.entry import AlgorithmEntry
from navstack.params.registry.nav2 import family
from navstack.params.smac import Smac2DParams, SmacHybridParams, SmacLatticeParams

_NAVFN = tuple(f"navstack.planning.navfn_{part}" for part in ("kernels", "wave", "descent"))
PLANNERS = family(
    "planners",
    {
        "nav2_navfn_planner::NavfnPlanner": AlgorithmEntry(
            make="navstack.planning.navfn:NavfnPlanner", params=NavfnParams, kernels=_NAVFN
        ),
        "nav2_smac_planner::SmacPlanner2D": AlgorithmEntry(
            make="navstack.planning.smac.smac_2d:Smac2D", params=Smac2DParams
        ),
        "nav2_smac_planner::SmacPlannerHybrid": AlgorithmEntry(
            make="navstack.planning.smac.pose_planner:SmacHybrid",
            params=SmacHybridParams,
            needs=("robot_shape",),
        ),
        "nav2_smac_planner::SmacPlannerLattice": AlgorithmEntry(
            make="navstack.planning.smac.pose_planner:SmacLattice",
            params=SmacLatticeParams,
            needs=("robot_shape",),
            note="where lattice_filepath names no file here, "
            "a lattice of 0.5 m of turning radius is made",
        ),
        "nav2_theta_star_planner::ThetaStarPlanner": AlgorithmEntry(
            make="navstack.planning.theta_star:ThetaStarPlanner", params=ThetaStarParams
        ),
        "navstack::IncrementalNavfn": AlgorithmEntry(
            make="navstack.planning.incremental_navfn:IncrementalNavfn",
            params=IncrementalNavfnParams,
            kernels=(*_NAVFN, "navstack.planning.incremental_kernels"),
        ),
        "navstack::OmplPlanner": AlgorithmEntry(
            make="navstack.planning.ompl_planner:OmplPlanner",
            params=OmplParams,
            needs=("robot_shape",),
        ),
    },
)

SMOOTHERS = family(
    "smoothers",
    {
        "nav2_smoother::SimpleSmoother": AlgorithmEntry(
            make="navstack.planning.simple_smoother:SimpleSmoother", params=SimpleSmootherParams
        )
    },
)
