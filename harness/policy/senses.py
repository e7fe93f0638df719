"""From what the sensors deliver to what a policy sees."""

from collections.abc import Callable

import numpy as np

from harness.policy.interface import ROUTE_POINTS, ROUTE_SPACING, Image, PolicyObservation
from navstack.geometry import points_relative_to, relative_to, rotation
from navstack.localization.localizer import Localizer
from navstack.plugin_answers import checked_belief
from navstack.types import (
    Belief,
    FloatArray,
    Generators,
    LaserScan,
    Observation,
    Odometry,
    Path,
    Pose2D,
    Twist2D,
)

AHEAD = 10.0  # [m] of the route that is searched for the robot's place on it
ASTRAY = 5.0  # [m] off that stretch from which all of the route is searched
_NOBODY: FloatArray = np.empty((0, 4))
_NO_IMAGE: Image = np.empty((0, 0, 3), dtype=np.uint8)
_NO_SCAN = LaserScan(0.0, np.empty(0), 0.0, 0.0, 0.0, 0.0)

MakeRoute = Callable[[Pose2D, Pose2D, np.random.Generator], Path]
# the true pose, and people (n, 4) in the map frame
People = Callable[[], tuple[Pose2D, FloatArray]]
Look = Callable[[], Image]  # what the camera sees now


class Route:
    """A path, and how far along it the robot has come."""

    def __init__(self, path: Path) -> None:
        """Start at the path's beginning."""
        self._points: FloatArray = np.ascontiguousarray(path.poses[:, :2])
        steps = np.hypot(*np.diff(self._points, axis=0).T)
        self._along = np.concatenate(([0.0], np.cumsum(steps)))  # [m] of each point
        if steps.max(initial=0.0) > ROUTE_SPACING:
            between = np.arange(0.0, self._along[-1], ROUTE_SPACING)
            along = np.union1d(self._along, between)
            self._points = self._points_at(along)
            self._along = along
        self._at = 0  # index of the point that was nearest last

    def ahead(self, pose: Pose2D) -> FloatArray:
        """Points (ROUTE_POINTS, 2) [m] of the route ahead of a pose, in its frame.

        Beyond the end the last one.
        """
        begin = self._at
        end = int(np.searchsorted(self._along, self._along[begin] + AHEAD)) + 1
        squared = self._squared(pose, begin, end)
        if squared.min() > ASTRAY**2:
            begin = 0
            squared = self._squared(pose, begin, len(self._points))
        self._at = begin + int(squared.argmin())
        wanted = self._along[self._at] + ROUTE_SPACING * np.arange(1, ROUTE_POINTS + 1)
        return points_relative_to(pose, self._points_at(wanted))

    def _points_at(self, along: FloatArray) -> FloatArray:
        """Points (n, 2) [m] of the route, so far [m] along it."""
        return np.column_stack([np.interp(along, self._along, self._points[:, k]) for k in (0, 1)])

    def _squared(self, pose: Pose2D, begin: int, end: int) -> FloatArray:
        offset = self._points[begin:end] - (pose.x, pose.y)
        squared: FloatArray = (offset**2).sum(axis=1)
        return squared


class Senses:
    """Localizes, and keeps the newest of what arrives."""

    def __init__(
        self,
        localizer: Localizer,
        make_route: MakeRoute,
        people: People | None,
        look: Look | None,
    ) -> None:
        """Take in nothing yet; call :meth:`reset`.

        Args:
            localizer: the stack's.
            make_route: plans from a pose to another one.
            people: where they truly are; None: the policy does not see them.
            look: takes a picture; None: there is no camera.
        """
        self._localizer = localizer
        self._make_route = make_route
        self._people = people
        self._look = look

    def reset(self, goal: Pose2D, belief: Belief, generators: Generators) -> None:
        """Start a delivery."""
        self._localizer.reset(belief, generators.localizer)
        self.belief, self.stamp = belief, 0.0
        self.plan = self._make_route(belief.pose, goal, generators.planner)
        self._goal, self._route = goal, Route(self.plan)
        self.odometry = Odometry(0.0, Pose2D(), Twist2D())
        self._scan = _NO_SCAN

    def take_in(self, observation: Observation) -> None:
        """Take in what arrived since the last call."""
        self.belief = checked_belief(self._localizer.update(observation), self._localizer)
        self.stamp = observation.stamp
        if observation.odometry is not None:
            self.odometry = observation.odometry
        if observation.scan is not None:
            self._scan = observation.scan

    def view(self) -> PolicyObservation:
        """What a policy sees now."""
        scan, pose, twist = self._scan, self.belief.pose, self.odometry.twist
        angles: FloatArray = scan.angle_min + scan.angle_increment * np.arange(
            len(scan.ranges), dtype=np.float64
        )
        return PolicyObservation(
            stamp=self.stamp,
            goal=relative_to(pose, self._goal).as_array(),
            route=self._route.ahead(pose),
            pose=pose.as_array(),
            velocity=np.array((twist.linear_x, twist.angular_z)),
            ranges=np.minimum(scan.ranges, scan.range_max),
            angles=angles,
            people=_NOBODY if self._people is None else _in_frame(*self._people()),
            image=_NO_IMAGE if self._look is None else self._look(),
        )


def _in_frame(frame: Pose2D, people: FloatArray) -> FloatArray:
    """People who are there (m, 4), nearest first, in a frame of the map."""
    there = people[np.isfinite(people[:, 0])]
    places = points_relative_to(frame, there[:, :2])
    velocities = there[:, 2:] @ rotation(frame.yaw)
    nearest_first = np.argsort((places**2).sum(axis=1), kind="stable")
    return np.column_stack((places, velocities))[nearest_first]
