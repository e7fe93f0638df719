"""A stand-in for bt_navigator and its servers: nodes with timers of their own on /clock.

``python stand_in.py NAV2_FILE [SLOW]`` plans, follows and smooths at the rates of the file, and
sleeps up to SLOW seconds of wall time at chance moments.
"""

import math
import os
import random
import sys
import time
from pathlib import Path

import numpy as np
import rclpy
from action_msgs.msg import GoalStatus, GoalStatusArray
from action_msgs.srv import CancelGoal
from cyclonedds.core import Policy, Qos
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration
from geometry_msgs.msg import PoseStamped, TwistStamped
from nav_msgs.msg import OccupancyGrid
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import LaserScan

from harness.recorded.messages import pose_of
from harness.recorded.mountings import Transform, from_quaternion
from harness.ros2.messages import grid_of
from harness.ros2.robot import LATCHED, join
from harness.ros2.transforms import LOOPBACK, TFMessage
from navstack.build import build_global_costmap, build_planner, read_frequencies
from navstack.geometry import compose
from navstack.params.nav2_file.file import load_nav2
from navstack.params.safety import VelocitySmootherParams
from navstack.types import FloatArray, Pose2D

TREE_PERIOD = 0.01  # [s] bt_navigator's bt_loop_duration
REPLANNING = 1.0  # [s] between plans, as in Nav2's default tree
AHEAD = 1.0  # [m] from the robot to the point of the path that is steered for
SPEED, TURN_GAIN, FASTEST_TURN = 0.8, 1.5, 0.8
ARRIVED = 0.5  # [m]
STOP_RANGE, STOP_ANGLE = 0.7, 0.5  # [m], [rad] of a beam before which the robot stands
PATIENCE = 5.0  # [s] for which it stands before the goal is aborted, as a progress checker does
SIMULATED = Parameter("use_sim_time", Parameter.Type.BOOL, True)


class Transforms:
    """What /tf says, read through Cyclone DDS because rclpy has no type for it."""

    def __init__(self) -> None:
        number = int(os.environ["ROS_DOMAIN_ID"])
        self._domain = Domain(number, LOOPBACK)
        self._participant = DomainParticipant(number)
        reliable = Policy.Reliability.Reliable(duration(seconds=1))
        topic = Topic(self._participant, "rt/tf", TFMessage)
        self._reader = DataReader(
            self._participant, topic, qos=Qos(reliable, Policy.History.KeepLast(100))
        )
        self._poses: dict[str, Pose2D] = {}

    def robot(self) -> Pose2D | None:
        """The robot's newest pose in the map; None: nobody has said it yet."""
        for message in self._reader.take(N=1000):
            for each in message.transforms:
                shift, turn = each.transform.translation, each.transform.rotation
                rotation = from_quaternion(turn.x, turn.y, turn.z, turn.w)
                yaw = Transform(rotation, np.zeros(3)).yaw
                self._poses[each.child_frame_id] = Pose2D(shift.x, shift.y, yaw)
        if "odom" in self._poses and "base_link" in self._poses:
            return compose(self._poses["odom"], self._poses["base_link"])
        return None


class StandIn:
    """Four nodes: the tree, the planner, the controller and the smoother."""

    def __init__(self, file: str, slow: float) -> None:
        self._nav2 = load_nav2(Path(file), allow_unknown=True)
        self._slow, self._chance = slow, random.Random(1)
        names = ("bt_navigator", "planner_server", "controller_server", "velocity_smoother")
        self.nodes = [Node(name, parameter_overrides=[SIMULATED]) for name in names]
        tree, planner, controller, smoother = self.nodes
        self._clock = tree.get_clock()
        self._transforms = Transforms()
        tree.create_subscription(PoseStamped, "goal_pose", self._take_goal, 10)
        planner.create_subscription(OccupancyGrid, "map", self._take_map, LATCHED)
        controller.create_subscription(LaserScan, "scan", self._take_scan, qos_profile_sensor_data)
        smoother.create_subscription(TwistStamped, "cmd_vel_nav", self._take_wish, 1)
        tree.create_service(
            CancelGoal, "navigate_to_pose/_action/cancel_goal", self._take_cancellation
        )
        status = "navigate_to_pose/_action/status"
        self._statuses = tree.create_publisher(GoalStatusArray, status, LATCHED)
        self._wishes = controller.create_publisher(TwistStamped, "cmd_vel_nav", 1)
        self._commands = smoother.create_publisher(TwistStamped, "cmd_vel", 1)
        tree.create_timer(TREE_PERIOD, self._tick_tree)
        controller.create_timer(1.0 / read_frequencies(self._nav2).controller, self._control)
        rate = self._nav2.read(VelocitySmootherParams, "velocity_smoother").smoothing_frequency
        smoother.create_timer(1.0 / rate, self._smooth)
        self._goal: Pose2D | None = None
        self._plan: FloatArray | None = None
        self._status = GoalStatus()
        self._nearest = math.inf  # [m] of what is ahead
        self._wish: TwistStamped | None = None

    def _now(self) -> float:
        return float(self._clock.now().nanoseconds) / 1e9

    def _take_map(self, message: OccupancyGrid) -> None:
        self._costmap = build_global_costmap(self._nav2, grid_of(message), None)
        self._planner = build_planner(self._nav2, self._costmap)

    def _take_goal(self, message: PoseStamped) -> None:
        self._goal, self._plan, self._moved = Pose2D(*pose_of(message)), None, self._now()
        self._planned = -math.inf
        self._status = GoalStatus(status=GoalStatus.STATUS_EXECUTING)
        self._status.goal_info.goal_id.uuid = np.array(
            [self._chance.randrange(256) for _ in range(16)], dtype=np.uint8
        )
        self._statuses.publish(GoalStatusArray(status_list=[self._status]))

    def _take_cancellation(
        self, request: CancelGoal.Request, answer: CancelGoal.Response
    ) -> CancelGoal.Response:
        if self._goal is not None:
            self._end(GoalStatus.STATUS_CANCELED)
            sys.stdout.write("canceled\n")
            sys.stdout.flush()
        return answer

    def _take_scan(self, message: LaserScan) -> None:
        ranges = np.asarray(message.ranges)
        angles = message.angle_min + message.angle_increment * np.arange(len(ranges))
        ahead = ranges[np.abs(angles) < STOP_ANGLE]
        self._nearest = float(ahead.min(initial=math.inf))

    def _take_wish(self, message: TwistStamped) -> None:
        self._wish = message

    def _tick_tree(self) -> None:
        """Plan again when it is due; end the goal when it is reached or given up."""
        pose = self._transforms.robot()
        if self._goal is None or pose is None or self._now() == 0.0:
            return
        if self._now() >= self._planned + REPLANNING:
            self._planned = self._now()
            self._costmap.reset()
            self._costmap.update(pose, None, 0.0)
            self._planner.reset(np.random.default_rng(0))
            self._plan = self._planner.plan(pose, self._goal, self._costmap.master).poses
        if math.hypot(pose.x - self._goal.x, pose.y - self._goal.y) < ARRIVED:
            self._end(GoalStatus.STATUS_SUCCEEDED)
        elif self._now() > self._moved + PATIENCE:
            self._end(GoalStatus.STATUS_ABORTED)

    def _end(self, status: int) -> None:
        self._goal = self._plan = self._wish = None
        self._status.status = status
        self._statuses.publish(GoalStatusArray(status_list=[self._status]))
        self._send(0.0, 0.0)

    def _control(self) -> None:
        """Steer for a point of the path ahead."""
        if self._slow:
            time.sleep(self._chance.uniform(0.0, self._slow))
        pose = self._transforms.robot()
        if self._plan is None or pose is None:
            return
        distances = np.hypot(self._plan[:, 0] - pose.x, self._plan[:, 1] - pose.y)
        nearest = int(distances.argmin())
        beyond = np.flatnonzero(distances[nearest:] >= AHEAD)
        chosen = -1
        if len(beyond):
            chosen = nearest + int(beyond[0])
        x, y = self._plan[chosen, :2].tolist()
        bearing = math.atan2(y - pose.y, x - pose.x) - pose.yaw
        bearing = math.remainder(bearing, math.tau)
        speed = SPEED * max(0.0, math.cos(bearing))
        if self._nearest < STOP_RANGE:
            speed = 0.0
        else:
            self._moved = self._now()
        self._send(speed, max(-FASTEST_TURN, min(FASTEST_TURN, TURN_GAIN * bearing)))

    def _send(self, speed: float, turn: float) -> None:
        wish = TwistStamped()
        wish.twist.linear.x, wish.twist.angular.z = speed, turn
        self._wishes.publish(wish)

    def _smooth(self) -> None:
        if self._wish is not None:
            self._wish.header.stamp = self._clock.now().to_msg()
            self._commands.publish(self._wish)


def main() -> None:
    """Stand in until interrupted."""
    join()
    slow = 0.0
    if len(sys.argv) > 2:
        slow = float(sys.argv[2])
    stand_in = StandIn(sys.argv[1], slow)
    executor = SingleThreadedExecutor()
    for node in stand_in.nodes:
        executor.add_node(node)
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
