"""Stops or slows the robot down for obstacles in its zones (``collision_monitor_node.cpp``)."""

import math
from typing import NamedTuple

import numpy as np

from navstack.costmap.observations import PointObservation, ScanProjector
from navstack.geometry import relative_to, transform_points
from navstack.params.collision_monitor import CollisionMonitorParams, PolygonParams
from navstack.safety.monitor_zones import MonitorZone, make_zone
from navstack.types import FloatArray, LaserScan, Pose2D, Twist2D

INVALID_SOURCE = "invalid source"  # Nav2's name of what stops the robot for want of a fresh scan
STANDSTILL = Twist2D()

_NO_POINTS: FloatArray = np.empty((0, 2))


class MonitorAction(NamedTuple):
    """What the monitor did with a command, and for which zone."""

    action: str = "none"  # stop, slowdown, limit, approach; none: the command passed as it was
    polygon: str = ""  # name of the zone, or INVALID_SOURCE


_PASSED = MonitorAction()


class CollisionMonitor:
    """The last node before the wheels: of what the zones leave of a command the slowest is driven.

    Zones are looked at in the order of the file; the first one that stops the robot ends the
    search. The points are those of the newest scan, counted once however many sources read it.
    """

    def __init__(self, params: CollisionMonitorParams, footprint: FloatArray) -> None:
        """``footprint`` is the local costmap's padded polygon (V, 2) in [m], base frame."""
        self._params = params
        self._zones = [
            make_zone(name, params.zones[name], footprint)
            for name in params.polygons
            if params.enabled and params.zones[name].enabled
        ]
        self._sources = {name: params.sources[name] for name in params.observation_sources}
        self._blind = {zone.name for zone in self._zones if not self._sees_scan(zone.params)}
        read = [source for source in self._sources.values() if source.reads_scan]
        # [s] after which the scan is stale
        self._timeouts = [timeout for timeout in map(params.timeout_of, read) if timeout != 0.0]
        self._projector = ScanProjector()
        self.reset()

    def reset(self) -> None:
        """Forget the scan, the last action and the velocities that chose zones."""
        for zone in self._zones:
            zone.reset()
        self.action = _PASSED
        self._scan: PointObservation | None = None  # in the base frame at its time
        self._beams = 0  # of it
        # (n, 2) [m] of it in the present base frame, once they were asked for
        self._points: FloatArray | None = None
        self._stamp = -math.inf  # [s] of the scan; -inf: there is none yet
        self._odometry: Pose2D | None = None  # at that time

    def receive(self, scan: LaserScan, odometry: Pose2D | None = None) -> None:
        """Take a new scan and the pose in the odom frame at which it arrived."""
        self._scan = self._projector.project(scan, Pose2D(), inf_is_valid=False)
        self._beams = len(scan.ranges)
        self._stamp = scan.stamp
        self._odometry = odometry

    def process(self, command: Twist2D, now: float, odometry: Pose2D | None = None) -> Twist2D:
        """The velocity to drive instead of ``command``; :attr:`action` says why.

        Args:
            command: what is to be driven.
            now: in [s].
            odometry: the present pose in the odom frame; None: the scan's points are taken where
                they were seen.
        """
        if self._is_stale(now):
            self.action = MonitorAction("stop", INVALID_SOURCE)
            return STANDSTILL
        driven, self.action = command, _PASSED
        self._points = None
        for zone in self._zones:
            safe = self._safe_velocity(zone, command, odometry)
            if safe is None:
                continue
            if zone.params.action_type == "stop" or _squared(safe) < _squared(driven):
                driven, self.action = safe, MonitorAction(zone.params.action_type, zone.name)
            if zone.params.action_type == "stop":
                break
        return driven

    def _is_stale(self, now: float) -> bool:
        """Whether an enabled source has delivered nothing for longer than its timeout."""
        return any(now - self._stamp > timeout for timeout in self._timeouts)

    def _points_from(self, odometry: Pose2D | None) -> FloatArray:
        """The scan's points (n, 2) in the present base frame."""
        if self._scan is None:
            return _NO_POINTS
        if self._points is None:
            self._points, then = self._scan.points, self._odometry
            if then is None or odometry is None or odometry == then:
                return self._points
            if self._params.base_shift_correction:
                self._points = transform_points(relative_to(odometry, then), self._points)
        return self._points

    def _safe_velocity(
        self, zone: MonitorZone, command: Twist2D, odometry: Pose2D | None
    ) -> Twist2D | None:
        """What a zone leaves of the command; None: it has nothing against it."""
        params = zone.params
        if not zone.select(command) or params.action_type == "none":
            return None
        beams = 0 if zone.name in self._blind else self._beams
        if beams < zone.trigger_count:
            return None
        seen = _NO_POINTS
        if zone.name not in self._blind:
            seen = self._points_from(odometry)
        if params.action_type == "approach":
            time = zone.collision_time(seen, command)
            if time is None:
                return None
            return _scaled(command, time / params.time_before_collision)
        if not zone.is_triggered(seen):
            return None
        if params.action_type == "stop":
            return STANDSTILL
        if params.action_type == "slowdown":
            return _scaled(command, params.slowdown_ratio)
        return _limited(command, params)

    def _sees_scan(self, params: PolygonParams) -> bool:
        names = params.sources_names or self._params.observation_sources
        return any(self._sources[name].reads_scan for name in names)


def _squared(twist: Twist2D) -> float:
    """By which velocities are compared; it takes turns on the spot into account."""
    return twist.linear_x**2 + twist.linear_y**2 + twist.angular_z**2


def _scaled(command: Twist2D, ratio: float) -> Twist2D:
    return Twist2D(command.linear_x * ratio, command.linear_y * ratio, command.angular_z * ratio)


def _limited(command: Twist2D, params: PolygonParams) -> Twist2D:
    speed, yaw_rate = math.hypot(command.linear_x, command.linear_y), abs(command.angular_z)
    linear = angular = 1.0
    if speed > params.linear_limit:
        linear = params.linear_limit / speed
    if yaw_rate > params.angular_limit:
        angular = params.angular_limit / yaw_rate
    if params.limit_keeps_curvature:
        return _scaled(command, min(linear, angular))
    limit = params.angular_limit
    return Twist2D(
        command.linear_x * linear,
        command.linear_y * linear,
        min(max(command.angular_z, -limit), limit),
    )
