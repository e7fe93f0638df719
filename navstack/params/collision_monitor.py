"""Parameters of the collision monitor.

Names and defaults are those of Nav2 Jazzy's ``nav2_collision_monitor``.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from navstack.errors import ParameterError, UnknownNameError
from navstack.geometry import make_footprint
from navstack.params.nav2_file.vertices import parse_vertices
from navstack.ranges import Needed, Parameters, Quantity, Whole, one_of
from navstack.types import FloatArray

SHAPES = ("polygon", "circle", "velocity_polygon")
ACTIONS = ("stop", "slowdown", "limit", "approach", "none")
SCAN_SOURCES = ("scan", "pointcloud")  # types of sources that read the robot's planar scan here ...
OTHER_SOURCES = ("range", "polygon", "costmap")  # ... and those that nothing feeds
FEWEST_VERTICES = 4  # Nav2 refuses triangles
MOST_LOOKS = 10_000  # of approach ahead in a cycle; Nav2's defaults make 20
_AT_LEAST_ZERO = {"slowdown": ("slowdown_ratio",), "limit": ("linear_limit", "angular_limit")}
_TYPE_NEEDED = Needed(
    ", and without it Nav2's collision monitor does not start; "
    f"give one of {', '.join(SHAPES)}, or take the zone from polygons"
)


def parse_polygon(text: str) -> FloatArray:
    """The polygon (V, 2) in [m] of a text: ``[[0.3, 0.2], [0.3, -0.2], [0, -0.2], [0, 0.2]]``.

    Numbers are read to single precision as Nav2 does.

    Raises:
        ParameterError: the text is not a list of at least four pairs of numbers.
    """
    vertices = parse_vertices(text)
    if vertices is None or len(vertices) < FEWEST_VERTICES:
        raise ParameterError(
            f"points '{text}' is not a list of at least {FEWEST_VERTICES} pairs [x, y] in metres"
        )
    return make_footprint(vertices).astype(np.float32).astype(np.float64)


@dataclass(frozen=True, slots=True)
class VelocityPolygonParams(Parameters):
    """One of the polygons of a ``velocity_polygon``, and the velocities for which it stands."""

    points: str = ""  # "[[x, y], ...]" in [m], base frame
    linear_min: Quantity = 0.0  # [m/s] of the velocity along x
    linear_max: Quantity = 0.0  # [m/s]
    theta_min: Quantity = 0.0  # [rad/s]
    theta_max: Quantity = 0.0  # [rad/s]
    # [rad] of the direction of travel, if the robot is holonomic
    direction_start_angle: Quantity = -math.pi
    direction_end_angle: Quantity = math.pi  # [rad]; less than the start: the range goes through pi

    def _check_together(self) -> None:
        parse_polygon(self.points)

    def covers(self, x: float, y: float, yaw_rate: float, is_holonomic: bool) -> bool:
        """Whether a velocity in [m/s, m/s, rad/s] lies in the ranges.

        As Jazzy, which compares the speed of a holonomic robot; Kilted compares x.
        """
        speed = math.hypot(x, y) if is_holonomic else x
        covers = (
            self.linear_min <= speed <= self.linear_max
            and self.theta_min <= yaw_rate <= self.theta_max
        )
        if not is_holonomic or not covers:
            return covers
        direction = math.atan2(y, x)
        after_start = direction >= self.direction_start_angle
        before_end = direction <= self.direction_end_angle
        if self.direction_start_angle <= self.direction_end_angle:
            return after_start and before_end
        return after_start or before_end


@dataclass(frozen=True, slots=True)
class PolygonParams(Parameters):
    """One of the ``polygons``: a zone about the robot, and what obstacles in it do."""

    type: Annotated[str, _TYPE_NEEDED, one_of(SHAPES)] = ""
    action_type: Annotated[str, one_of(ACTIONS)] = ""
    enabled: bool = True
    # "[[x, y], ...]" in [m], base frame; absent: the footprint of the local costmap
    points: str | None = None
    # may be that footprint's; no other polygon is published here
    polygon_sub_topic: str | None = None
    radius: Quantity | None = None  # [m] of a circle, of either sign
    # the first one that covers the velocity counts
    velocity_polygons: tuple[str, ...] = field(default_factory=tuple)
    # by the names just above
    shapes: Mapping[str, VelocityPolygonParams] = field(default_factory=dict)
    # the polygons of a velocity_polygon look at the direction of travel too
    holonomic: bool = False
    # observation sources that count; none: all
    sources_names: tuple[str, ...] = field(default_factory=tuple)
    # points inside that trigger the action; Nav2 keeps the low 32 bits, see trigger_count
    min_points: Whole = 4
    max_points: Whole | None = None  # older name: one point less than min_points
    slowdown_ratio: Quantity = 0.5  # [-] of the velocity that slowdown leaves
    linear_limit: Quantity = 0.5  # [m/s] that limit leaves
    angular_limit: Quantity = 0.5  # [rad/s]
    # limit slows all axes alike; False: each for itself, as in Iron
    limit_keeps_curvature: bool = True
    time_before_collision: Quantity = 2.0  # [s] that approach looks ahead and keeps
    simulation_time_step: Quantity = 0.1  # [s] between the places it looks at

    def _check_together(self) -> None:
        """Check the shape of a zone that is on, and what its action reads."""
        if not self.enabled:
            return
        self._check_action()
        if self.type == "circle":
            allowed = "given for a circle: no topic publishes one here"
            self._require("radius", self.radius is not None, allowed)
        if self.type == "velocity_polygon":
            is_right = len(self.velocity_polygons) > 0
            self._require("velocity_polygons", is_right, "the names of one polygon or more")
        if self.type == "polygon":
            self._check_polygon()

    @property
    def trigger_count(self) -> int:
        """Points inside from which on the action is triggered.

        Nav2 stores the number as a 32-bit integer: 6,000,000,000 becomes 1,705,032,704, which no
        sensor reaches, and 3,000,000,000 becomes negative, so that no point at all is enough.
        """
        count = self.min_points
        if self.max_points is not None:
            count = self.max_points + 1
        return (count + 2**31) % 2**32 - 2**31

    def _check_action(self) -> None:
        for name in _AT_LEAST_ZERO.get(self.action_type, ()):
            self._require(name, getattr(self, name) >= 0.0, "0 or more")
        if self.action_type != "approach":
            return
        for name in ("time_before_collision", "simulation_time_step"):
            self._require(name, getattr(self, name) > 0.0, "more than 0")
        looks = self.time_before_collision / self.simulation_time_step
        allowed = f"at least time_before_collision / {MOST_LOOKS:,}"
        self._require("simulation_time_step", looks <= MOST_LOOKS, allowed)

    def _check_polygon(self) -> None:
        if self.points is not None:
            parse_polygon(self.points)
        elif self.action_type != "approach":
            is_footprint = "footprint" in (self.polygon_sub_topic or "")
            allowed = "a footprint's topic where 'points' are absent"
            self._require("polygon_sub_topic", is_footprint, allowed)


@dataclass(frozen=True, slots=True)
class MonitorSourceParams(Parameters):
    """One of the ``observation_sources``.

    A ``scan`` or ``pointcloud`` reads the robot's one scan; other types get no data here.
    """

    type: Annotated[str, one_of(SCAN_SOURCES + OTHER_SOURCES)] = "scan"
    enabled: bool = True
    source_timeout: Quantity | None = None  # [s] absent: the monitor's own

    @property
    def reads_scan(self) -> bool:
        """Whether it is on and fed."""
        return self.enabled and self.type in SCAN_SOURCES


@dataclass(frozen=True, slots=True)
class CollisionMonitorParams(Parameters):
    """``collision_monitor`` (``collision_monitor_node.cpp``)."""

    enabled: bool = True  # False: only stale sources stop the robot
    # [s] age from which on a source is stale and stops the robot; 0: never
    source_timeout: Quantity = 2.0
    base_shift_correction: bool = True  # points are moved by the odometry since their scan
    polygons: tuple[str, ...] = field(default_factory=tuple)
    observation_sources: tuple[str, ...] = field(default_factory=tuple)
    zones: Mapping[str, PolygonParams] = field(default_factory=dict)  # by the names in polygons
    # by the names in observation_sources
    sources: Mapping[str, MonitorSourceParams] = field(default_factory=dict)

    def _check_together(self) -> None:
        for name, zone in self.zones.items():
            for source in zone.sources_names:
                if source not in self.observation_sources:
                    raise UnknownNameError(
                        f"source in {name}.sources_names", source, self.observation_sources
                    )

    def timeout_of(self, source: MonitorSourceParams) -> float:
        """The age in [s] from which on a source is stale; 0: never."""
        if source.source_timeout is None:
            return self.source_timeout
        return source.source_timeout
