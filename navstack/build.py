"""From a Nav2 parameter file to a navigator: the only place that knows every algorithm.

What brings filterpy along, and with it scipy.stats, is imported when it is asked for: it takes half of the start-up.
"""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from navstack.behavior_tree import NavigateToPose
from navstack.behaviors.behavior_server import BEHAVIORS, BehaviorServer
from navstack.control.controller import Controller
from navstack.control.controller_server import ControllerServer
from navstack.control.dwb.dwb_controller import DwbController
from navstack.control.goal_checker import GOAL_CHECKERS
from navstack.control.mpc.mpc_controller import JerkLimitedMpcController
from navstack.control.mppi.mppi_controller import MppiController
from navstack.control.progress_checker import PROGRESS_CHECKERS
from navstack.control.rotation_shim import RotationShimController
from navstack.control.rpp.rpp_controller import RegulatedPurePursuitController
from navstack.costmap.filters import FilterMask
from navstack.costmap.layered_costmap import LayeredCostmap
from navstack.costmap.map_io import load_map
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.errors import ParameterError, UnknownNameError
from navstack.localization.amcl import AmclLocalizer
from navstack.localization.amcl_gps import AmclGpsLocalizer
from navstack.localization.gps import GpsLocalizer
from navstack.localization.localizer import Localizer
from navstack.navigator import Frequencies, Navigator
from navstack.params.collision_monitor import CollisionMonitorParams
from navstack.params.costmap import robot_footprint
from navstack.params.extensions import with_extensions
from navstack.params.nav2_file.file import Nav2File
from navstack.params.nav2_file.views import (
    read_amcl,
    read_amcl_gps,
    read_behavior_server,
    read_behaviors,
    read_collision_monitor,
    read_controller,
    read_controller_server,
    read_costmap,
    read_goal_checker,
    read_gps_ekf,
    read_masks,
    read_planner,
    read_primary_controller,
    read_progress_checker,
    read_tracker,
    read_velocity_smoother,
)
from navstack.planning.planner import RobotShape
from navstack.planning.planners import PLANNERS
from navstack.safety.collision_monitor import CollisionMonitor
from navstack.safety.velocity_smoother import VelocitySmoother
from navstack.types import BoolArray, FloatArray

if TYPE_CHECKING:
    from navstack.perception.tracker import Tracker

MOST_FREQUENT = 1000.0  # [Hz] of any part


def _gps_ekf(nav2: Nav2File, uses_fixes: bool = True) -> Localizer:
    from navstack.localization.gps_ekf import GpsEkfLocalizer

    return GpsEkfLocalizer(read_gps_ekf(nav2), uses_fixes=uses_fixes)


def _tracker(nav2: Nav2File, static_map: OccupancyGrid) -> "Tracker":
    from navstack.perception.tracker import Tracker

    return Tracker(read_tracker(nav2), static_map)


# A new localizer or controller is one line here.
# A localizer is made from the parameter file and the map that it takes for the static one.
LOCALIZERS: dict[str, Callable[[Nav2File, OccupancyGrid], Localizer]] = {
    "gps": lambda *_: GpsLocalizer(),
    "gps-ekf": lambda nav2, _: _gps_ekf(nav2),
    "odom_imu": lambda nav2, _: _gps_ekf(nav2, uses_fixes=False),
    "amcl": lambda nav2, static_map: AmclLocalizer(read_amcl(nav2), static_map),
    "amcl-gps": lambda nav2, static_map: AmclGpsLocalizer(read_amcl(nav2), read_amcl_gps(nav2), static_map),
}
# A controller is made from its parameters, the footprint, the control frequency and the goal checker's xy tolerance.
CONTROLLERS: dict[str, Callable[[Any, FloatArray, float, float], Controller]] = {
    "dwb_core::DWBLocalPlanner": lambda params, footprint, frequency, _: DwbController(params, footprint, frequency),
    "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController": RegulatedPurePursuitController,
    "nav2_mppi_controller::MPPIController": MppiController,
    "navstack::JerkLimitedMPC": JerkLimitedMpcController,
}


def build_localizer(name: str, nav2: Nav2File, static_map: OccupancyGrid) -> Localizer:
    """A localizer by name.

    Args:
        name: of ``LOCALIZERS``.
        nav2: where its parameters stand.
        static_map: what a localizer that needs a map matches scans against.

    Raises:
        ParameterError: its parameters cannot be used.
        UnknownNameError: no localizer has this name.
    """
    if name not in LOCALIZERS:
        raise UnknownNameError("localizer", name, LOCALIZERS)
    return LOCALIZERS[name](nav2, static_map)


def build_navigator(
    nav2: Nav2File,
    localizer: Localizer,
    static_map: OccupancyGrid,
    keepout: BoolArray | None,
    stops_when_lost: bool = False,
) -> Navigator:
    """A navigator as a Nav2 parameter file describes it.

    Args:
        nav2: the parameter file.
        localizer: where the belief comes from.
        static_map: what the static layers show.
        keepout: cells of ``static_map`` (height, width) that the robot must not enter: the mask of keepout filters for
            which the file names none; None: there is no such mask.
        stops_when_lost: see :class:`Navigator`; Nav2 drives on.

    Raises:
        ParameterError: the file asks for something that does not exist here or cannot work.
    """
    local_costmap = _build_costmap(nav2, "local_costmap", static_map, keepout)
    global_costmap = _build_costmap(nav2, "global_costmap", static_map, keepout)
    server_params = read_controller_server(nav2)
    goal_checker, progress_checker = read_goal_checker(nav2), read_progress_checker(nav2)
    controller = _build_controller(
        nav2, local_costmap.footprint, server_params.controller_frequency, goal_checker.params.xy_goal_tolerance
    )
    controller_server = ControllerServer(
        server_params,
        controller,
        GOAL_CHECKERS[goal_checker.type](goal_checker.params),
        PROGRESS_CHECKERS[progress_checker.type](progress_checker.params),
    )
    for costmap in (local_costmap, global_costmap):
        costmap.on_speed_limit(controller_server.set_speed_limit)
    tracker = _tracker(nav2, static_map) if controller.wants_tracks else None
    planner = read_planner(nav2)
    tree = NavigateToPose(
        with_extensions("planners", PLANNERS)[planner.type](planner.params, robot_shape(global_costmap)),
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


def build_global_costmap(nav2: Nav2File, static_map: OccupancyGrid, keepout: BoolArray | None) -> LayeredCostmap:
    """The costmap on which paths are planned; see :func:`build_navigator`."""
    return _build_costmap(nav2, "global_costmap", static_map, keepout)


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
        raise ParameterError(f"{nav2.path}: a frequency of {max(frequencies):g} Hz; at most {MOST_FREQUENT:g} is run")
    return frequencies


def _build_costmap(nav2: Nav2File, node: str, static_map: OccupancyGrid, keepout: BoolArray | None) -> LayeredCostmap:
    """A costmap of the file with the masks that the file names for its filters."""
    params = read_costmap(nav2, node)
    masks = {
        name: FilterMask(load_map(mask.path), mask.info.type, mask.info.base, mask.info.multiplier)
        for name, mask in read_masks(nav2, params).items()
    }
    return LayeredCostmap(params, static_map, keepout=keepout, masks=masks)


def _build_controller(nav2: Nav2File, footprint: FloatArray, frequency: float, xy_goal_tolerance: float) -> Controller:
    """The file's controller, with the one below it when it is a rotation shim."""
    plugin, table = read_controller(nav2), with_extensions("controllers", CONTROLLERS)
    if plugin.type != "nav2_rotation_shim_controller::RotationShimController":
        return table[plugin.type](plugin.params, footprint, frequency, xy_goal_tolerance)
    primary = read_primary_controller(nav2, plugin)
    below = table[primary.type](primary.params, footprint, frequency, xy_goal_tolerance)
    return RotationShimController(plugin.params, below, footprint, frequency, xy_goal_tolerance)


def _build_behavior_server(nav2: Nav2File, local_costmap: LayeredCostmap) -> BehaviorServer:
    """The file's behaviors, which look ahead in the local costmap."""
    params = read_behavior_server(nav2)
    behaviors = {
        plugin.name: BEHAVIORS[plugin.type](params, local_costmap.footprint, plugin.params)
        for plugin in read_behaviors(nav2)
    }
    return BehaviorServer(behaviors, local_costmap.master)


def _build_monitor(nav2: Nav2File, footprint: FloatArray) -> CollisionMonitor:
    """The file's collision monitor; without a zone it lets every command pass, even where a scan is overdue."""
    params = read_collision_monitor(nav2)
    return CollisionMonitor(params if params.polygons else CollisionMonitorParams(), footprint)
