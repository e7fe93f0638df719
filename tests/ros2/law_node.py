"""A node that drives by a fixed law at each time of the clock.

Usage: python law_node.py TYPE QUALITY
"""

import sys

import rclpy
from geometry_msgs.msg import PoseStamped, Twist, TwistStamped
from law import command
from rclpy.executors import ExternalShutdownException
from rclpy.qos import QoSProfile, ReliabilityPolicy, qos_profile_sensor_data
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import LaserScan

from harness.ros2.messages import seconds
from harness.ros2.robot import LATCHED

# of commands, and of what is listened to: nobody latches a clock
QUALITIES = {
    "reliable": (QoSProfile(depth=10), QoSProfile(depth=10)),
    "best_effort": (qos_profile_sensor_data, qos_profile_sensor_data),
    "latched": (LATCHED, QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE)),
}
TYPES = {"Twist": Twist, "TwistStamped": TwistStamped}


class LawNode:
    """Commands by the law from a goal on."""

    def __init__(self, kind: str, quality: str) -> None:
        self.node, self._kind = rclpy.create_node("law"), TYPES[kind]
        self._begin: float | None = None  # [s] of the clock
        self._has_goal = False
        sends, takes = QUALITIES[quality]
        self._commands = self.node.create_publisher(self._kind, "cmd_vel", sends)
        self.node.create_subscription(PoseStamped, "goal_pose", self._take_goal, takes)
        self.node.create_subscription(LaserScan, "scan", self._take_scan, takes)
        self.node.create_subscription(Clock, "/clock", self._take_clock, takes)

    def _take_goal(self, message: PoseStamped) -> None:
        self._has_goal, self._begin = True, None

    def _take_scan(self, message: LaserScan) -> None:
        self._scan = message

    def _take_clock(self, message: Clock) -> None:
        if not self._has_goal:
            return
        now, scan = seconds(message.clock), self._scan
        if self._begin is None:
            self._begin = now
        twist = Twist()
        since = now - self._begin
        twist.linear.x, twist.angular.z = command(since, scan.ranges, scan.range_max)
        sent = twist
        if self._kind is TwistStamped:
            sent = TwistStamped(twist=twist)
        self._commands.publish(sent)


if __name__ == "__main__":
    rclpy.init()
    try:
        rclpy.spin(LawNode(*sys.argv[1:]).node)
    except (KeyboardInterrupt, ExternalShutdownException):
        rclpy.try_shutdown()
