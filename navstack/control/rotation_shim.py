"""Turn towards a new plan on the spot before another controller follows it."""

import math

import numpy as np

from navstack.control.controller import Controller, Surroundings
from navstack.control.decision import Alternative, DecisionRecord, Option
from navstack.control.footprint_cost import footprint_cost
from navstack.control.turn_in_place import turn_by
from navstack.costmap.costmap import NO_INFORMATION, Costmap
from navstack.geometry import relative_to, shortest_angular_distance
from navstack.params.rotation_shim import RotationShimParams
from navstack.types import FloatArray, Path, Pose2D, RobotState, Twist2D


class RotationShimController(Controller):
    """``nav2_rotation_shim_controller::RotationShimController`` of Nav2 Jazzy.

    Each new plan makes it look at the heading once more, until the heading is right or turning
    would collide; from then on the primary controller drives, until the next plan. (Nav2 main
    decides in every cycle: the same as a new plan in every cycle here.)
    """

    def __init__(
        self,
        params: RotationShimParams,
        primary: Controller,
        footprint: FloatArray,
        controller_frequency: float,
        xy_goal_tolerance: float,
    ) -> None:
        """Make the shim.

        Args:
            params: thresholds and limits of the turn.
            primary: the controller that follows the path.
            footprint: padded polygon (V, 2) in [m], base frame.
            controller_frequency: control cycles per second, in [Hz].
            xy_goal_tolerance: of the goal checker in [m]; only ``rotate_to_goal_heading`` asks for
                it.
        """
        self._params = params
        self._primary = primary
        self.wants_tracks = primary.wants_tracks
        self.acts_at_rest = primary.acts_at_rest
        self._footprint = footprint
        self._period = 1.0 / controller_frequency  # [s]
        self._xy_goal_tolerance = xy_goal_tolerance
        self._forget_navigation()
        self.reset()

    def seed(self, rng: np.random.Generator) -> None:
        """See the base class; what attempts leave to later ones is forgotten."""
        self._primary.seed(rng)
        self._forget_navigation()

    def reset(self) -> None:
        """Forget the last command and everything the primary controller remembers.

        As upstream, a turn and the last plan's goal outlive the attempt.
        """
        self._plan: Path | None = None  # of this attempt
        self._heading_is_open = False  # the plan's heading is still to be looked at
        self._at_goal = False
        self._last_yaw_rate = 0.0  # [rad/s] commanded
        # of the last cycle; None: the primary controller decided
        self._turn: DecisionRecord | None = None
        self._primary.reset()

    def resume(self) -> None:
        """See the base class: turns begin at rest."""
        self._last_yaw_rate = 0.0
        self._primary.resume()

    @property
    def decision(self) -> DecisionRecord | None:
        """See the base class: a turn of its own, or what the primary controller says."""
        return self._turn or self._primary.decision

    @property
    def alternatives(self) -> tuple[Alternative, ...]:
        """Those of the primary controller; a turn of its own has none."""
        if self._turn:
            return ()
        return self._primary.alternatives

    @property
    def options(self) -> tuple[Option, ...]:
        """Those of the primary controller; a turn of its own has none."""
        if self._turn:
            return ()
        return self._primary.options

    def set_speed_limit(self, limit: float, is_percentage: bool) -> None:
        """For the primary controller only: turns on the spot keep their speed, as upstream."""
        self._primary.set_speed_limit(limit, is_percentage)

    def compute_velocity(
        self, state: RobotState, plan: Path, surroundings: Surroundings
    ) -> Twist2D:
        """A turn on the spot, or the primary controller's command.

        Raises:
            ControlError: the primary controller cannot follow the plan.
        """
        if plan is not self._plan:
            self._begin(plan)
        command = self._turn_to_goal(state, plan, surroundings) or self._turn_to_plan(
            state, plan, surroundings
        )
        self._turn = None
        if command is None:
            self._turning = False
            command = self._primary.compute_velocity(state, plan, surroundings)
        else:
            self._turn = DecisionRecord(state.stamp, "RotationShimController", command)
        self._last_yaw_rate = command.angular_z
        return command

    def _forget_navigation(self) -> None:
        self._turning = False
        self._goal = np.empty((0, 3))  # (1, 3) the last plan's last pose; (0, 3): there is none

    def _begin(self, plan: Path) -> None:
        same_goal = np.array_equal(self._goal, plan.poses[-1:])
        once = self._params.rotate_to_heading_once
        self._heading_is_open = not (once and same_goal and not self._turning)
        self._plan = plan
        self._goal = plan.poses[-1:]
        self._at_goal = False

    def _turn_to_goal(
        self, state: RobotState, plan: Path, surroundings: Surroundings
    ) -> Twist2D | None:
        """The turn to the goal's yaw once within its tolerance, remembered until the next plan."""
        if not self._params.rotate_to_goal_heading or len(plan) == 0:
            return None
        x, y, yaw = map(float, plan.poses[-1])
        self._at_goal = (
            self._at_goal
            or math.hypot(x - state.pose.x, y - state.pose.y) <= self._xy_goal_tolerance
        )
        if not self._at_goal:
            return None
        return self._safe_turn(
            shortest_angular_distance(state.pose.yaw, yaw), state, surroundings.costmap
        )

    def _turn_to_plan(
        self, state: RobotState, plan: Path, surroundings: Surroundings
    ) -> Twist2D | None:
        """The turn to the plan's heading, while that is open and off by more than the threshold."""
        if not self._heading_is_open or len(plan) < 2:
            return None
        error = self._heading_error(state.pose, plan)
        threshold = self._params.angular_dist_threshold
        if self._turning:
            threshold = self._params.angular_disengage_threshold
        if abs(error) > threshold:
            self._turning = True
            command = self._safe_turn(error, state, surroundings.costmap)
            if command is not None:
                return command
        self._heading_is_open = False
        return None

    def _heading_error(self, pose: Pose2D, plan: Path) -> float:
        """Turn [rad] to the plan's point ``forward_sampling_distance`` from its start."""
        dx = plan.poses[1:, 0] - plan.poses[0, 0]
        dy = plan.poses[1:, 1] - plan.poses[0, 1]
        far = dx * dx + dy * dy >= self._params.forward_sampling_distance**2
        index = -1
        if far.any():
            index = 1 + int(far.argmax())
        sampled = Pose2D(*map(float, plan.poses[index]))
        if self._params.use_path_orientations:
            return shortest_angular_distance(pose.yaw, sampled.yaw)
        seen = relative_to(pose, sampled)
        return math.atan2(seen.y, seen.x)

    def _safe_turn(self, error: float, state: RobotState, costmap: Costmap) -> Twist2D | None:
        """The turn by ``error`` [rad] within the limits; None if it would collide."""
        yaw_rate = self._last_yaw_rate
        if self._params.closed_loop:
            yaw_rate = state.twist.angular_z
        command = turn_by(error, yaw_rate, self._params, self._period)
        if self._collides(command.angular_z, error, state.pose, costmap):
            return None
        return command

    def _collides(
        self,
        yaw_rate: float,
        error: float,
        pose: Pose2D,
        costmap: Costmap,
    ) -> bool:
        """Whether the outline meets unknown cells or too high costs up to the engaging threshold.

        As upstream, the way is measured from the simulated yaw back to the present one: only a
        clockwise turn stops looking at the threshold, the other direction looks
        ``simulate_ahead_time`` ahead whenever there is one.
        """
        remaining = abs(error) - self._params.angular_dist_threshold
        time = 0.0
        while time < self._params.simulate_ahead_time:
            time += self._period
            yaw = pose.yaw + yaw_rate * time
            if shortest_angular_distance(yaw, pose.yaw) >= remaining:
                return False
            cost = footprint_cost(costmap, self._footprint, Pose2D(pose.x, pose.y, yaw))
            if cost == NO_INFORMATION or cost >= self._params.max_cost_threshold:
                return True
        return False
