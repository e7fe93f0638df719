"""Goals reached along the path and across it (``axis_goal_checker.cpp`` of Nav2 main)."""

import math

import numpy as np

from navstack.control.goal_checker import GoalChecker
from navstack.params.checkers import AxisGoalCheckerParams
from navstack.types import FloatArray, Pose2D, Twist2D

AT_GOAL = 1e-6  # [m] from the goal, nearer than which it counts as reached


class AxisGoalChecker(GoalChecker):
    """Position within one tolerance along the end of the path and another across it."""

    def __init__(self, params: AxisGoalCheckerParams) -> None:
        self._params = params

    def reset(self) -> None:
        """Nothing is remembered but the plan."""

    def is_goal_reached(self, pose: Pose2D, goal: Pose2D, velocity: Twist2D) -> bool:
        """See the base class; the heading and the velocity do not matter."""
        params = self._params
        if self._remaining(pose) > params.path_length_tolerance:
            return False
        away = np.array([goal.x - pose.x, goal.y - pose.y])
        distance = math.hypot(*away)
        direction = self._direction(goal)
        if direction is None:
            return distance < params.xy_goal_tolerance
        if distance < AT_GOAL:
            return True
        along = float(away @ direction)
        across = float(direction[0] * away[1] - direction[1] * away[0])
        if not params.is_overshoot_valid:
            along = abs(along)
        return along < params.along_path_tolerance and abs(across) < params.cross_track_tolerance

    def _direction(self, goal: Pose2D) -> FloatArray | None:
        """The unit vector (2,) to the goal from the last pose that is far enough from it."""
        to_goal = np.array([goal.x, goal.y]) - self._plan[:-1, :2]
        lengths = np.hypot(to_goal[:, 0], to_goal[:, 1])
        far = np.flatnonzero(lengths >= self._params.direction_estimation_distance)
        if not far.size:
            return None
        return np.asarray(to_goal[far[-1]] / lengths[far[-1]])

    def _remaining(self, pose: Pose2D) -> float:
        """The length in [m] of the plan from the pose nearest to the robot."""
        if len(self._plan) < 2:
            return 0.0
        places = self._plan[:, :2]
        nearest = int(np.argmin(np.hypot(places[:, 0] - pose.x, places[:, 1] - pose.y)))
        return float(np.hypot(*np.diff(places[nearest:], axis=0).T).sum())
