"""One attempt to follow a plan: controller, checkers and patience, after nav2_controller::ControllerServer."""

from navstack.control.controller import Controller, Surroundings
from navstack.control.goal_checker import GoalChecker
from navstack.control.progress_checker import ProgressChecker
from navstack.errors import ControlError, InvalidPathError, NoProgressError
from navstack.params.servers import ControllerServerParams
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
        self._controller = controller
        self._goal_checker = goal_checker
        self._progress_checker = progress_checker
        self._plan: Path | None = None
        self._last_valid = 0.0  # [s] when the controller last found a command

    def reset(self) -> None:
        """Forget the goal and everything learnt on the way to it."""
        self._plan = None
        self._controller.reset()
        self._goal_checker.reset()
        self._progress_checker.reset()

    def begin(self, plan: Path, now: float) -> None:
        """Start a new attempt, as a new FollowPath action does."""
        self.reset()
        self.set_plan(plan)
        self._last_valid = now

    def begin_again(self, now: float) -> None:
        """Start another attempt with the same plan."""
        if self._plan is not None:
            self.begin(self._plan, now)

    def set_plan(self, plan: Path) -> None:
        """Take over a newer plan to the same goal."""
        self._plan = plan

    def goal_reached(self, state: RobotState) -> bool:
        """Whether the plan's last pose is reached, as the goal checker sees it."""
        if self._plan is None or len(self._plan) == 0:
            return False
        goal = Pose2D(*self._plan.poses[-1].tolist())
        return self._goal_checker.is_goal_reached(state.pose, goal, self._thresholded(state.twist))

    def compute_command(self, state: RobotState, surroundings: Surroundings) -> Twist2D:
        """The command of this cycle; standstill while the controller fails within its tolerance.

        Raises:
            ControlError: no plan, no progress, or no command for longer than ``failure_tolerance``.
        """
        if self._plan is None or len(self._plan) == 0:
            raise InvalidPathError("there is no plan to follow")
        if not self._progress_checker.check(state.pose, state.stamp):
            raise NoProgressError("the robot has not moved as far as the progress checker requires")
        measured = RobotState(state.pose, self._thresholded(state.twist), state.stamp)
        try:
            command = self._controller.compute_velocity(measured, self._plan, surroundings)
        except ControlError:
            if self._out_of_patience(state.stamp):
                raise
            return Twist2D()
        self._last_valid = state.stamp
        return command

    def _out_of_patience(self, now: float) -> bool:
        tolerance = self._params.failure_tolerance  # [s]; 0: none, -1: endless
        return tolerance >= 0.0 and now - self._last_valid > tolerance

    def _thresholded(self, twist: Twist2D) -> Twist2D:
        """Velocities below their thresholds count as zero (ControllerServer::getThresholdedTwist)."""
        params = self._params
        return Twist2D(
            twist.linear_x if abs(twist.linear_x) > params.min_x_velocity_threshold else 0.0,
            twist.linear_y if abs(twist.linear_y) > params.min_y_velocity_threshold else 0.0,
            twist.angular_z if abs(twist.angular_z) > params.min_theta_velocity_threshold else 0.0,
        )
