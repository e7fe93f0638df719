"""From a Nav2 parameter file to a navigator.

``navstack.params.registry`` says which algorithms there are.

The tracker is imported when it is asked for: it brings filterpy along, which takes half of the
start-up.
"""

from typing import Any

from navstack.behavior_tree import NavigateToPose
from navstack.behaviors.behavior_server import BehaviorServer
from navstack.control.controller import Controller
from navstack.control.controller_server import ControllerServer
from navstack.costmap.filters import FilterMask
from navstack.costmap.layered_costmap import LayeredCostmap
from navstack.costmap.map_io import load_map
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.errors import ParameterError, UnknownNameError
from navstack.localization.localizer import Localizer
from navstack.navigator import Frequencies, Navigator, PeopleTracker
from navstack.params.collision_monitor import CollisionMonitorParams
from navstack.params.costmap import robot_footprint
from navstack.params.expected_cost import DeliveryPrices
from navstack.params.extensions import algorithms, localizers
from navstack.params.nav2_file.file import Nav2File
from navstack.params.nav2_file.views import (
    read_behavior_server,
    read_behaviors,
    read_collision_monitor,
    read_controller,
    read_controller_server,
    read_costmap,
    read_goal_checker,
    read_masks,
    read_planner,
    read_primary_controller,
    read_progress_checker,
    read_velocity_smoother,
)
from navstack.params.registry.bindings import NODES
from navstack.params.registry.tasks import BEHAVIORS, GOAL_CHECKERS, PROGRESS_CHECKERS
from navstack.params.tracker import TrackerParams
from navstack.planning.cost_to_go import cost_to_go
from navstack.planning.planner import Planner, RobotShape
from navstack.safety.collision_monitor import CollisionMonitor
from navstack.safety.velocity_smoother import VelocitySmoother
from navstack.types import BoolArray, FloatArray

MOST_FREQUENT = 1000.0  # [Hz] of any part


def _tracker(nav2: Nav2File, static_map: OccupancyGrid) -> PeopleTracker:
    from navstack.perception.tracker import Tracker

    return Tracker(nav2.read(TrackerParams, "tracker"), static_map)


def build_localizer(name: str, nav2: Nav2File, static_map: OccupancyGrid) -> Localizer:
    """A localizer by name.

    Args:
        name: this program's, or the type of another package's (see :func:`localizers`).
        nav2: where its parameters stand.
        static_map: what a localizer that needs a map matches scans against.

    Raises:
        ParameterError: its parameters cannot be used.
        UnknownNameError: no localizer has this name.
    """
    known = localizers()
    if name not in known:
        raise UnknownNameError("localizer", name, known)
    entry = known[name]
    params = [nav2.read(entry.params or NODES[node], node) for node in entry.nodes]
    localizer: Localizer = entry.create(*params, parts={"static_map": static_map})
    return localizer


def build_navigator(
    nav2: Nav2File,
    localizer: Localizer,
    static_map: OccupancyGrid,
    keepout: BoolArray | None,
    stops_when_lost: bool = False,
    prices: DeliveryPrices | None = None,
    tracker: PeopleTracker | None = None,
) -> Navigator:
    """A navigator as a Nav2 parameter file describes it.

    Args:
        nav2: the parameter file.
        localizer: where the belief comes from.
        static_map: what the static layers show.
        keepout: cells of ``static_map`` (height, width) that the robot must not enter: the mask of
            keepout filters for which the file names none; None: there is no such mask.
        stops_when_lost: see :class:`Navigator`; Nav2 drives on.
        prices: for a controller that minimises dollars; None: those of the file hold.
        tracker: tells a controller that asks for it of people; None: the file's own, which sees
            them in the scans.

    Raises:
        ParameterError: the file asks for something that does not exist here or cannot work.
    """
    local_costmap = _build_costmap(nav2, "local_costmap", static_map, keepout)
    global_costmap = _build_costmap(nav2, "global_costmap", static_map, keepout)
    server_params = read_controller_server(nav2)
    goal_checker, progress_checker = read_goal_checker(nav2), read_progress_checker(nav2)
    parts = {
        "footprint": local_costmap.footprint,
        "control_frequency": server_params.controller_frequency,
        "xy_goal_tolerance": goal_checker.params.xy_goal_tolerance,
        "global_costmap": global_costmap.master,
        "cost_to_go": cost_to_go,
        "prices": prices,
    }
    controller = _build_controller(nav2, parts)
    controller_server = ControllerServer(
        server_params,
        controller,
        GOAL_CHECKERS[goal_checker.type].create(goal_checker.params, parts={}),
        PROGRESS_CHECKERS[progress_checker.type].create(progress_checker.params, parts={}),
    )
    for costmap in (local_costmap, global_costmap):
        costmap.on_speed_limit(controller.set_speed_limit)
    if not controller.wants_tracks:
        tracker = None
    elif tracker is None:
        tracker = _tracker(nav2, static_map)
    tree = NavigateToPose(
        build_planner(nav2, global_costmap),
        controller_server,
        _build_behavior_server(nav2, local_costmap),
        global_costmap,
        local_costmap,
    )
    return Navigator(
        localizer,
        local_costmap,
        global_costmap,
        tree,
        VelocitySmoother(read_velocity_smoother(nav2)),
        _build_monitor(nav2, local_costmap.footprint),
        read_frequencies(nav2),
        stops_when_lost,
        tracker,
    )


def build_global_costmap(
    nav2: Nav2File, static_map: OccupancyGrid, keepout: BoolArray | None
) -> LayeredCostmap:
    """The costmap on which paths are planned; see :func:`build_navigator`."""
    return _build_costmap(nav2, "global_costmap", static_map, keepout)


def build_planner(nav2: Nav2File, costmap: LayeredCostmap) -> Planner:
    """The planner that Nav2's default tree asks, for a robot as the global costmap has it."""
    plugin = read_planner(nav2)
    planner: Planner = algorithms("planners")[plugin.type].create(
        plugin.params, parts={"robot_shape": robot_shape(costmap)}
    )
    return planner


def robot_shape(costmap: LayeredCostmap) -> RobotShape:
    """What a planner knows of the robot's body on a costmap."""
    return RobotShape(robot_footprint(costmap.params), costmap.inscribed_radius)


def read_frequencies(nav2: Nav2File) -> Frequencies:
    """How often each part of the navigator runs.

    Raises:
        ParameterError: more often than ``MOST_FREQUENT``.
    """
    frequencies = Frequencies(
        local_costmap=read_costmap(nav2, "local_costmap").update_frequency,
        global_costmap=read_costmap(nav2, "global_costmap").update_frequency,
        controller=read_controller_server(nav2).controller_frequency,
        behaviors=read_behavior_server(nav2).cycle_frequency,
        smoother=read_velocity_smoother(nav2).smoothing_frequency,
    )
    if max(frequencies) > MOST_FREQUENT:
        raise ParameterError(
            f"{nav2.path}: a frequency of {max(frequencies):g} Hz; at most {MOST_FREQUENT:g} is run"
        )
    return frequencies


def _build_costmap(
    nav2: Nav2File, node: str, static_map: OccupancyGrid, keepout: BoolArray | None
) -> LayeredCostmap:
    """A costmap of the file with the masks that the file names for its filters."""
    params = read_costmap(nav2, node)
    masks = {
        name: FilterMask(load_map(mask.path), mask.info.type, mask.info.base, mask.info.multiplier)
        for name, mask in read_masks(nav2, params).items()
    }
    return LayeredCostmap(params, static_map, keepout=keepout, masks=masks)


def _build_controller(nav2: Nav2File, parts: dict[str, Any]) -> Controller:
    """The file's controller, with the one below it when it is a rotation shim."""
    plugin, table = read_controller(nav2), algorithms("controllers")
    if "primary_controller" in table[plugin.type].needs:
        primary = read_primary_controller(nav2, plugin)
        parts["primary_controller"] = table[primary.type].create(primary.params, parts=parts)
    controller: Controller = table[plugin.type].create(plugin.params, parts=parts)
    return controller


def _build_behavior_server(nav2: Nav2File, local_costmap: LayeredCostmap) -> BehaviorServer:
    """The file's behaviors, which look ahead in the local costmap."""
    params = read_behavior_server(nav2)
    behaviors = {
        plugin.name: BEHAVIORS[plugin.type].create(
            params, local_costmap.footprint, plugin.params, parts={}
        )
        for plugin in read_behaviors(nav2)
    }
    return BehaviorServer(behaviors, local_costmap.master)


def _build_monitor(nav2: Nav2File, footprint: FloatArray) -> CollisionMonitor:
    """The file's collision monitor.

    Without a zone it lets every command pass, even where a scan is overdue.
    """
    params = read_collision_monitor(nav2)
    if not params.polygons:
        params = CollisionMonitorParams()
    return CollisionMonitor(params, footprint)
