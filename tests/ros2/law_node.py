"""A node that drives by a fixed law: ``python law_node.py TYPE QUALITY FAULT``.

It answers each time of the clock, and fails after ``BEGINS`` of them.
"""

import math
import sys
import time
from functools import partial

import rclpy
from geometry_msgs.msg import PoseStamped, Twist, TwistStamped
from law import command
from rclpy.executors import ExternalShutdownException
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy, qos_profile_sensor_data
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import LaserScan

from harness.ros2.messages import seconds

BEGINS = 40  # times of the clock
NUMBERS = (math.nan, math.inf, 1e308)
_LATCHED = QoSProfile(
    depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL, reliability=ReliabilityPolicy.RELIABLE
)
# of commands, and of what is listened to: nobody latches a clock
QUALITIES = {
    "reliable": (QoSProfile(depth=10), QoSProfile(depth=10)),
    "best_effort": (qos_profile_sensor_data, qos_profile_sensor_data),
    "latched": (_LATCHED, QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE)),
}
TYPES = {"Twist": Twist, "TwistStamped": TwistStamped}


class LawNode:
    """Commands by the law from a goal on."""

    def __init__(self, kind: str, quality: str, fault: str) -> None:
        self._kind, self._fault = TYPES[kind], fault
        self._goals = self._ticks = 0
        node = rclpy.create_node("law")
        sends, listens = QUALITIES[quality]
        self._publish = node.create_publisher(self._kind, "cmd_vel", sends).publish
        node.create_subscription(PoseStamped, "goal_pose", self._take_goal, listens)
        node.create_subscription(LaserScan, "scan", partial(setattr, self, "_scan"), listens)
        node.create_subscription(Clock, "/clock", self._take_clock, listens)
        self.node = node

    def _take_goal(self, message: PoseStamped) -> None:
        self._goals, self._ticks = self._goals + 1, 0

    def _take_clock(self, message: Clock) -> None:
        if not self._goals:
            return
        now = seconds(message.clock)
        if not self._ticks:
            self._begin = now
        self._ticks += 1
        scan, fault = self._scan, "none"
        if self._ticks > BEGINS:
            fault = self._fault
        if fault == "kill":
            sys.exit(3)
        elif fault == "stall":
            time.sleep(1000.0)
        twist = Twist()
        twist.linear.x, twist.angular.z = command(now - self._begin, scan.ranges, scan.range_max)
        if fault == "nonsense":
            twist.linear.x = NUMBERS[self._ticks % len(NUMBERS)]
        sent = twist
        if self._kind is TwistStamped:
            sent = TwistStamped(twist=twist)
        for _ in range({"flood": 200}.get(fault, 1)):
            self._publish(sent)


if __name__ == "__main__":
    rclpy.init()
    try:
        rclpy.spin(LawNode(*sys.argv[1:]).node)
    except (KeyboardInterrupt, ExternalShutdownException):
        rclpy.try_shutdown()
