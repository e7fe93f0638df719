"""A peer that fails in each delivery: ``python faulty_peer.py SEED [FAULT ...]``.

It fails in the given ways, then in such as are drawn by chance. A killed one starts again as
another process, with the next seed. For each goal it prints the
fault, and "under way" once that begins after some commands.
"""

import math
import os
import random
import signal
import subprocess
import sys
import time

import rclpy
from action_msgs.msg import GoalStatus, GoalStatusArray
from geometry_msgs.msg import PoseStamped, Twist, TwistStamped
from rclpy.executors import ExternalShutdownException
from rosgraph_msgs.msg import Clock

from harness.ros2.messages import seconds, time_of
from harness.ros2.robot import LATCHED, join

FAULTS = ("kill", "stall", "silence", "nonsense", "flood", "late", "abort", "stamps")
TICK = 1.0 / 60.0  # [s] of the clock
LATEST = 60  # ticks after which a fault has begun
LONGEST = 3.0  # [s] of a stall
LATE = 0.3  # [s] of each command
NUMBERS = (math.nan, math.inf, -math.inf, 1e308, -1e308, 101.0)
STAMPS = (0.0, 1e9, 2e9)  # [s]


class FaultyPeer:
    """Commands a constant velocity at each tick, until its fault begins."""

    def __init__(self, seed: int, faults: list[str]) -> None:
        self._faults = faults
        self._seed, self._chance = seed, random.Random(seed)
        self._fault, self._begins, self._ticks = "silence", 0, 0.0
        self._since: float | None = None  # [s] of the first tick since the goal
        self._told = self._fault  # as under way
        self._node = rclpy.create_node(f"faulty_{os.getpid()}")
        kind = self._chance.choice((Twist, TwistStamped))
        self._commands = self._node.create_publisher(kind, "cmd_vel", 5)
        self._is_stamped = kind is TwistStamped
        status = "navigate_to_pose/_action/status"
        self._statuses = self._node.create_publisher(GoalStatusArray, status, LATCHED)
        self._node.create_subscription(PoseStamped, "goal_pose", self._take_goal, 10)
        self._node.create_subscription(Clock, "/clock", self._take_clock, 10)

    def spin(self) -> None:
        """Go on until it is killed."""
        rclpy.spin(self._node)

    def _take_goal(self, message: PoseStamped) -> None:
        self._fault, self._since = self._chance.choice(FAULTS), None
        self._told = "none"
        if self._faults:
            self._fault = self._faults.pop(0)
        self._begins = self._chance.randrange(1, LATEST)
        self._say(self._fault)

    def _take_clock(self, message: Clock) -> None:
        now = seconds(message.clock)  # on a slow machine not every tick arrives
        if self._since is None:
            self._since = now
        self._ticks = (now - self._since) / TICK
        fault, stamp = "none", message.clock
        if self._ticks >= self._begins:
            fault = self._fault
        if fault not in ("none", self._told):
            self._told = fault
            self._say("under way")
        self._fail_whole(fault)
        speed, count = 0.5, {"silence": 0, "flood": 300}.get(fault, 1)
        if fault == "nonsense":
            speed = self._chance.choice(NUMBERS)
        elif fault == "stamps":
            stamp = time_of(self._chance.choice(STAMPS))
        for _ in range(count):
            self._send(speed, stamp)

    def _fail_whole(self, fault: str) -> None:
        """Fail in a way that is not one of commands."""
        if fault == "kill":
            again = [sys.executable, __file__, str(self._seed + 1), *self._faults]
            subprocess.Popen(again)
            os.kill(os.getpid(), signal.SIGKILL)
        elif fault == "stall":
            self._begins = self._ticks + LATEST
            time.sleep(self._chance.uniform(0.0, LONGEST))
        elif fault == "late":
            time.sleep(LATE)
        elif fault == "abort":
            aborted = GoalStatus(status=GoalStatus.STATUS_ABORTED)
            self._statuses.publish(GoalStatusArray(status_list=[aborted]))

    def _say(self, line: str) -> None:
        sys.stdout.write(f"{line}\n")
        sys.stdout.flush()

    def _send(self, speed: float, stamp: object) -> None:
        twist = Twist()
        twist.linear.x = speed
        message = twist
        if self._is_stamped:
            message = TwistStamped(twist=twist)
            message.header.stamp = stamp
        self._commands.publish(message)


if __name__ == "__main__":
    join()
    try:
        FaultyPeer(int(sys.argv[1]), sys.argv[2:]).spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        rclpy.try_shutdown()
