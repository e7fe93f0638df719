"""The graceful controller, after nav2_graceful_controller (Jazzy); Park and Kuipers, ICRA 2011."""

import math

import numpy as np

from navstack.control.controller import Controller, Surroundings, limited_share
from navstack.control.decision import CriticScore, DecisionRecord
from navstack.control.graceful.control_law import (
    Law,
    LocalGround,
    can_turn,
    drive_to,
    turn_on_the_spot,
)
from navstack.control.path_window import PathWindow
from navstack.errors import NoLegalVelocity
from navstack.geometry import normalize_angle
from navstack.jit import tuple_of
from navstack.params.graceful import GracefulParams
from navstack.types import FloatArray, Path, RobotState, Twist2D

COLLISION_AHEAD = "collision ahead"  # the only thing that rejects a target
SAME_YAW = 1e-6  # [rad]


class GracefulController(Controller):
    """Drives to the farthest pose on the path that a smooth control law reaches freely."""

    def __init__(
        self,
        params: GracefulParams,
        footprint: FloatArray,
        controller_frequency: float,
        xy_goal_tolerance: float = 0.25,
    ) -> None:
        """Make the controller.

        Args:
            params: its parameters.
            footprint: padded polygon (V, 2) in [m], base frame.
            controller_frequency: control cycles per second, in [Hz]; nothing here depends on it.
            xy_goal_tolerance: of the goal checker in [m], within which the robot turns to the
                goal's yaw.
        """
        self._params = params
        self._footprint = footprint
        self._xy_goal_tolerance = xy_goal_tolerance
        self._window = PathWindow(params.max_robot_pose_search_dist, fewest_poses=1)
        self._law = _law(params, 1.0)
        self.reset()

    def reset(self) -> None:
        """Forget everything about the previous goal."""
        self._plan: Path | None = None
        self._at_goal = False
        self._turns_first = True
        self._decision = None

    def set_speed_limit(self, limit: float, is_percentage: bool) -> None:
        """Limit the speed to ``limit`` [m/s], or [%] of the largest; 0 lifts the limit.

        Turns slow down alike.
        """
        share = limited_share(self._params.v_linear_max, limit, is_percentage)
        self._law = _law(self._params, share)

    def compute_velocity(
        self, state: RobotState, plan: Path, surroundings: Surroundings
    ) -> Twist2D:
        """The command towards a pose on the path, or a turn on the spot.

        Raises:
            InvalidPathError: the plan is empty or nowhere near the robot.
            NoLegalVelocity: the way to each pose on the path leads into an obstacle.
        """
        if plan is not self._plan:
            self._plan = plan
            self._at_goal = False
            self._turns_first = True
            self._window.reset()
        path = self._window.seen_from(state.pose, plan, surroundings.costmap)
        add_orientations(path)
        lengths = np.hypot(*np.diff(path[:, :2], axis=0).T)
        costmap = surroundings.costmap
        pose = (state.pose.x, state.pose.y, state.pose.yaw)
        is_round = self._params.local_costs.is_round
        ground = LocalGround(costmap.data, costmap.grid, self._footprint, is_round, pose)
        command = self._turn_at_goal(path, float(lengths.sum()), ground)
        tried = 1
        rejected = 0
        if command is None:
            distances = np.cumsum([math.hypot(*path[0, :2]), *lengths])
            command, tried = self._drive(path, distances, ground)
            rejected = tried - (command is not None)
        check = CriticScore(COLLISION_AHEAD, None, None, rejected)
        self._decision = DecisionRecord(
            state.stamp,
            "GracefulController",
            command or Twist2D(),
            max(tried, 1),
            rejected,
            scores=(check,),
        )
        if command is None:
            raise NoLegalVelocity({COLLISION_AHEAD: rejected})
        return command

    def _turn_at_goal(self, path: FloatArray, rest: float, ground: LocalGround) -> Twist2D | None:
        """The turn to the goal's yaw; None: the robot is not at the goal, or cannot turn there."""
        self._at_goal = self._at_goal or rest < self._xy_goal_tolerance
        if not self._at_goal:
            return None
        angle = float(path[-1, 2])
        looks = max(int(abs(angle) / self._params.in_place_collision_resolution), 1)
        if self._params.use_collision_detection and not can_turn(angle, looks, ground):
            return None
        return Twist2D(angular_z=turn_on_the_spot(angle, self._law))

    def _drive(
        self, path: FloatArray, distances: FloatArray, ground: LocalGround
    ) -> tuple[Twist2D | None, int]:
        """The command to the farthest pose (N, 3) in reach, and how many poses were tried.

        ``distances`` (N,) [m] are along the path. None: there is an obstacle on the way to each, or
        no pose is far enough away.
        """
        params = self._params
        tried = 0
        ends = distances[-1] - distances[0] < params.max_lookahead
        for i in range(len(path) - 1, -1, -1):
            if distances[i] > params.max_lookahead:
                continue
            if not ends and distances[i] < params.min_lookahead:
                break
            x, y, yaw = path[i].tolist()
            bearing = math.atan2(y, x)
            if ends and params.prefer_final_rotation:
                yaw = bearing  # no sweeping turns at the end
            backward = params.may_reverse and x < 0.0
            if backward:
                yaw = normalize_angle(yaw + math.pi)
            if abs(bearing) < params.initial_rotation_tolerance:
                self._turns_first = False
            tried += 1
            turns_first = self._turns_first and params.initial_rotation
            is_free, speed, turn = drive_to(
                (x, y, yaw),
                backward,
                turns_first,
                params.use_collision_detection,
                self._law,
                ground,
            )
            if is_free:
                return Twist2D(speed, 0.0, turn), tried
        return None, tried


def add_orientations(path: FloatArray) -> None:
    """Point each pose (N, 3) at the next one, in place, where the path has no headings.

    All poses between the first and the last have the same yaw then.
    """
    # as upstream: a turn the other way does not count
    if len(path) < 3 or any(normalize_angle(path[1, 2] - yaw) > SAME_YAW for yaw in path[2:-1, 2]):
        return
    steps = np.diff(path[:, :2], axis=0)
    path[:-1, 2] = np.arctan2(steps[:, 1], steps[:, 0])


def _law(params: GracefulParams, share: float) -> Law:
    """The control law at a share of the largest velocities; the least speed stays."""
    law: Law = tuple_of(Law, params)
    fastest = max(share * params.v_linear_max, params.v_linear_min)
    return law._replace(v_linear_max=fastest, v_angular_max=share * params.v_angular_max)
