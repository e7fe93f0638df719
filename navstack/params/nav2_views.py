"""The typed parameters of a Nav2 file's parts, ready for the code that builds them."""

from dataclasses import dataclass
from typing import Any

from navstack.errors import ParameterError
from navstack.params.costmap import (
    LAYER_PARAMS,
    CostmapParams,
    LayerParams,
    ObservationSourceParams,
    ObstacleLayerParams,
    robot_footprint,
)
from navstack.params.dwb import DwbParams
from navstack.params.nav2_catalog import plugin_type
from navstack.params.nav2_file import Nav2File
from navstack.params.nav2_findings import names_in
from navstack.params.rotation_shim import RotationShimParams
from navstack.params.safety import VelocitySmootherParams
from navstack.params.servers import ControllerServerParams, PlannerServerParams

CONTROLLER, PLANNER = "controller_server", "planner_server"


@dataclass(frozen=True, slots=True)
class Plugin:
    """One plugin of a file: the name of its section, its type, and its parameters."""

    name: str
    type: str
    params: Any  # the dataclass that nav2_bindings.PLUGINS gives for the type; None: it has no parameters


def read_controller_server(nav2: Nav2File) -> ControllerServerParams:
    """What controllers and checkers share."""
    return nav2.read(ControllerServerParams, CONTROLLER)


def read_planner_server(nav2: Nav2File) -> PlannerServerParams:
    """What planners share."""
    return nav2.read(PlannerServerParams, PLANNER)


def read_velocity_smoother(nav2: Nav2File) -> VelocitySmootherParams:
    """The velocity smoother's parameters."""
    return nav2.read(VelocitySmootherParams, "velocity_smoother")


def read_planner(nav2: Nav2File) -> Plugin:
    """The planner that Nav2's default tree uses: the first one listed."""
    return _plugin(
        nav2, PLANNER, "planners", _first(nav2, PLANNER, "planner_plugins", read_planner_server(nav2).planner_plugins)
    )


def read_controller(nav2: Nav2File) -> Plugin:
    """The controller that Nav2's default tree uses: the first one listed."""
    names = read_controller_server(nav2).controller_plugins
    return _plugin(nav2, CONTROLLER, "controllers", _first(nav2, CONTROLLER, "controller_plugins", names))


def read_primary_controller(nav2: Nav2File, shim: Plugin) -> Plugin:
    """The controller below a rotation shim; as in Jazzy, its parameters share the shim's namespace.

    Raises:
        ParameterError: the shim names none, itself, or one that is not available here.
    """
    kind = plugin_type(nav2.value(CONTROLLER, f"{shim.name}.primary_controller", ""))
    where = f"{nav2.path.name}: {CONTROLLER}: {shim.name}.primary_controller"
    if not kind or kind == shim.type:
        raise ParameterError(
            f"{where}: '{kind}' cannot be the primary controller; name one such as dwb_core::DWBLocalPlanner"
        )
    refusal = nav2.catalog.refusal("controllers", kind)
    if refusal:
        raise ParameterError(f"{where}: {refusal}")
    return Plugin(shim.name, kind, _params(nav2, CONTROLLER, "controllers", kind, shim.name))


def read_goal_checker(nav2: Nav2File) -> Plugin:
    """The goal checker: the first one listed."""
    names = read_controller_server(nav2).goal_checker_plugins
    return _plugin(nav2, CONTROLLER, "goal_checkers", _first(nav2, CONTROLLER, "goal_checker_plugins", names))


def read_progress_checker(nav2: Nav2File) -> Plugin:
    """The progress checker: the first one listed."""
    names = read_controller_server(nav2).progress_checker_plugins
    return _plugin(nav2, CONTROLLER, "progress_checkers", _first(nav2, CONTROLLER, "progress_checker_plugins", names))


def read_dwb(nav2: Nav2File, name: str = "FollowPath") -> DwbParams:
    """DWB and its critics, as the controller itself or below a rotation shim."""
    return nav2.read(DwbParams, CONTROLLER, name)


def read_rotation_shim(nav2: Nav2File, name: str = "FollowPath") -> RotationShimParams:
    """The rotation shim's own parameters."""
    return nav2.read(RotationShimParams, CONTROLLER, name)


def read_costmap(nav2: Nav2File, node: str) -> CostmapParams:
    """A costmap with its layers, in their order; ``node`` is local_costmap or global_costmap.

    Raises:
        ParameterError: a layer or filter that is not available here, or a value that cannot be used.
    """
    names = names_in(nav2.value(node, "plugins", list(CostmapParams().plugins)))
    layers = {name: _read_layer(nav2, node, name) for name in names}
    for name in names_in(nav2.value(node, "filters")):
        nav2.plugin(node, name, "filters")
    params = nav2.read(CostmapParams, node, plugins=names, layers=layers)
    try:
        robot_footprint(params)
    except ParameterError as error:
        raise ParameterError(f"{nav2.path.name}: {node}: {error}") from None
    return params


def _read_layer(nav2: Nav2File, node: str, name: str) -> LayerParams:
    kind = nav2.plugin(node, name, "layers")
    params = LAYER_PARAMS[kind]
    if params is not ObstacleLayerParams:
        return nav2.read(params, node, name)
    sources = names_in(nav2.value(node, f"{name}.observation_sources"))
    described = {source: nav2.read(ObservationSourceParams, node, name, source) for source in sources}
    return nav2.read(params, node, name, sources=described)


def _plugin(nav2: Nav2File, node: str, family: str, name: str) -> Plugin:
    kind = nav2.plugin(node, name, family)
    return Plugin(name, kind, _params(nav2, node, family, kind, name))


def _params(nav2: Nav2File, node: str, family: str, kind: str, name: str) -> Any:
    params = nav2.catalog.available[family][kind]
    return None if params is None else nav2.read(params, node, name)


def _first(nav2: Nav2File, node: str, key: str, names: tuple[str, ...]) -> str:
    if not names:
        raise ParameterError(f"{nav2.path.name}: {node}: {key} is empty; name at least one plugin")
    return names[0]
