"""From a Nav2 parameter file to a navigator.

``navstack.params.registry`` says which algorithms there are.

The tracker is imported when it is asked for: it brings scipy.optimize along, which takes 0.2 s.
"""

from functools import cached_property, partial
from typing import Any

from navstack.behavior_tree import NavigateToPose
from navstack.behaviors.behavior_server import BehaviorServer
from navstack.control.controller import Controller
from navstack.control.controller_server import ControllerServer
from navstack.control.goal_checker import GoalChecker
from navstack.control.progress_checker import NoProgressChecker, ProgressChecker
from navstack.costmap.filters import FilterMask
from navstack.costmap.layered_costmap import LayeredCostmap
from navstack.costmap.map_io import load_map
from navstack.costmap.occupancy_grid import OccupancyGrid, align
from navstack.errors import ParameterError, UnknownNameError
from navstack.localization.localizer import Localizer
from navstack.navigator import Frequencies, Navigator, PeopleTracker
from navstack.params.collision_monitor import CollisionMonitorParams
from navstack.params.costmap import robot_footprint
from navstack.params.expected_cost import DeliveryPrices
from navstack.params.extensions import algorithms, localizers
from navstack.params.nav2_file.file import Nav2File
from navstack.params.nav2_file.nodes import COSTMAPS
from navstack.params.nav2_file.views import (
    plans_through_unknown,
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
from navstack.types import BoolArray

MOST_FREQUENT = 1000.0  # [Hz] of any part
# node and parameter of each, as Frequencies has them
_FREQUENCIES = (
    *((node, "update_frequency") for node in COSTMAPS),
    ("controller_server", "controller_frequency"),
    ("behavior_server", "cycle_frequency"),
    ("velocity_smoother", "smoothing_frequency"),
)


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


class NavigatorParts:
    """The parts of a navigator, each built at its first use; see :func:`build_navigator`."""

    def __init__(
        self,
        nav2: Nav2File,
        static_map: OccupancyGrid,
        keepout: BoolArray | None = None,
        prices: DeliveryPrices | None = None,
    ) -> None:
        self._nav2, self._static_map, self._keepout = nav2, static_map, keepout
        self._prices = prices

    @cached_property
    def local_costmap(self) -> LayeredCostmap:
        """What the controller drives in."""
        return _build_costmap(self._nav2, "local_costmap", self._static_map, self._keepout)

    @cached_property
    def global_costmap(self) -> LayeredCostmap:
        """What paths are planned on."""
        return build_global_costmap(self._nav2, self._static_map, self._keepout)

    @cached_property
    def planner(self) -> Planner:
        """The planner on the global costmap."""
        return build_planner(self._nav2, self.global_costmap)

    @cached_property
    def goal_checker(self) -> GoalChecker:
        """The goal checker."""
        plugin = read_goal_checker(self._nav2)
        checker: GoalChecker = GOAL_CHECKERS[plugin.type].create(plugin.params, parts={})
        return checker

    @cached_property
    def progress_checker(self) -> ProgressChecker:
        """The progress checker."""
        plugin = read_progress_checker(self._nav2)
        if plugin is None:
            return NoProgressChecker()
        checker: ProgressChecker = PROGRESS_CHECKERS[plugin.type].create(plugin.params, parts={})
        return checker

    @cached_property
    def controller(self) -> Controller:
        """The file's controller, with the one below it when it is a rotation shim."""
        nav2 = self._nav2
        plugin, table = read_controller(nav2), algorithms("controllers")
        parts: dict[str, Any] = {
            "footprint": self.local_costmap.footprint,
            "control_frequency": read_controller_server(nav2).controller_frequency,
            "xy_goal_tolerance": read_goal_checker(nav2).params.xy_goal_tolerance,
            "global_costmap": self.global_costmap.master,
            "cost_to_go": partial(cost_to_go, allow_unknown=plans_through_unknown(nav2)),
            "prices": self._prices,
        }
        if "primary_controller" in table[plugin.type].needs:
            primary = read_primary_controller(nav2, plugin)
            parts["primary_controller"] = table[primary.type].create(primary.params, parts=parts)
        controller: Controller = table[plugin.type].create(plugin.params, parts=parts)
        for costmap in (self.local_costmap, self.global_costmap):
            costmap.on_speed_limit(controller.set_speed_limit)
        return controller

    @cached_property
    def behavior_server(self) -> BehaviorServer:
        """The file's behaviors, which look ahead in the local costmap."""
        params = read_behavior_server(self._nav2)
        behaviors = {
            plugin.name: BEHAVIORS[plugin.type].create(
                params, self.local_costmap.footprint, plugin.params, parts={}
            )
            for plugin in read_behaviors(self._nav2)
        }
        return BehaviorServer(behaviors, self.local_costmap.master)

    @cached_property
    def smoother(self) -> VelocitySmoother:
        """What keeps commands within limits."""
        return VelocitySmoother(read_velocity_smoother(self._nav2))

    @cached_property
    def monitor(self) -> CollisionMonitor:
        """The file's collision monitor.

        Without a zone it lets every command pass, even where a scan is overdue.
        """
        params = read_collision_monitor(self._nav2)
        if not params.polygons:
            params = CollisionMonitorParams()
        return CollisionMonitor(params, self.local_costmap.footprint)

    @property
    def tree(self) -> NavigateToPose:
        """Nav2's default behavior tree on the servers."""
        return NavigateToPose(
            self.planner,
            ControllerServer(
                read_controller_server(self._nav2),
                self.controller,
                self.goal_checker,
                self.progress_checker,
            ),
            self.behavior_server,
            self.global_costmap,
            self.local_costmap,
        )


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
    parts = NavigatorParts(nav2, static_map, keepout, prices)
    controller = parts.controller
    if not controller.wants_tracks:
        tracker = None
    elif tracker is None:
        tracker = _tracker(nav2, static_map)
    return Navigator(
        localizer,
        parts.local_costmap,
        parts.global_costmap,
        parts.tree,
        parts.smoother,
        parts.monitor,
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
    costmaps = [read_costmap(nav2, node) for node in COSTMAPS]
    server, behaviors = read_controller_server(nav2), read_behavior_server(nav2)
    smoother = read_velocity_smoother(nav2)
    frequencies = Frequencies(
        local_costmap=costmaps[0].update_frequency,
        global_costmap=costmaps[1].update_frequency,
        controller=server.controller_frequency,
        behaviors=behaviors.cycle_frequency,
        smoother=smoother.smoothing_frequency,
    )
    for (node, key), value in zip(_FREQUENCIES, frequencies, strict=True):
        if value > MOST_FREQUENT:
            raise ParameterError(
                f"{nav2.path.name}: {node}: {key} {value:g} must be at most {MOST_FREQUENT:g}"
            )
    return frequencies


def _build_costmap(
    nav2: Nav2File, node: str, static_map: OccupancyGrid, keepout: BoolArray | None
) -> LayeredCostmap:
    """A costmap of the file with the masks that the file names for its filters.

    A mask whose origin has a yaw stands turned, as maps do.
    """
    params = read_costmap(nav2, node)
    masks = {}
    for name, mask in read_masks(nav2, params).items():
        info, grid = mask.info, align(load_map(mask.path))
        masks[name] = FilterMask(grid, info.type, info.base, info.multiplier)
    return LayeredCostmap(params, static_map, keepout=keepout, masks=masks)
