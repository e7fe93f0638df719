"""One attempt to follow a plan, after nav2_controller::ControllerServer."""

import numpy as np

from navstack.control.controller import Controller, Surroundings
from navstack.control.decision import DecisionRecord
from navstack.control.goal_checker import GoalChecker
from navstack.control.progress_checker import ProgressChecker
from navstack.errors import (
    ControlError,
    InvalidPathError,
    NoLegalVelocity,
    NoProgressError,
    PatienceExceededError,
)
from navstack.params.servers import ControllerServerParams
from navstack.plugin_answers import checked_command
from navstack.stopwatch import Stopwatch
from navstack.types import Path, Pose2D, RobotState, Twist2D


class ControllerServer:
    """Runs the controller once per control cycle until the goal is reached or patience ends."""

    def __init__(
        self,
        params: ControllerServerParams,
        controller: Controller,
        goal_checker: GoalChecker,
        progress_checker: ProgressChecker,
    ) -> None:
        self._params = params
        self.controller = controller
        self._goal_checker = goal_checker
        self._progress_checker = progress_checker
        self.plan: Path | None = None  # what is followed
        self._goal: Pose2D | None = None  # the plan's last pose; None: it has none
        self._last_valid = 0.0  # [s] when the controller last found a command
        self._failed_decision: DecisionRecord | None = None
        self.stopwatch = Stopwatch()  # of the controller's cycles, over all attempts at a goal

    def reset(self, rng: np.random.Generator) -> None:
        """Forget the goal and everything learnt on the way to it.

        The controller draws all random numbers from ``rng``.
        """
        self.stopwatch.clear()
        self.controller.seed(rng)
        self._failed_decision = None
        self._forget_attempt()

    def begin(self, plan: Path, now: float) -> None:
        """Start a new attempt, as a new FollowPath action does."""
        self._forget_attempt()
        self.set_plan(plan)
        self._last_valid = now

    def begin_again(self, now: float) -> None:
        """Start another attempt with the same plan."""
        if self.plan is not None:
            self.begin(self.plan, now)

    def resume(self, now: float) -> None:
        """Go on after a time in which no command was asked for.

        Neither progress nor patience counts it.
        """
        self.controller.resume()
        self._progress_checker.reset()
        self._last_valid = now

    def set_plan(self, plan: Path) -> None:
        """Take over a newer plan to the same goal.

        The goal checker starts afresh (``setPlannerPath``).
        """
        self.plan = plan
        self._goal = None
        if len(plan):
            self._goal = Pose2D(*plan.poses[-1].tolist())
        self._goal_checker.reset()
        self._goal_checker.set_plan(plan)

    @property
    def decision(self) -> DecisionRecord | None:
        """How the controller decided when it was last asked; None: it does not tell."""
        return self.controller.decision or self._failed_decision

    def goal_reached(self, state: RobotState) -> bool:
        """Whether the plan's last pose is reached, as the goal checker sees it."""
        if self._goal is None:
            return False
        return self._goal_checker.is_goal_reached(
            state.pose, self._goal, self._thresholded(state.twist)
        )

    def compute_command(
        self, state: RobotState, surroundings: Surroundings, expects_progress: bool = True
    ) -> Twist2D:
        """The command of this cycle; standstill while the controller fails within its tolerance.

        Raises:
            ControlError: no plan, no progress, no command for longer than ``failure_tolerance``, or
                at once what more attempts would not cure.
        """
        if self.plan is None or self._goal is None:
            raise InvalidPathError("there is no plan to follow")
        on_the_way = not expects_progress or self._progress_checker.check(
            state.odom_pose, state.stamp
        )
        if not on_the_way:  # measured as with local_costmap.global_frame: odom
            raise NoProgressError("the robot has not moved as far as the progress checker requires")
        measured = RobotState(
            state.pose,
            self._thresholded(state.twist),
            state.stamp,
            state.odom_pose,
            state.position_std,
        )
        try:
            with self.stopwatch:
                command = self.controller.compute_velocity(measured, self.plan, surroundings)
            command = checked_command(command, self.controller)
        except ControlError as error:
            # before a new attempt makes the controller forget it
            self._failed_decision = self.controller.decision
            if error.code != NoLegalVelocity.code:
                raise
            self._be_patient(error, state.stamp)
            return Twist2D()
        self._last_valid = state.stamp
        return command

    def _forget_attempt(self) -> None:
        self.plan = self._goal = None
        self.controller.reset()
        self._goal_checker.reset()
        self._progress_checker.reset()

    def _be_patient(self, error: ControlError, now: float) -> None:
        """Put up with a lack of commands for ``failure_tolerance``."""
        # [s]; -1: endless; 0 or otherwise negative: none
        tolerance = self._params.failure_tolerance
        if tolerance == -1.0:
            return
        if tolerance <= 0.0:
            raise error
        if now - self._last_valid > tolerance:
            raise PatienceExceededError(
                f"no command for more than {tolerance:g} s; last reason: {error}"
            ) from error

    def _thresholded(self, twist: Twist2D) -> Twist2D:
        """Velocities below their thresholds count as zero (``getThresholdedTwist``)."""
        params = self._params
        return Twist2D(
            _beyond(params.min_x_velocity_threshold, twist.linear_x),
            _beyond(params.min_y_velocity_threshold, twist.linear_y),
            _beyond(params.min_theta_velocity_threshold, twist.angular_z),
        )


def _beyond(threshold: float, velocity: float) -> float:
    """A velocity, or 0 up to the threshold."""
    if abs(velocity) > threshold:
        return velocity
    return 0.0
