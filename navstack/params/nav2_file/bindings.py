"""What this program reads of a Nav2 file: which dataclass holds the parameters of which node or plugin.

A plugin of Nav2 that is not in :data:`PLUGINS` is known by name but not available here. A new algorithm adds one line.
"""

from collections.abc import Mapping
from typing import Any

from navstack.params.amcl import AmclParams
from navstack.params.amcl_gps import AmclGpsParams
from navstack.params.behaviors import BehaviorServerParams, DriveParams
from navstack.params.checkers import (
    PoseProgressCheckerParams,
    SimpleGoalCheckerParams,
    SimpleProgressCheckerParams,
    StoppedGoalCheckerParams,
)
from navstack.params.collision_monitor import (
    CollisionMonitorParams,
    MonitorSourceParams,
    PolygonParams,
    VelocityPolygonParams,
)
from navstack.params.costmap import LAYER_PARAMS, CostmapParams, ObservationSourceParams, ObstacleLayerParams
from navstack.params.dwb import FALLBACK_SCALES, DwbParams
from navstack.params.filters import FilterInfoServerParams, MaskServerParams
from navstack.params.gps_ekf import GpsEkfParams
from navstack.params.mpc import MpcParams
from navstack.params.mppi import MppiParams
from navstack.params.planners import IncrementalNavfnParams, NavfnParams, OmplParams
from navstack.params.rotation_shim import RotationShimParams
from navstack.params.rpp import RppParams
from navstack.params.safety import VelocitySmootherParams
from navstack.params.servers import BtNavigatorParams, ControllerServerParams, PlannerServerParams
from navstack.params.smoothers import SimpleSmootherParams
from navstack.params.tracker import TrackerParams

Params = type[Any]  # a dataclass whose fields are named like the parameters

NODES: Mapping[str, Params] = {
    "amcl": AmclParams,
    "amcl_gps": AmclGpsParams,
    "gps_ekf": GpsEkfParams,
    "tracker": TrackerParams,
    "bt_navigator": BtNavigatorParams,
    "controller_server": ControllerServerParams,
    "local_costmap": CostmapParams,
    "global_costmap": CostmapParams,
    "planner_server": PlannerServerParams,
    "behavior_server": BehaviorServerParams,
    "velocity_smoother": VelocitySmootherParams,
    "collision_monitor": CollisionMonitorParams,
}

# Nodes of which a file may hold several, each under a name of its own, by the node whose parameters they have.
FILTER_NODES: Mapping[str, Params] = {
    "costmap_filter_info_server": FilterInfoServerParams,
    "filter_mask_server": MaskServerParams,
}

# family -> type -> parameters; None: it has none
PLUGINS: Mapping[str, Mapping[str, Params | None]] = {
    "controllers": {
        "dwb_core::DWBLocalPlanner": DwbParams,
        "nav2_rotation_shim_controller::RotationShimController": RotationShimParams,
        "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController": RppParams,
        "nav2_mppi_controller::MPPIController": MppiParams,
        "navstack::JerkLimitedMPC": MpcParams,
    },
    "planners": {
        "nav2_navfn_planner::NavfnPlanner": NavfnParams,
        "navstack::IncrementalNavfn": IncrementalNavfnParams,
        "navstack::OmplPlanner": OmplParams,
    },
    "smoothers": {"nav2_smoother::SimpleSmoother": SimpleSmootherParams},
    "layers": LAYER_PARAMS,
    "goal_checkers": {
        "nav2_controller::SimpleGoalChecker": SimpleGoalCheckerParams,
        "nav2_controller::StoppedGoalChecker": StoppedGoalCheckerParams,
    },
    "progress_checkers": {
        "nav2_controller::SimpleProgressChecker": SimpleProgressCheckerParams,
        "nav2_controller::PoseProgressChecker": PoseProgressCheckerParams,
    },
    "behaviors": {
        "nav2_behaviors::Spin": None,
        "nav2_behaviors::BackUp": DriveParams,
        "nav2_behaviors::DriveOnHeading": DriveParams,
        "nav2_behaviors::Wait": None,
    },
}

# Families of critics, by the controller's dataclass that holds theirs in fields of their names.
CRITICS: Mapping[str, Params] = {"dwb_critics": DwbParams, "mppi_critics": MppiParams}

# Plugins that run as something simpler.
SUBSTITUTES: Mapping[str, str] = {
    "nav2_costmap_2d::VoxelLayer": "runs as an obstacle layer on the robot's planar scan: one return marks its cell, "
    "whatever its height and mark_threshold",
}

# dataclass -> list parameter -> dataclass of each sub-namespace that the list names
NAMED_SECTIONS: Mapping[Params, Mapping[str, Params]] = {
    ObstacleLayerParams: {"observation_sources": ObservationSourceParams},
    CollisionMonitorParams: {"polygons": PolygonParams, "observation_sources": MonitorSourceParams},
    PolygonParams: {"velocity_polygons": VelocityPolygonParams},
}

# Parameters that are read and do nothing: the robot's planar scan has no heights.
NO_EFFECT: Mapping[Params, frozenset[str]] = {
    ObstacleLayerParams: frozenset({"min_obstacle_height", "max_obstacle_height"}),
}

# dataclass -> list parameter -> parameters that count only where the list is absent
ONLY_WITHOUT: Mapping[Params, Mapping[str, frozenset[str]]] = {
    DwbParams: {"critics": frozenset(name for name, _ in FALLBACK_SCALES.values())},
}
