"""Our brain as a node: it takes a robot's sensors and a goal, and commands the robot."""

import math
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import rclpy
from action_msgs.msg import GoalStatus, GoalStatusArray
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, Twist, TwistStamped
from nav_msgs.msg import OccupancyGrid as GridMessage
from nav_msgs.msg import Odometry as OdometryMessage
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import qos_profile_sensor_data
from rosgraph_msgs.msg import Clock as ClockMessage
from sensor_msgs.msg import Imu as ImuMessage
from sensor_msgs.msg import LaserScan as ScanMessage
from sensor_msgs.msg import NavSatFix

from harness.ros2 import messages
from harness.ros2.robot import LATCHED, join
from harness.task.ros2_params import Ros2Params
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.errors import InputError
from navstack.localization.geodesy import LocalFrame
from navstack.navigation_status import Status
from navstack.navigator import Navigator
from navstack.types import Belief, Generators, Observation, Pose2D, Twist2D

NODE = "navbench_drive"
MOST_JUMP = 1.0  # [s] that the clock may advance between two ticks under way
MOST_AGE = 1.0  # [s] of the clock that scan and odometry may be old under way
LOST = 0.2  # [s] of wall time without anything new, after which the robot is stopped
_STATUS = {
    Status.RUNNING: GoalStatus.STATUS_EXECUTING,
    Status.SUCCEEDED: GoalStatus.STATUS_SUCCEEDED,
    Status.FAILED: GoalStatus.STATUS_ABORTED,
}


def receive_map(timeout: float) -> OccupancyGrid:
    """The map that somebody publishes on /map.

    Args:
        timeout: [s] of wall time.

    Raises:
        InputError: none came.
    """
    join()
    node = rclpy.create_node(f"{NODE}_map")
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    found: list[GridMessage] = []
    node.create_subscription(GridMessage, "map", found.append, LATCHED)
    deadline = time.monotonic() + timeout
    while not found and time.monotonic() < deadline:
        executor.spin_once(timeout_sec=0.1)
    executor.shutdown()
    node.destroy_node()
    if not found:
        raise InputError(f"no map came on /map within {timeout:g} s; give --map FILE")
    return messages.grid_of(found[0])


class DriveNode:
    """Drives to each goal that comes.

    It stands without a goal, while scan or odometry are missing or old, when their publishers are
    gone, and for good on this goal after a jump of the clock.
    """

    def __init__(
        self,
        navigator: Navigator,
        params: Ros2Params,
        laser: Pose2D,
        rate: float,
        seed: int,
        say: Callable[[str], None],
        *,
        is_simulated: bool = True,
        is_stamped: bool = True,
    ) -> None:
        """Join, and wait.

        Args:
            navigator: the brain.
            params: frames, and the datum of fixes.
            laser: pose of the lidar in the base frame.
            rate: [Hz] of ticks where the clock is the wall's.
            seed: of the brain's chance.
            say: tells the user a line.
            is_simulated: whether time comes on /clock, a tick with each; else it is the wall's.
            is_stamped: whether commands are TwistStamped.
        """
        join()
        self._navigator, self._params, self._laser, self._say = navigator, params, laser, say
        self._seed, self._period, self._is_stamped = seed, 1.0 / rate, is_stamped
        self._is_simulated = is_simulated
        self._site = LocalFrame(params.latitude, params.longitude)
        self._start: Pose2D | None = None
        self._goal: Pose2D | None = None
        self._offset: float | None = None  # [s] of the clock at the goal's first tick
        self._last = -math.inf  # [s] of the clock at the last tick
        self._new: dict[str, Any] = {}  # what arrived since the last tick, the newest of each kind
        self._ages = {"scan": -math.inf, "odometry": -math.inf}  # [s] of the newest, on the clock
        self._count = 0  # messages so far
        self.refused = 0  # messages that cannot be used
        self._heard = time.monotonic()
        self._is_stopped = True
        self._node = rclpy.create_node(NODE)
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self._node)
        kind = TwistStamped if is_stamped else Twist
        self._commands = self._node.create_publisher(kind, "cmd_vel", 1)
        self._statuses = self._node.create_publisher(
            GoalStatusArray, "navigate_to_pose/_action/status", LATCHED
        )
        for message, topic, take in (
            (PoseWithCovarianceStamped, "initialpose", self._take_start),
            (PoseStamped, "goal_pose", self._take_goal),
            (OdometryMessage, "odom", self._take_odometry),
            (ImuMessage, "imu", self._take_imu),
            (NavSatFix, "gps/fix", self._take_fix),
            (ScanMessage, "scan", self._take_scan),
        ):
            self._node.create_subscription(message, topic, take, qos_profile_sensor_data)
        if is_simulated:
            self._node.create_subscription(
                ClockMessage, "/clock", self._take_clock, qos_profile_sensor_data
            )
        self._ticks: list[float] = []  # [s] of the clock that are to be driven

    def spin(self, deadline: float = math.inf) -> None:
        """Drive until ``deadline`` [s] of the monotonic clock, or until it is interrupted.

        However it ends, the last command is to stop.
        """
        try:
            while time.monotonic() < deadline:
                self._spin_once()
        finally:
            self._stop("leaving")
            self._executor.shutdown()
            self._node.destroy_node()

    def _spin_once(self) -> None:
        """Take in what came, and tick."""
        self._executor.spin_once(timeout_sec=0.05)
        while self._ticks and self._is_more_coming():
            pass  # sensors of the same time are taken in before it is driven
        if not self._is_simulated:
            now = time.time()
            if now >= self._last + self._period:
                self._ticks = [now]
        for now in self._ticks:
            self._tick(now)
        self._ticks = []
        if not self._is_stopped and self._is_alone():
            self._stop("scans or odometry are gone")

    def _is_more_coming(self) -> bool:
        """Take in one message more, if there is one."""
        before = self._count
        self._executor.spin_once(timeout_sec=0.0)
        return self._count != before

    def _is_alone(self) -> bool:
        """Whether nothing came for a while, and those who sent it are gone."""
        if time.monotonic() - self._heard < LOST:
            return False
        topics = ("scan", "odom", "/clock") if self._is_simulated else ("scan", "odom")
        return any(self._node.count_publishers(topic) == 0 for topic in topics)

    def _tick(self, now: float) -> None:
        """Drive a tick at a time [s] of the clock."""
        jump, self._last = now - self._last, now
        if self._goal is None:
            return
        if self._offset is not None and not 0.0 <= jump <= MOST_JUMP:
            self._goal = None
            self._stop(f"the clock jumped by {jump:.3g} s; waiting for a new goal")
            return
        if self._offset is None:
            self._offset = now
            for name, age in self._ages.items():
                if not now - age <= MOST_AGE:
                    self._offset = None
                    self._stop(f"no {name} yet")
                    return
        old = [name for name, age in self._ages.items() if not now - age <= MOST_AGE]
        if old:
            self._stop(f"{' and '.join(old)} older than {MOST_AGE:g} s")
            return
        observation = Observation(now - self._offset, **self._made(self._offset))
        command = self._navigator.tick(observation)
        self._send(command)
        self._is_stopped = False
        self._tell_status()

    def _made(self, offset: float) -> dict[str, Any]:
        """What arrived, as the brain takes it."""
        made = {name: make(offset) for name, make in self._new.items()}
        self._new = {}
        return made

    def _send(self, command: Twist2D) -> None:
        twist = Twist()
        twist.linear.x, twist.linear.y = command.linear_x, command.linear_y
        twist.angular.z = command.angular_z
        message = twist
        if self._is_stamped:
            message = TwistStamped(twist=twist)
            message.header.frame_id = self._params.base_frame
            message.header.stamp = messages.time_of(max(self._last, 0.0))
        self._commands.publish(message)

    def _stop(self, why: str) -> None:
        self._send(Twist2D())
        if not self._is_stopped:
            self._say(f"stopped: {why}")
        self._is_stopped = True

    def _tell_status(self) -> None:
        status = GoalStatus(status=_STATUS[self._navigator.status])
        self._statuses.publish(GoalStatusArray(status_list=[status]))

    def _take(self, name: str, make: Callable[[float], Any]) -> None:
        """Keep the newest of a kind, if it can be used."""
        self._count += 1
        self._heard = time.monotonic()
        try:
            stamp = make(0.0).stamp
        except InputError:
            self.refused += 1
            return
        if name in self._ages:
            self._ages[name] = stamp
        self._new[name] = make

    def _take_clock(self, message: ClockMessage) -> None:
        self._count += 1
        self._heard = time.monotonic()
        self._ticks.append(messages.seconds(message.clock))

    def _take_start(self, message: PoseWithCovarianceStamped) -> None:
        self._count += 1
        self._start = self._pose_of(message.pose.pose) or self._start

    def _take_goal(self, message: PoseStamped) -> None:
        self._count += 1
        goal = self._pose_of(message.pose)
        if goal is None:
            return
        if self._start is None:
            self._say("a goal came before /initialpose; send that first")
            return
        self._goal, self._offset, self._new = goal, None, {}
        streams = np.random.default_rng(self._seed).spawn(3)
        self._navigator.reset(goal, Belief(self._start), Generators(*streams))

    def _pose_of(self, message: Any) -> Pose2D | None:
        try:
            return messages.pose_of(message)
        except InputError:
            self.refused += 1
            return None

    def _take_odometry(self, message: OdometryMessage) -> None:
        self._take("odometry", lambda offset: messages.odometry_of(message, offset))

    def _take_imu(self, message: ImuMessage) -> None:
        self._take("imu", lambda offset: messages.imu_of(message, offset))

    def _take_fix(self, message: NavSatFix) -> None:
        self._take("gps", lambda offset: messages.fix_of(message, offset, self._site))

    def _take_scan(self, message: ScanMessage) -> None:
        laser = self._laser
        self._take("scan", lambda offset: messages.scan_of(message, laser, offset))
