"""A parameter file as the lint rules see it.

Typed views of what stands in it, None for what does not.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any, Generic, NamedTuple, TypeVar

from navstack.errors import ParameterError
from navstack.params.checkers import SimpleGoalCheckerParams, SimpleProgressCheckerParams
from navstack.params.dwb import DwbParams
from navstack.params.filters import FilterInfoServerParams
from navstack.params.graceful import GracefulParams
from navstack.params.lint.costmap_view import CostmapView, view_costmap
from navstack.params.mppi import MppiParams
from navstack.params.nav2_file import views
from navstack.params.nav2_file.catalog import plugin_type
from navstack.params.nav2_file.file import Nav2File
from navstack.params.nav2_file.findings import names_in
from navstack.params.nav2_file.release import VELOCITY_SMOOTHER
from navstack.params.registry.releases import RELEASES
from navstack.params.rotation_shim import RotationShimParams
from navstack.params.rpp import RppParams
from navstack.params.safety import VelocitySmootherParams
from navstack.params.servers import ControllerServerParams
from navstack.types import FloatArray

CONTROLLER, SMOOTHER = "controller_server", VELOCITY_SMOOTHER
MONITOR, BEHAVIORS = "collision_monitor", "behavior_server"
DWB = "dwb_core::DWBLocalPlanner"
SHIM = "nav2_rotation_shim_controller::RotationShimController"
PURSUIT = "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController"
MPPI = "nav2_mppi_controller::MPPIController"
_DEFAULT_TYPES = {views.DEFAULT_CONTROLLER: DWB}  # of controllers without ``plugin``

# The parameters that hold a controller's highest forward speed [m/s], and the fields that have
# Nav2's default.
SPEEDS: dict[str, tuple[str, type[Any]]] = {
    DWB: ("max_vel_x", DwbParams),
    PURSUIT: ("desired_linear_vel", RppParams),
    MPPI: ("vx_max", MppiParams),
    "nav2_graceful_controller::GracefulController": ("v_linear_max", GracefulParams),
}

T = TypeVar("T")


class Named(NamedTuple, Generic[T]):
    """A plugin's parameters and the name of its section."""

    name: str
    params: T


@dataclass(frozen=True, slots=True)
class RobotLimits:
    """What the robot's body can do, to hold a file against."""

    name: str
    footprint: FloatArray  # (N, 2) in [m], base frame
    max_speed: float  # [m/s]
    max_yaw_rate: float  # [rad/s]
    max_acceleration: float  # [m/s2]
    max_deceleration: float  # [m/s2] positive
    max_yaw_acceleration: float  # [rad/s2]


@dataclass(frozen=True, slots=True)
class MaskFacts:
    """What a mask of a costmap filter says."""

    node: str  # costmap
    filter: str  # the filter's name
    info_node: str  # the costmap_filter_info_server
    info: FilterInfoServerParams
    values: tuple[int, ...]  # [%] in it, ascending, without those of free and unknown cells
    yaw: float  # [rad] of its origin


@dataclass(frozen=True, slots=True)
class DrivingPlugin:
    """The controller that follows the path: FollowPath, else the first one listed.

    Of a rotation shim the one below it.
    """

    type: str
    name: str  # dotted name of the namespace that holds its parameters


class Subject:
    """What the rules look at.

    A part is None if the file leaves it out or its values cannot be read.
    """

    def __init__(
        self,
        nav2: Nav2File,
        robot: RobotLimits | None = None,
        masks: Sequence[MaskFacts] = (),
    ) -> None:
        self.nav2 = nav2
        self.robot = robot
        self.masks = masks
        self.subject = self  # a rule may ask for the whole

    def has(self, node: str) -> bool:
        """Whether the file sets any parameter of a node."""
        return self.nav2.sets(node)

    def value(self, node: str, name: str, default: Any = None) -> Any:
        """One parameter as it stands in the file."""
        return self.nav2.value(node, name, default)

    def number(self, node: str, name: str, default: float) -> float:
        """One parameter as a number; the default where it is none."""
        value = self.value(node, name)
        if isinstance(value, int | float) and not isinstance(value, bool):
            return float(value)
        return default

    def default_note(self, node: str, name: str, note: str = " (Nav2's default)") -> str:
        """What to add to a value where the file leaves it out; empty where it has it."""
        if self.value(node, name) is None:
            return note
        return ""

    def shape_key(self, costmap: str) -> str:
        """The parameter that gives the robot's shape in a costmap."""
        if self.value(costmap, "footprint"):
            return "footprint"
        return "robot_radius"

    def names(self, node: str, name: str) -> tuple[str, ...]:
        """The names in a list parameter."""
        return names_in(self.value(node, name))

    @property
    def is_of_foxy(self) -> bool:
        """Whether the file has the one goal checker of Foxy."""
        return any(
            notice.path == f"{CONTROLLER}: goal_checker_plugin" for notice in self.nav2.notices
        )

    @property
    def smooths_behaviors(self) -> bool:
        """Whether commands of behaviors pass the velocity smoother: since Jazzy's launch files."""
        return RELEASES.index(self.nav2.release) >= RELEASES.index("jazzy")

    @cached_property
    def behavior_types(self) -> tuple[str, ...]:
        """Types of the behaviors that are available here, Nav2's own where none are listed."""
        found = self._read(BEHAVIORS, views.read_behaviors) or []
        return tuple(plugin.type for plugin in found)

    @property
    def waits_for_costmaps(self) -> bool:
        """Whether the file is of a release that waits for a costmap as long as it takes."""
        return RELEASES.index(self.nav2.release) < RELEASES.index("jazzy")

    def line(self, node: str, name: str) -> int:
        """The line of a parameter, or of the first one beside it where the file leaves it out.

        0: none.
        """
        entries = self.nav2.parameters.get(node, {})
        if name in entries and entries[name].line:
            return entries[name].line
        namespace, dot, _ = name.rpartition(".")
        beside = [entry for each, entry in entries.items() if each.startswith(namespace + dot)]
        return min((entry.line for entry in beside if entry.line), default=0)

    @cached_property
    def server(self) -> ControllerServerParams | None:
        """The controller server."""
        return self._read(CONTROLLER, views.read_controller_server)

    @cached_property
    def shim(self) -> Named[RotationShimParams] | None:
        """Name and parameters of a rotation shim."""
        name = self._driving_controller
        if name is None or self._type_of(name) != SHIM:
            return None
        return self._read(
            CONTROLLER, lambda nav2: Named(name, nav2.read(RotationShimParams, CONTROLLER, name))
        )

    @cached_property
    def drive(self) -> DrivingPlugin | None:
        """The controller that follows the path."""
        name = self._driving_controller
        if name is None:
            return None
        kind = self._type_of(name)
        if kind != SHIM:
            return DrivingPlugin(kind, name)
        below = f"{name}.primary_controller"  # a namespace of its own in Nav2 main, a type in Jazzy
        if self.value(CONTROLLER, f"{below}.plugin"):
            return DrivingPlugin(self._type_of(below), below)
        return DrivingPlugin(plugin_type(self.value(CONTROLLER, below, "")), name)

    @cached_property
    def dwb(self) -> DwbParams | None:
        """Parameters of DWB, itself or below a rotation shim."""
        drive = self.drive
        if drive is None or drive.type != DWB:
            return None
        return self._read(CONTROLLER, lambda nav2: views.read_dwb(nav2, drive.name))

    @cached_property
    def mppi(self) -> MppiParams | None:
        """Parameters of MPPI, itself or below a rotation shim.

        Without what the local costmap tells.
        """
        drive = self.drive
        if drive is None or drive.type != MPPI:
            return None
        return self._read(CONTROLLER, lambda nav2: nav2.read(MppiParams, CONTROLLER, drive.name))

    @cached_property
    def top_speed(self) -> float:
        """The highest forward speed that the controller asks for, in [m/s]; 0: unknown."""
        if self.dwb is not None:
            speed = self.dwb.max_vel_x
            if self.dwb.max_speed_xy >= 0.0:
                speed = min(speed, self.dwb.max_speed_xy)
            return speed
        if self.drive is None or self.drive.type not in SPEEDS:
            return 0.0
        key, kind = SPEEDS[self.drive.type]
        default: Any = next(field.default for field in fields(kind) if field.name == key)
        return self.number(CONTROLLER, f"{self.drive.name}.{key}", default)

    @property
    def speed_name(self) -> str:
        """The parameter that gives the top speed."""
        drive = self.drive or DrivingPlugin(DWB, "FollowPath")
        return f"{drive.name}.{SPEEDS.get(drive.type, SPEEDS[DWB])[0]}"

    @cached_property
    def braking(self) -> float | None:
        """The deceleration [m/s2] that is left of the controller's, the smoother's and the robot's.

        None: unknown.
        """
        limits = []
        if self.dwb is not None:
            limits.append(-self.dwb.decel_lim_x)
        if self.smoother is not None:
            limits.append(-self.smoother.max_decel[0])
        if self.robot is not None:
            limits.append(self.robot.max_deceleration)
        return min((limit for limit in limits if limit > 0.0), default=None)

    @cached_property
    def smoother(self) -> VelocitySmootherParams | None:
        """The velocity smoother; Nav2's own where a file with a controller leaves it out."""
        if not self.nav2.runs(SMOOTHER):
            return None
        node = SMOOTHER if self.has(SMOOTHER) else CONTROLLER
        return self._read(node, views.read_velocity_smoother)

    @cached_property
    def goal_checker(self) -> Named[SimpleGoalCheckerParams] | None:
        """Name and parameters of the goal checker."""
        return self._plugin(views.read_goal_checker, SimpleGoalCheckerParams)

    @cached_property
    def progress_checker(self) -> Named[SimpleProgressCheckerParams] | None:
        """Name and parameters of the progress checker."""
        return self._plugin(views.read_progress_checker, SimpleProgressCheckerParams)

    @cached_property
    def local(self) -> CostmapView | None:
        """The local costmap."""
        return self._read("local_costmap", lambda nav2: view_costmap(nav2, "local_costmap"))

    @cached_property
    def world(self) -> CostmapView | None:
        """The global costmap."""
        return self._read("global_costmap", lambda nav2: view_costmap(nav2, "global_costmap"))

    @property
    def costmaps(self) -> list[CostmapView]:
        """Those that the file has."""
        return [view for view in (self.local, self.world) if view is not None]

    @property
    def _driving_controller(self) -> str | None:
        if self.server is None:
            return None
        names = views.preferred(views.DEFAULT_CONTROLLER, self.server.controller_plugins)
        return next(iter(names), None)

    def _type_of(self, name: str) -> str:
        default = _DEFAULT_TYPES.get(name, "")
        return plugin_type(self.value(CONTROLLER, f"{name}.plugin", default))

    def _plugin(
        self, view: Callable[[Nav2File], views.Plugin | None], kind: type[T]
    ) -> Named[T] | None:
        """A plugin of the controller server, if its parameters are of a kind."""
        plugin = self._read(CONTROLLER, view)
        if plugin is None or not isinstance(plugin.params, kind):
            return None
        return Named(plugin.name, plugin.params)

    def _read(self, node: str, view: Callable[[Nav2File], T]) -> T | None:
        if not self.has(node):
            return None
        try:
            return view(self.nav2)
        except ParameterError:  # the check of the file reports it
            return None
