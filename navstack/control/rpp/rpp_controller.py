"""Regulated pure pursuit, after nav2_regulated_pure_pursuit_controller (Jazzy).

Macenski et al., arXiv:2305.20026.
"""

import math

from navstack.control.controller import Controller, Surroundings, limited_speed
from navstack.control.decision import CriticScore, DecisionRecord
from navstack.control.path_window import PathWindow
from navstack.control.rpp.arc_check import ArcCheck
from navstack.control.rpp.dynamic_window import best_velocity, reachable, regulated
from navstack.control.rpp.lookahead import (
    arc_curvature,
    distance_to_cusp,
    lookahead_point,
    lookahead_point_on_circle,
)
from navstack.control.rpp.regulation import speed_in_curve, speed_near_obstacle, speed_on_approach
from navstack.control.turn_in_place import turn_by
from navstack.costmap.costmap import Costmap
from navstack.errors import ControlError, NoLegalVelocity
from navstack.geometry import footprint_radii, normalize_angle
from navstack.params.rpp import RppParams
from navstack.types import FloatArray, Path, Pose2D, RobotState, Twist2D

COLLISION_AHEAD = "collision ahead"  # the only thing that rejects a command


class RegulatedPurePursuitController(Controller):
    """Drives along the arc to a point ahead on the path, the carrot.

    It is slower in curves, near obstacles and at the end. Where a goal is cancelled there is no
    later command here, so that ``use_cancel_deceleration`` has no meaning.
    """

    def __init__(
        self,
        params: RppParams,
        footprint: FloatArray,
        controller_frequency: float,
        xy_goal_tolerance: float = 0.25,
    ) -> None:
        """Make the controller.

        Args:
            params: its parameters.
            footprint: padded polygon (V, 2) in [m], base frame.
            controller_frequency: control cycles per second, in [Hz].
            xy_goal_tolerance: of the goal checker in [m], within which the robot turns to the
                goal's yaw.
        """
        self._params = params
        self._period = 1.0 / controller_frequency  # [s]
        self._xy_goal_tolerance = xy_goal_tolerance
        self._inscribed_radius, circumscribed_radius = footprint_radii(footprint)
        self._arc_check = ArcCheck(params, footprint, circumscribed_radius)
        self._beyond_goal = (
            params.use_fixed_curvature_lookahead and params.interpolate_curvature_after_goal
        )
        self._window = PathWindow(
            params.max_robot_pose_search_dist, 1 + self._beyond_goal, keeps_two=True
        )
        self._speed = params.desired_linear_vel  # [m/s] within the speed limit
        self.reset()

    def reset(self) -> None:
        """Forget everything about the previous goal."""
        self._plan: Path | None = None
        self._at_goal = False
        self._commanded = Twist2D()  # last
        self._decision = None

    def set_speed_limit(self, limit: float, is_percentage: bool) -> None:
        """Limit the speed to ``limit`` [m/s], or [%] of the desired one; 0 lifts the limit."""
        self._speed = limited_speed(self._params.desired_linear_vel, limit, is_percentage)

    def compute_velocity(
        self, state: RobotState, plan: Path, surroundings: Surroundings
    ) -> Twist2D:
        """The command towards the carrot, or a turn on the spot.

        Raises:
            InvalidPathError: the plan is empty or nowhere near the robot.
            NoLegalVelocity: the command would lead into an obstacle.
            ControlError: the robot is off the costmap.
        """
        if plan is not self._plan:
            self._plan = plan
            self._at_goal = False
            self._window.reset()
        path = self._window.seen_from(state.pose, plan, surroundings.costmap)
        carrot, steering_point = self._points(path, state.twist.linear_x)
        direction = 1.0
        if self._params.allow_reversing and carrot[0] < 0.0:
            direction = -1.0
        carrot_distance = math.hypot(*carrot)
        command = self._turn_on_the_spot(
            path, carrot_distance, steering_point, direction, state.twist.angular_z
        )
        if command is None:
            curvature = arc_curvature(*steering_point)
            speed = direction * self._regulated_speed(
                curvature, path, state.pose, surroundings.costmap
            )
            command = Twist2D(speed, 0.0, speed * curvature)
            if self._params.use_dynamic_window:
                command = self._reachable(command, curvature, direction, state.twist)
        if self._params.use_collision_detection and self._arc_check.collides(
            command, state.pose, carrot_distance, surroundings.costmap
        ):
            self._decision = _record(state.stamp, Twist2D(), rejected=1)
            raise NoLegalVelocity({COLLISION_AHEAD: 1})
        self._decision = _record(state.stamp, command, rejected=0)
        self._commanded = command
        return command

    def resume(self) -> None:
        """See the base class: it stood, so that the last command is of no use."""
        self._commanded = Twist2D()

    def _reachable(
        self,
        wanted: Twist2D,
        curvature: float,
        direction: float,
        measured: Twist2D,
    ) -> Twist2D:
        """The command that the robot can follow within a cycle and that keeps to the arc best."""
        if self._params.velocity_feedback == "OPEN_LOOP":
            measured = self._commanded
        window = regulated(reachable(measured, self._params, self._period), wanted.linear_x)
        return best_velocity(window, curvature, direction)

    def _points(
        self, path: FloatArray, speed: float
    ) -> tuple[tuple[float, float], tuple[float, float]]:
        """The carrot, and the point that gives the curvature: the same unless that one is fixed."""
        params = self._params
        lookahead = params.lookahead_dist
        fixed = params.curvature_lookahead_dist
        if params.use_velocity_scaled_lookahead_dist:
            scaled = abs(speed) * params.lookahead_time
            lookahead = min(max(scaled, params.min_lookahead_dist), params.max_lookahead_dist)
        if params.allow_reversing:
            cusp = distance_to_cusp(path)
            lookahead = min(lookahead, cusp)
            fixed = min(fixed, cusp)
        point = lookahead_point_on_circle
        if params.lookahead_along_path:
            point = lookahead_point
        carrot = point(path, lookahead, False)
        if not params.use_fixed_curvature_lookahead:
            return carrot, carrot
        return carrot, point(path, fixed, self._beyond_goal)

    def _turn_on_the_spot(
        self,
        path: FloatArray,
        carrot_distance: float,
        steering_point: tuple[float, float],
        direction: float,
        yaw_rate: float,
    ) -> Twist2D | None:
        """The turn to the goal's yaw at the goal, or to a path far off the heading.

        None: it is to drive.
        """
        params = self._params
        if not params.use_rotate_to_heading:
            return None
        near_goal = carrot_distance < self._xy_goal_tolerance
        self._at_goal = near_goal or (params.stateful and self._at_goal)
        if self._at_goal:
            return turn_by(float(path[-1, 2]), yaw_rate, params, self._period)
        bearing = math.atan2(steering_point[1], steering_point[0])
        if direction < 0.0:
            bearing = normalize_angle(bearing + math.pi)
        if abs(bearing) <= params.rotate_to_heading_min_angle:
            return None
        return turn_by(bearing, yaw_rate, params, self._period)

    def _regulated_speed(
        self,
        curvature: float,
        path: FloatArray,
        pose: Pose2D,
        costmap: Costmap,
    ) -> float:
        """The speed in [m/s], 0 or more, that curve, obstacles, approach and speed limit leave."""
        params = self._params
        cost = self._cost_under_robot(pose, costmap)
        speed = self._speed
        if params.use_regulated_linear_velocity_scaling:
            speed = speed_in_curve(speed, curvature, params.regulated_linear_scaling_min_radius)
        if params.regulates_by_cost:
            speed = min(
                speed, speed_near_obstacle(self._speed, cost, self._inscribed_radius, params)
            )
        speed = max(speed, params.regulated_linear_scaling_min_speed)
        speed = speed_on_approach(speed, path, params)
        return min(abs(speed), self._speed)

    def _cost_under_robot(self, pose: Pose2D, costmap: Costmap) -> int:
        mx, my = costmap.world_to_map(pose.x, pose.y)
        if not costmap.contains(mx, my):
            raise ControlError(
                f"the robot at ({pose.x:.2f}, {pose.y:.2f}) m is off the local costmap; "
                "make it roll or larger"
            )
        return int(costmap.data[my, mx])


def _record(stamp: float, command: Twist2D, rejected: int) -> DecisionRecord:
    """A cycle with its one arc."""
    check = CriticScore(COLLISION_AHEAD, None, None, rejected)
    return DecisionRecord(
        stamp,
        "RegulatedPurePursuitController",
        command,
        samples=1,
        rejected=rejected,
        scores=(check,),
    )
