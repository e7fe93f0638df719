"""The typed parameters of a Nav2 file's parts, ready for the code that builds them."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

from navstack.errors import ParameterError
from navstack.files import named_by
from navstack.params.collision_monitor import (
    CollisionMonitorParams,
    MonitorSourceParams,
    PolygonParams,
    VelocityPolygonParams,
)
from navstack.params.costmap import (
    CostmapParams,
    InflationLayerParams,
    LayerParams,
    ObstacleLayerParams,
    is_unreadable,
)
from navstack.params.dwb import DwbParams, NamedCritic
from navstack.params.filters import FilterInfoServerParams, KeepoutFilterParams, SpeedFilterParams
from navstack.params.graceful import GracefulParams
from navstack.params.local_costs import LocalCosts
from navstack.params.mppi import MppiParams
from navstack.params.nav2_file.catalog import plugin_type
from navstack.params.nav2_file.file import Nav2File
from navstack.params.nav2_file.filters import find_mask
from navstack.params.nav2_file.findings import names_in
from navstack.params.registry.bindings import NAMED_SECTIONS, nested_params
from navstack.params.safety import VelocitySmootherParams
from navstack.params.servers import (
    BehaviorServerParams,
    ControllerServerParams,
    PlannerServerParams,
)
from navstack.params.spatio_temporal import SpatioTemporalLayerParams

CONTROLLER, PLANNER, BEHAVIORS = "controller_server", "planner_server", "behavior_server"
MONITOR, SMOOTHER = "collision_monitor", "smoother_server"
# those that Nav2's default tree asks for
DEFAULT_CONTROLLER, DEFAULT_PLANNER = "FollowPath", "GridBased"
_FOR_EXAMPLE = "e.g. dwb_core::DWBLocalPlanner"


@dataclass(frozen=True, slots=True)
class Plugin:
    """One plugin of a file: the name of its section, its type, and its parameters."""

    name: str
    type: str
    params: Any  # the dataclass that the registry gives for the type; None: it has no parameters


def read_controller_server(nav2: Nav2File) -> ControllerServerParams:
    """What controllers and checkers share."""
    return nav2.read(ControllerServerParams, CONTROLLER)


def read_planner_server(nav2: Nav2File) -> PlannerServerParams:
    """What planners share."""
    return nav2.read(PlannerServerParams, PLANNER)


def read_behavior_server(nav2: Nav2File) -> BehaviorServerParams:
    """What the behaviors share."""
    return nav2.read(BehaviorServerParams, BEHAVIORS)


def read_behaviors(nav2: Nav2File) -> list[Plugin]:
    """The behaviors that the file lists and that are available here.

    The check of the file warns of the others.
    """
    names = read_behavior_server(nav2).behavior_plugins
    available = [name for name in names if _has_behavior(nav2, name)]
    return [_plugin(nav2, BEHAVIORS, "behaviors", name) for name in available]


def _has_behavior(nav2: Nav2File, name: str) -> bool:
    try:
        nav2.plugin(BEHAVIORS, name, "behaviors")
    except ParameterError:
        return False
    return True


def read_velocity_smoother(nav2: Nav2File) -> VelocitySmootherParams:
    """The velocity smoother's parameters."""
    return nav2.read(VelocitySmootherParams, "velocity_smoother")


def read_collision_monitor(nav2: Nav2File) -> CollisionMonitorParams:
    """The collision monitor with its zones and sources; a file without it gives none of them."""
    zones = {name: _read_zone(nav2, name) for name in names_in(nav2.value(MONITOR, "polygons"))}
    names = names_in(nav2.value(MONITOR, "observation_sources"))
    sources = {name: nav2.read(MonitorSourceParams, MONITOR, name) for name in names}
    return nav2.read(CollisionMonitorParams, MONITOR, zones=zones, sources=sources)


def _read_zone(nav2: Nav2File, name: str) -> PolygonParams:
    names = names_in(nav2.value(MONITOR, f"{name}.velocity_polygons"))
    shapes = {each: nav2.read(VelocityPolygonParams, MONITOR, name, each) for each in names}
    return nav2.read(PolygonParams, MONITOR, name, shapes=shapes)


def read_planner(nav2: Nav2File) -> Plugin:
    """The planner that drives: GridBased, for which Nav2's default tree asks, else the first."""
    names = preferred(DEFAULT_PLANNER, read_planner_server(nav2).planner_plugins)
    return _first(nav2, PLANNER, "planners", names)


def plans_through_unknown(nav2: Nav2File) -> bool:
    """Whether that planner may cross unknown cells; one that is not told may."""
    return bool(getattr(read_planner(nav2).params, "allow_unknown", True))


def read_planners(nav2: Nav2File) -> list[Plugin]:
    """All planners that the file lists."""
    names = read_planner_server(nav2).planner_plugins
    return [_plugin(nav2, PLANNER, "planners", name) for name in names]


def read_smoothers(nav2: Nav2File) -> list[Plugin]:
    """All path smoothers that the file lists; Nav2's default tree uses none."""
    names = names_in(nav2.value(SMOOTHER, "smoother_plugins"))
    return [_plugin(nav2, SMOOTHER, "smoothers", name) for name in names]


def read_controller(nav2: Nav2File) -> Plugin:
    """The controller that drives: FollowPath, for which the default tree asks, else the first."""
    names = preferred(DEFAULT_CONTROLLER, read_controller_server(nav2).controller_plugins)
    return _first(nav2, CONTROLLER, "controllers", names)


def read_primary_controller(nav2: Nav2File, shim: Plugin) -> Plugin:
    """The controller below a rotation shim.

    As in Jazzy, its parameters share the shim's namespace and ``primary_controller`` is its type;
    where the file has ``primary_controller.plugin``, as Nav2 main wants it, they stand in that
    namespace.

    Raises:
        ParameterError: the shim names none, itself, or one that is not available here.
    """
    key, name = f"{shim.name}.primary_controller", shim.name
    if nav2.value(CONTROLLER, f"{key}.plugin") is not None:
        key, name = f"{key}.plugin", key
    where = f"{nav2.path.name}: {CONTROLLER}: {key}"
    value = nav2.value(CONTROLLER, key)
    if value is None:
        raise ParameterError(
            f"{where} is missing; name the controller that follows the path, {_FOR_EXAMPLE}"
        )
    kind = plugin_type(value)
    if kind == shim.type:
        raise ParameterError(
            f"{where}: a rotation shim cannot be its own primary controller; "
            f"name another, {_FOR_EXAMPLE}"
        )
    refusal = nav2.catalog.refusal("controllers", kind)
    if refusal:
        raise ParameterError(f"{where}: {refusal}")
    return Plugin(name, kind, _params(nav2, CONTROLLER, "controllers", kind, name))


def read_goal_checker(nav2: Nav2File) -> Plugin:
    """The goal checker: the first one listed.

    Nav2's default tree names none, and Nav2 takes the only one or fails.
    """
    names = read_controller_server(nav2).goal_checker_plugins
    return _first(nav2, CONTROLLER, "goal_checkers", names)


def read_progress_checker(nav2: Nav2File) -> Plugin | None:
    """The progress checker: the first one listed; None: the list is empty, which Nav2 allows.

    As for the goal checker, Nav2 takes the only one or fails.
    """
    names = read_controller_server(nav2).progress_checker_plugins
    if not names:
        return None
    return _first(nav2, CONTROLLER, "progress_checkers", names)


def read_dwb(nav2: Nav2File, name: str = "FollowPath") -> DwbParams:
    """DWB and its critics, as the controller itself or below a rotation shim."""
    params = nav2.read(DwbParams, CONTROLLER, name)
    own, named = nested_params(DwbParams), {}
    types = {**nav2.catalog.available["dwb_critics"], **own}
    for critic in params.critics:
        given = nav2.value(CONTROLLER, f"{name}.{critic}.class", critic)
        kind = nav2.catalog.critic_type("dwb_critics", given)
        read = types.get(kind)
        if read is not None and (kind != critic or kind not in own):
            named[critic] = NamedCritic(kind, nav2.read(read, CONTROLLER, name, critic))
    return replace(params, named_critics=named)


def read_mppi(nav2: Nav2File, name: str = "FollowPath") -> MppiParams:
    """MPPI and its critics, with what they have to know of the local costmap.

    Raises:
        ParameterError: a critic considers the footprint of a robot that is given by its radius.
    """
    local_costs = _local_costs(read_costmap(nav2, "local_costmap"))
    params = nav2.read(MppiParams, CONTROLLER, name, local_costs=local_costs)
    for critic in params.critics:
        considers = getattr(getattr(params, critic), "consider_footprint", False)
        if local_costs.is_round and considers:
            raise ParameterError(
                f"{nav2.path.name}: {CONTROLLER}: {name}.{critic}.consider_footprint is true, "
                "but local_costmap has no footprint, and Nav2 does not start either; give it one, "
                "or set this to false"
            )
    return params


def _local_costs(costmap: CostmapParams) -> LocalCosts:
    """What controllers have to know of the local costmap."""
    layers = list(costmap.enabled_layers((*costmap.plugins, *costmap.filters)).items())
    inflation = {name: layer for name, layer in layers if isinstance(layer, InflationLayerParams)}
    is_round = costmap.footprint.strip() in ("", "[]")
    # all others write costs
    marking = [name for name, layer in layers if not isinstance(layer, SpeedFilterParams)]
    ends_inflated = bool(marking) and marking[-1] in inflation
    return LocalCosts(inflation, costmap.track_unknown_space, is_round, ends_inflated)


def read_costmap(nav2: Nav2File, node: str) -> CostmapParams:
    """A costmap with its layers, in their order; ``node`` is local_costmap or global_costmap.

    A footprint that cannot be read is left out, as in Nav2: robot_radius counts.

    Raises:
        ParameterError: a layer or filter that is not available here, or a value that cannot be
            used.
    """
    names = names_in(nav2.value(node, "plugins", list(CostmapParams().plugins)))
    filters = names_in(nav2.value(node, "filters"))
    layers: dict[str, LayerParams] = {}
    refusals: list[str] = []
    for name in (*names, *filters):
        try:
            layers[name] = _read_layer(nav2, node, name)
        except ParameterError as error:
            refusals.append(str(error))
    if refusals:
        raise ParameterError("; also ".join(refusals))
    params = nav2.read(CostmapParams, node, plugins=names, filters=filters, layers=layers)
    if is_unreadable(params.footprint):
        params = replace(params, footprint="[]")
    return params


class Mask(NamedTuple):
    """A costmap filter's mask."""

    path: Path  # map_server YAML file
    info: FilterInfoServerParams
    info_node: str  # where that stands


def read_masks(nav2: Nav2File, params: CostmapParams) -> dict[str, Mask]:
    """The masks that the file names for a costmap's filters, by the filters' names."""
    masks = {}
    for name, layer in params.enabled_layers((*params.plugins, *params.filters)).items():
        if isinstance(layer, KeepoutFilterParams | SpeedFilterParams):
            source = find_mask(nav2.parameters, nav2.path.parent, layer.filter_info_topic)
            if source is not None:
                info = nav2.read(FilterInfoServerParams, source.info_node)
                path = named_by(nav2.path.parent, source.yaml_filename)
                masks[name] = Mask(path, info, source.info_node)
    return masks


def _read_layer(nav2: Nav2File, node: str, name: str) -> LayerParams:
    kind = nav2.plugin(node, name, "layers")
    params: Any = nav2.catalog.available["layers"][kind]
    layer: LayerParams = nav2.read(params, node, name)
    if not issubclass(params, ObstacleLayerParams | SpatioTemporalLayerParams):
        return layer
    sources = names_in(nav2.value(node, f"{name}.observation_sources"))
    described_by = NAMED_SECTIONS[params]["observation_sources"]
    given: dict[str, Any] = {
        "sources": {source: nav2.read(described_by, node, name, source) for source in sources}
    }
    # the layer takes the costmap's setting where it has none of its own
    if params is SpatioTemporalLayerParams:
        unknown = nav2.value(node, "track_unknown_space", CostmapParams().track_unknown_space)
        given["track_unknown_space"] = nav2.value(node, f"{name}.track_unknown_space", unknown)
    layer = nav2.read(params, node, name, **given)
    return layer


def _plugin(nav2: Nav2File, node: str, family: str, name: str) -> Plugin:
    kind = nav2.plugin(node, name, family)
    return Plugin(name, kind, _params(nav2, node, family, kind, name))


def _params(nav2: Nav2File, node: str, family: str, kind: str, name: str) -> Any:
    params = nav2.catalog.available[family][kind]
    if params is DwbParams:
        return read_dwb(nav2, name)
    if params is MppiParams:
        return read_mppi(nav2, name)
    if params is GracefulParams:
        local_costs = _local_costs(read_costmap(nav2, "local_costmap"))
        return nav2.read(GracefulParams, node, name, local_costs=local_costs)
    if params is None:
        return None
    return nav2.read(params, node, name)


def preferred(name: str, names: tuple[str, ...]) -> tuple[str, ...]:
    """The names, with the one for which the default tree asks in front."""
    if name in names:
        return (name, *names)
    return names


def idle_plugins(nav2: Nav2File, node: str) -> set[str]:
    """Names of the controllers, checkers and planners of a file that nothing asks for."""
    lists: tuple[tuple[str, ...], ...] = ()
    if node == PLANNER:
        lists = (preferred(DEFAULT_PLANNER, read_planner_server(nav2).planner_plugins),)
    elif node == CONTROLLER:
        server = read_controller_server(nav2)
        lists = (
            preferred(DEFAULT_CONTROLLER, server.controller_plugins),
            server.goal_checker_plugins,
            server.progress_checker_plugins,
        )
    used = {names[0] for names in lists if names}
    return {name for names in lists for name in names} - used


def _first(nav2: Nav2File, node: str, family: str, names: tuple[str, ...]) -> Plugin:
    """The first plugin of the list for a family."""
    if not names:
        key = f"{family.removesuffix('s')}_plugins"
        raise ParameterError(f"{nav2.path.name}: {node}: {key} is empty; name at least one plugin")
    return _plugin(nav2, node, family, names[0])
