"""Jerk-limited model predictive control: this project's own controller plugin."""

import math
from typing import NamedTuple

import numpy as np

from navstack.control.controller import Controller, Surroundings, finite, limited_speed
from navstack.control.decision import CriticScore, DecisionRecord
from navstack.control.mpc import stage_layout as at
from navstack.control.mpc.command_guard import STRAIGHTEN, RobotOutline, guarded, stopped
from navstack.control.mpc.distance_field import DistanceField, distance_table
from navstack.control.mpc.motion import A, V, rollout, shifted
from navstack.control.mpc.path_line import PathLine, at_distance, between, make_line, project
from navstack.control.mpc.people import nearest_people
from navstack.control.mpc.problem_numbers import bounds_of, limits_of, weights_of
from navstack.control.mpc.stage_layout import Horizon, Sizes
from navstack.control.mpc.stages import (
    Clearances,
    Wishes,
    cost_terms,
    fill_obstacles,
    fill_people,
    fill_stages,
)
from navstack.control.plan_handling import require_poses
from navstack.geometry import cover, footprint_radii, shortest_angular_distance
from navstack.jit import tuple_of
from navstack.params.mpc import MpcParams
from navstack.types import FloatArray, Path, RobotState, Twist2D

NAME = "JerkLimitedMPC"
_BOUND_SPEED = 2 + V  # place of the speed in the bounds: the jerks come first
# segments of the line before and behind the robot's, in which it is looked for
_BEHIND = 10
_BEYOND = 30
_SIGHT = 0.5  # [m] ahead on the line, whose direction decides about a turn on the spot
_AT_END = 0.02  # [m] left of the line, within which the robot has arrived
_STALE = 0.5  # [s] after which the last solution is of no use
_FIRST_STEPS = 5  # solver steps where there is no last solution


class _Cycle(NamedTuple):
    """What a decision record is made of."""

    start: FloatArray  # (7,)
    jerks: FloatArray | None  # (N, 2); None: the solver failed
    command: Twist2D
    status: str
    share: float  # of the stop in the command


class JerkLimitedMpcController(Controller):
    """Plans three seconds of jerk along the path in every cycle and commands the first of them.

    What is commanded lies within all limits, and the robot can stop from it (:mod:`command_guard`).
    Where the solver fails the robot brakes as its limits allow; :attr:`failures` counts that.
    """

    wants_tracks = True

    def __init__(
        self,
        params: MpcParams,
        footprint: FloatArray,
        controller_frequency: float,
        xy_goal_tolerance: float = 0.25,
    ) -> None:
        """Make the controller.

        Args:
            params: its parameters.
            footprint: padded polygon (V, 2) in [m], base frame.
            controller_frequency: control cycles per second, in [Hz].
            xy_goal_tolerance: of the goal checker in [m], within half of which the robot turns to
                the goal's yaw.
        """
        # CasADi takes a quarter of a second to load
        from navstack.control.mpc.mpc_problem import MpcProblem

        self._params = params
        self._footprint = np.ascontiguousarray(footprint)
        self._period = 1.0 / controller_frequency  # [s]
        self._goal_radius = 0.5 * xy_goal_tolerance  # [m]
        self._circles, radius = cover(footprint, params.footprint_circles)
        self._keep: Clearances = tuple_of(Clearances, params, radius=radius)
        self._inscribed_radius = footprint_radii(footprint)[0]
        self._table = distance_table(self._inscribed_radius, params.inflation_cost_scaling_factor)
        self._limits = limits_of(params)
        self._bounds = bounds_of(params)
        sizes = Sizes(params.horizon, params.footprint_circles, params.max_tracks)
        times = np.full(sizes.steps, params.step)  # [s]
        times[0] = self._period
        shared = np.concatenate(
            (weights_of(params), (params.max_lateral_acceleration,), self._circles)
        )
        self._horizon = Horizon(np.zeros((sizes.steps, sizes.stage)), times, shared)
        self._solver = MpcProblem(sizes, params.generated_code)
        self._speed = params.max_speed  # [m/s] within the speed limit
        self.failures = 0  # solves that failed since the controller was made
        self.reset()

    def reset(self) -> None:
        """See the base class."""
        self._plan: Path | None = None
        self._line: PathLine | None = None
        self._segment = 0  # of the line, at which the robot is
        self._stamp = -math.inf  # [s] of the last cycle
        self._motion = np.zeros(4)  # commanded last: v, omega, a, alpha
        self._stop = STRAIGHTEN  # the kind of stop found last
        self._jerks = np.zeros((len(self._horizon.times), 2))  # of the last solution
        self._turning = self._at_goal = False
        self._cycle: _Cycle | None = None  # the last

    def resume(self) -> None:
        """See the base class: the odometry counts, and the last solution is of no use."""
        self._stamp = -math.inf

    @property
    def decision(self) -> DecisionRecord | None:
        """See the base class: the cost terms of the solution, raw and weighted.

        A stop mixed in is a rejection.
        """
        cycle = self._cycle
        if cycle is None:
            return None
        rejected = int(cycle.share > 0.0)
        if cycle.jerks is None:
            return DecisionRecord(
                self._stamp, NAME, cycle.command, 1, rejected, status=cycle.status
            )
        raw = cost_terms(
            rollout(cycle.start, cycle.jerks, self._horizon.times), cycle.jerks, self._horizon
        )
        weighted = raw * self._horizon.shared[: len(raw)]
        scores = tuple(
            CriticScore(name, float(one), float(other), 0)
            for name, one, other in zip(at.TERMS, raw, weighted, strict=True)
        )
        total = float(weighted.sum())
        return DecisionRecord(
            self._stamp, NAME, cycle.command, 1, rejected, total, scores, cycle.status
        )

    def set_speed_limit(self, limit: float, is_percentage: bool) -> None:
        """Want no more than ``limit`` [m/s], or [%] of the largest speed, from now on.

        0 lifts the limit.
        """
        largest = self._params.max_speed
        self._speed = min(largest, limited_speed(largest, limit, is_percentage))

    def compute_velocity(
        self, state: RobotState, plan: Path, surroundings: Surroundings
    ) -> Twist2D:
        """The first motion of the best trajectory, or of a stop.

        Raises:
            InvalidPathError: the plan is empty.
        """
        if plan is not self._plan:
            self._take(plan, state)
        start = self._start(state)
        self._limit_speed(start)
        people = nearest_people(
            surroundings.tracks, state.pose, state.stamp, self._params.max_tracks
        )
        field = DistanceField(
            surroundings.costmap.data,
            surroundings.costmap.grid,
            self._table,
            self._inscribed_radius,
        )
        line = self._line
        assert line is not None
        wishes = self._wishes(start, line)
        jerks = self._solve(start, line, wishes, field, people, state.stamp)
        if jerks is None:
            self.failures += 1
            motion = stopped(
                start[3], start[4], start[5], start[6], self._stop, self._limits, self._period
            )
            share = 1.0
            status = "failed"
            self._jerks = np.zeros_like(self._jerks)
        else:
            body = RobotOutline(self._footprint, self._circles, self._keep.radius)
            wanted = (jerks[0, 0], jerks[0, 1], self._period)
            motion, self._stop, share = guarded(
                start, *wanted, self._limits, self._stop, field, body, people
            )
            status = "guarded"
            if share == 0.0:
                status = "solved"
            self._jerks = jerks
        self._motion = motion
        self._stamp = state.stamp
        command = Twist2D(float(motion[0]), 0.0, float(motion[1]))
        self._cycle = _Cycle(start, jerks, command, status, share)
        return command

    def _take(self, plan: Path, state: RobotState) -> None:
        """Begin with a new plan."""
        require_poses(plan)
        self._plan = plan
        self._line = make_line(plan.poses, limits_of(self._params))
        self._segment = project(self._line, state.pose.x, state.pose.y, 0, len(self._line.x))[0]

    def _start(self, state: RobotState) -> FloatArray:
        """The state (7,) from which to plan.

        The pose believed and the motion commanded, which no noise disturbs.

        Where the odometry says something very different, or the robot has been driven by someone
        else, that counts; what is not finite of it is 0.
        """
        v, omega, a, alpha = self._motion.tolist()
        measured = state.twist
        off = max(abs(measured.linear_x - v), abs(measured.angular_z - omega))
        if off > self._params.velocity_mismatch or not state.stamp - self._stamp < _STALE:
            v = min(max(finite(measured.linear_x), 0.0), self._params.max_speed)
            most = self._params.max_yaw_rate
            omega = min(max(finite(measured.angular_z), -most), most)
            lateral = self._params.max_lateral_acceleration
            if v * abs(omega) > lateral:
                omega = math.copysign(lateral / v, omega)
            self._motion = np.array((v, omega, 0.0, 0.0))
            a = alpha = 0.0
            self._stop = STRAIGHTEN
        return np.array((state.pose.x, state.pose.y, state.pose.yaw, v, omega, a, alpha))

    def _limit_speed(self, start: FloatArray) -> None:
        """Bound the speed by the limit that is set, or by the least that can be reached."""
        peak = start[V] + max(0.0, start[A]) ** 2 / (2.0 * self._params.max_jerk)
        largest = min(self._params.max_speed, max(self._speed, peak))
        self._limits[at.MAX_SPEED] = self._bounds[1, _BOUND_SPEED] = largest

    def _wishes(self, start: FloatArray, line: PathLine) -> Wishes:
        """Follow the line, turn to it on the spot, or turn to the goal's yaw at its end."""
        assert self._plan is not None
        x, y, yaw = (float(value) for value in start[:3])
        first = max(0, self._segment - _BEHIND)
        last = self._segment + _BEYOND
        self._segment, share = project(line, x, y, first, last)
        s = between(line.s, self._segment, share)
        goal_x, goal_y, goal_yaw = (float(value) for value in self._plan.poses[-1])
        distance = math.hypot(goal_x - x, goal_y - y)
        radius = self._goal_radius * (1 + self._at_goal)  # twice as far to leave it
        self._at_goal = line.s[-1] - s < _AT_END or distance < radius
        if self._at_goal:
            return Wishes(self._speed, goal_yaw, self._params.max_lag)
        segment, share = at_distance(line, s + _SIGHT)
        off = abs(shortest_angular_distance(yaw, between(line.heading, segment, share)))
        threshold = self._params.turn_threshold / (1 + self._turning)  # half as much to end it
        self._turning = off > threshold
        return Wishes(self._speed * (not self._turning), math.nan, self._params.max_lag)

    def _solve(
        self,
        start: FloatArray,
        line: PathLine,
        wishes: Wishes,
        field: DistanceField,
        people: FloatArray,
        stamp: float,
    ) -> FloatArray | None:
        """The jerks (N, 2) of the best trajectory found; None: the solver failed."""
        elapsed = stamp - self._stamp
        times = self._horizon.times
        jerks = np.zeros_like(self._jerks)
        steps = _FIRST_STEPS
        if elapsed < _STALE:
            jerks = shifted(self._jerks, times, elapsed)
            steps = 1
        for _ in range(steps):
            states = rollout(start, jerks, times)
            fill_stages(self._horizon, states, line, self._segment, wishes, self._limits)
            fill_obstacles(self._horizon, states, field, people, self._keep)
            fill_people(self._horizon, people, self._keep)
            improved = self._solver.step(states, jerks, self._horizon, self._bounds)
            if improved is None:
                return None
            jerks = improved
        return jerks
