"""From a Nav2 parameter file to a navigator: the only place that knows every algorithm."""

from collections.abc import Callable
from typing import Any

from navstack.behavior_tree import NavigateToPose
from navstack.control.controller import Controller
from navstack.control.controller_server import ControllerServer
from navstack.control.dwb.dwb_controller import DwbController
from navstack.control.goal_checker import GOAL_CHECKERS
from navstack.control.progress_checker import PROGRESS_CHECKERS
from navstack.control.rotation_shim import RotationShimController
from navstack.costmap.layered_costmap import LayeredCostmap
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.errors import UnknownNameError
from navstack.localization.gps import GpsLocalizer
from navstack.localization.localizer import Localizer
from navstack.navigator import Frequencies, Navigator
from navstack.params.nav2_file import Nav2File
from navstack.params.nav2_views import (
    read_controller,
    read_controller_server,
    read_costmap,
    read_goal_checker,
    read_planner,
    read_primary_controller,
    read_progress_checker,
    read_velocity_smoother,
)
from navstack.planning.planners import PLANNERS
from navstack.safety.velocity_smoother import VelocitySmoother
from navstack.types import BoolArray, FloatArray

# A new localizer or controller is one line here.
LOCALIZERS: dict[str, Callable[[], Localizer]] = {"gps": GpsLocalizer}
CONTROLLERS: dict[str, Callable[[Any, FloatArray, float], Controller]] = {"dwb_core::DWBLocalPlanner": DwbController}


def build_localizer(name: str) -> Localizer:
    """A localizer by name.

    Raises:
        UnknownNameError: no localizer has this name.
    """
    if name not in LOCALIZERS:
        raise UnknownNameError("localizer", name, LOCALIZERS)
    return LOCALIZERS[name]()


def build_navigator(
    nav2: Nav2File,
    localizer: Localizer,
    static_map: OccupancyGrid,
    keepout: BoolArray | None,
) -> Navigator:
    """A navigator as a Nav2 parameter file describes it.

    Args:
        nav2: the parameter file.
        localizer: where the belief comes from.
        static_map: what the static layers show.
        keepout: cells of ``static_map`` (height, width) that the robot must not enter; None: none.

    Raises:
        ParameterError: the file asks for something that does not exist here or cannot work.
    """
    local_params, global_params = read_costmap(nav2, "local_costmap"), read_costmap(nav2, "global_costmap")
    local_costmap = LayeredCostmap(local_params, static_map, keepout=keepout)
    global_costmap = LayeredCostmap(global_params, static_map, keepout=keepout)
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
    planner = read_planner(nav2)
    return Navigator(
        localizer,
        local_costmap,
        global_costmap,
        NavigateToPose(PLANNERS[planner.type](planner.params), controller_server, global_costmap, local_costmap),
        VelocitySmoother(read_velocity_smoother(nav2)),
        read_frequencies(nav2),
    )


def read_frequencies(nav2: Nav2File) -> Frequencies:
    """How often each part of the navigator runs."""
    return Frequencies(
        local_costmap=read_costmap(nav2, "local_costmap").update_frequency,
        global_costmap=read_costmap(nav2, "global_costmap").update_frequency,
        controller=read_controller_server(nav2).controller_frequency,
        smoother=read_velocity_smoother(nav2).smoothing_frequency,
    )


def _build_controller(nav2: Nav2File, footprint: FloatArray, frequency: float, xy_goal_tolerance: float) -> Controller:
    """The file's controller, with the one below it when it is a rotation shim."""
    plugin = read_controller(nav2)
    if plugin.type != "nav2_rotation_shim_controller::RotationShimController":
        return CONTROLLERS[plugin.type](plugin.params, footprint, frequency)
    primary = read_primary_controller(nav2, plugin)
    below = CONTROLLERS[primary.type](primary.params, footprint, frequency)
    return RotationShimController(plugin.params, below, footprint, frequency, xy_goal_tolerance)
