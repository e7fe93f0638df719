"""What this program reads of a Nav2 file: which dataclass holds the parameters of which node or plugin.

A plugin of Nav2 that is not in :data:`PLUGINS` is known by name but not available here. A new algorithm adds one line.
"""

from collections.abc import Mapping
from typing import Any

from navstack.params.checkers import SimpleGoalCheckerParams, SimpleProgressCheckerParams, StoppedGoalCheckerParams
from navstack.params.costmap import LAYER_PARAMS, CostmapParams, ObservationSourceParams, ObstacleLayerParams
from navstack.params.dwb import DwbParams
from navstack.params.planners import IncrementalNavfnParams, NavfnParams, OmplParams
from navstack.params.rotation_shim import RotationShimParams
from navstack.params.safety import VelocitySmootherParams
from navstack.params.servers import BtNavigatorParams, ControllerServerParams, PlannerServerParams

Params = type[Any]  # a dataclass whose fields are named like the parameters

NODES: Mapping[str, Params] = {
    "bt_navigator": BtNavigatorParams,
    "controller_server": ControllerServerParams,
    "local_costmap": CostmapParams,
    "global_costmap": CostmapParams,
    "planner_server": PlannerServerParams,
    "velocity_smoother": VelocitySmootherParams,
}

# family -> type -> parameters; None: it has none
PLUGINS: Mapping[str, Mapping[str, Params | None]] = {
    "controllers": {
        "dwb_core::DWBLocalPlanner": DwbParams,
        "nav2_rotation_shim_controller::RotationShimController": RotationShimParams,
    },
    "planners": {
        "nav2_navfn_planner::NavfnPlanner": NavfnParams,
        "navstack::IncrementalNavfn": IncrementalNavfnParams,
        "navstack::OmplPlanner": OmplParams,
    },
    "layers": LAYER_PARAMS,
    "filters": {},
    "goal_checkers": {
        "nav2_controller::SimpleGoalChecker": SimpleGoalCheckerParams,
        "nav2_controller::StoppedGoalChecker": StoppedGoalCheckerParams,
    },
    "progress_checkers": {"nav2_controller::SimpleProgressChecker": SimpleProgressCheckerParams},
}

# Plugins that run as something simpler.
SUBSTITUTES: Mapping[str, str] = {
    "nav2_costmap_2d::VoxelLayer": "runs as an obstacle layer on the robot's planar scan",
}

# dataclass -> list parameter -> dataclass of each sub-namespace that the list names
NAMED_SECTIONS: Mapping[Params, Mapping[str, Params]] = {
    ObstacleLayerParams: {"observation_sources": ObservationSourceParams},
}
