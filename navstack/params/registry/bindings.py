"""What this program reads of a Nav2 file's nodes: which dataclass holds whose parameters."""

import dataclasses
from collections.abc import Mapping

from navstack.params.amcl import AmclGpsParams, AmclParams
from navstack.params.collision_monitor import (
    CollisionMonitorParams,
    MonitorSourceParams,
    PolygonParams,
    VelocityPolygonParams,
)
from navstack.params.costmap import (
    CostmapParams,
    ObservationSourceParams,
    ObstacleLayerParams,
    VoxelLayerParams,
)
from navstack.params.dwb import FALLBACK_SCALES, DwbParams
from navstack.params.filters import FilterInfoServerParams, MaskServerParams
from navstack.params.gps_ekf import GpsEkfParams
from navstack.params.mppi import MppiParams
from navstack.params.registry.entry import Params
from navstack.params.safety import VelocitySmootherParams
from navstack.params.servers import (
    BehaviorServerParams,
    BtNavigatorParams,
    ControllerServerParams,
    PlannerServerParams,
)
from navstack.params.spatio_temporal import SpatioTemporalLayerParams, SpatioTemporalSourceParams
from navstack.params.tracker import TrackerParams
from navstack.type_hints import hints_of

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

# Nodes of which a file may hold several, each under a name of its own, by the node whose parameters
# they have.
FILTER_NODES: Mapping[str, Params] = {
    "costmap_filter_info_server": FilterInfoServerParams,
    "filter_mask_server": MaskServerParams,
}

# Families of critics, by the controller's dataclass that holds theirs in fields of their names.
CRITICS: Mapping[str, Params] = {"dwb_critics": DwbParams, "mppi_critics": MppiParams}

# dataclass -> list parameter -> dataclass of each sub-namespace that the list names
NAMED_SECTIONS: Mapping[Params, Mapping[str, Params]] = {
    ObstacleLayerParams: {"observation_sources": ObservationSourceParams},
    VoxelLayerParams: {"observation_sources": ObservationSourceParams},
    SpatioTemporalLayerParams: {"observation_sources": SpatioTemporalSourceParams},
    CollisionMonitorParams: {"polygons": PolygonParams, "observation_sources": MonitorSourceParams},
    PolygonParams: {"velocity_polygons": VelocityPolygonParams},
}

# Parameters that are read and do nothing: the robot's planar scan has no heights.
NO_EFFECT: Mapping[Params, frozenset[str]] = {
    ObstacleLayerParams: frozenset({"min_obstacle_height", "max_obstacle_height"}),
    VoxelLayerParams: frozenset({"min_obstacle_height", "max_obstacle_height"}),
}

# dataclass -> parameter -> parameters that count only where it is absent
ONLY_WITHOUT: Mapping[Params, Mapping[str, frozenset[str]]] = {
    DwbParams: {"critics": frozenset(name for name, _ in FALLBACK_SCALES.values())},
    PolygonParams: {"max_points": frozenset({"min_points"})},
}


def parameter_of(field: str) -> str:
    """The parameter that a field of a dataclass holds.

    A keyword of Python has an underscore after it there.
    """
    return field.rstrip("_")


def field_names(params: Params) -> frozenset[str]:
    """The parameters and namespaces that the fields of a dataclass hold."""
    return frozenset(parameter_of(each.name) for each in dataclasses.fields(params))


def parameters(params: Params) -> frozenset[str]:
    """The parameters that the fields of a dataclass hold, without those that are namespaces."""
    return frozenset(
        parameter_of(each.name)
        for each in dataclasses.fields(params)
        if each.default_factory is dataclasses.MISSING
    )


def nested_params(params: Params) -> dict[str, Params]:
    """The dataclasses of a dataclass's sub-namespaces, by field.

    For named ones by the list that names them.
    """
    hints = hints_of(params)
    nested = {
        name: kind
        for name, kind in hints.items()
        if dataclasses.is_dataclass(kind) and isinstance(kind, type)
    }
    return {**nested, **NAMED_SECTIONS.get(params, {})}
