"""Controllers that run here, and their critics."""

from dataclasses import fields

from navstack.params.dwb import MODULE, DwbParams
from navstack.params.expected_cost import ExpectedCostParams
from navstack.params.graceful import GracefulParams
from navstack.params.mpc import MpcParams
from navstack.params.mppi import MppiParams
from navstack.params.registry.entry import AlgorithmEntry, Params
from navstack.params.registry.nav2 import family
from navstack.params.rotation_shim import RotationShimParams
from navstack.params.rpp import RppParams

_CONTACT = ("navstack.control.contact_risk", "navstack.perception.scan_clusters")

DWB_CRITICS = family(
    "dwb_critics",
    {
        each.name: AlgorithmEntry(
            make=f"navstack.control.dwb.critics.{each.metadata[MODULE]}:{each.name}Critic",
            needs=("dwb",),
            kernels=_CONTACT if each.name == "ExpectedContact" else (),
        )
        for each in fields(DwbParams)
        if MODULE in each.metadata
    },
)

_MPPI_CRITICS: dict[str, tuple[str, tuple[str, ...]]] = {  # class -> its module, and what it needs
    "ConstraintCritic": ("motion_critics", ()),
    "GoalCritic": ("path_critics", ()),
    "GoalAngleCritic": ("path_critics", ()),
    "ObstaclesCritic": ("obstacle_critics", ("footprint",)),
    "CostCritic": ("obstacle_critics", ("footprint",)),
    "PathAlignCritic": ("path_critics", ()),
    "PathAngleCritic": ("path_critics", ()),
    "PathFollowCritic": ("path_critics", ()),
    "PreferForwardCritic": ("motion_critics", ()),
    "TwirlingCritic": ("motion_critics", ("xy_goal_tolerance",)),
    "VelocityDeadbandCritic": ("motion_critics", ()),
    "ExpectedContactCritic": ("contact_critic", ("footprint",)),
}
MPPI_CRITICS = family(
    "mppi_critics",
    {
        name: AlgorithmEntry(
            make=f"navstack.control.mppi.{module}:Mppi{name}",
            needs=needs,
            kernels=_CONTACT if name == "ExpectedContactCritic" else (),
        )
        for name, (module, needs) in _MPPI_CRITICS.items()
    },
)

# padded polygon (V, 2) in [m], [Hz], [m]
_CONTROL = ("footprint", "control_frequency", "xy_goal_tolerance")


def _controller(
    make: str, params: Params, kernels: str, needs: tuple[str, ...] = _CONTROL
) -> AlgorithmEntry:
    """A controller of ``navstack.control``.

    ``kernels``: modules of ``navstack``, with blanks between.
    """
    modules = tuple(f"navstack.{module}" for module in kernels.split())
    return AlgorithmEntry(
        make=f"navstack.control.{make}", params=params, needs=needs, kernels=modules
    )


CONTROLLERS = family(
    "controllers",
    {
        "dwb_core::DWBLocalPlanner": _controller(
            "dwb.dwb_controller:DwbController",
            DwbParams,
            "control.dwb.choice_kernels control.plan_handling",
            _CONTROL[:2],
        ),
        "nav2_rotation_shim_controller::RotationShimController": _controller(
            "rotation_shim:RotationShimController",
            RotationShimParams,
            "control.footprint_cost",
            ("primary_controller", *_CONTROL),
        ),
        "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController": _controller(
            "rpp.rpp_controller:RegulatedPurePursuitController",
            RppParams,
            "control.path_window control.rpp.lookahead control.rpp.arc_check",
        ),
        "nav2_mppi_controller::MPPIController": _controller(
            "mppi.mppi_controller:MppiController",
            MppiParams,
            """control.mppi.obstacle_kernels control.mppi.path_kernels control.mppi.motion_kernels
            control.mppi.rollouts control.mppi.control_sequence control.mppi.path_handler""",
        ),
        "navstack::JerkLimitedMPC": _controller(
            "mpc.mpc_controller:JerkLimitedMpcController",
            MpcParams,
            """control.mpc.stages control.mpc.command_guard control.mpc.path_line control.mpc.motion
            perception.scan_clusters""",
        ),
        "navstack::ExpectedCostController": _controller(
            "expected_cost.expected_cost_controller:ExpectedCostController",
            ExpectedCostParams,
            """control.expected_cost.motion_cost control.expected_cost.people
            control.expected_cost.clearance control.expected_cost.field perception.scan_clusters
            scan_matching.kernels scan_matching.surface_field costmap.distances""",
            (*_CONTROL, "global_costmap", "cost_to_go", "prices"),
        ),
        "nav2_graceful_controller::GracefulController": _controller(
            "graceful.graceful_controller:GracefulController",
            GracefulParams,
            "control.path_window control.graceful.control_law",
        ),
    },
)
