"""Our brain as a node: it takes a robot's sensors and a goal, and commands the robot."""

import dataclasses
import math
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import rclpy
from action_msgs.msg import GoalStatus, GoalStatusArray
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, Twist, TwistStamped
from nav_msgs.msg import Odometry as OdometryMessage
from rclpy.duration import Duration
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import qos_profile_sensor_data
from rosgraph_msgs.msg import Clock as ClockMessage
from sensor_msgs.msg import Imu as ImuMessage
from sensor_msgs.msg import LaserScan as ScanMessage
from sensor_msgs.msg import NavSatFix

from harness.recorded import messages as received
from harness.recorded.mountings import IDENTITY, Transform, frame_name, from_angles
from harness.ros2 import messages
from harness.ros2.robot import LATCHED, join
from harness.ros2.stop_signals import heard
from harness.task.ros2_params import Ros2Params
from harness.world.sensors.message_precision import as_messages
from navstack.errors import InputError, NavstackError
from navstack.localization.geodesy import LocalFrame
from navstack.navigation_status import Status
from navstack.navigator import Navigator
from navstack.types import (
    Belief,
    Generators,
    GpsFix,
    Imu,
    LaserScan,
    Observation,
    Odometry,
    Pose2D,
    Twist2D,
)

NODE = "navbench_drive"
AGAIN = "send /initialpose and a goal"
# [s] that the clock may advance between two ticks under way, beside the time that the first took
MOST_JUMP = 1.0
# [s] of the clock that the stamps of scan and odometry may be behind it, or ahead of it
MOST_AGE = 1.0
LOOK = 0.02  # [s] of wall time between two looks at whether publishers are gone
MOST_WAITING = 100  # messages taken in before a tick: a flood does not hold it up
ACKNOWLEDGED = Duration(seconds=0.2)  # that the last command is waited to arrive
_STATUS = {
    Status.RUNNING: GoalStatus.STATUS_EXECUTING,
    Status.SUCCEEDED: GoalStatus.STATUS_SUCCEEDED,
    Status.FAILED: GoalStatus.STATUS_ABORTED,
}


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
        self._navigator, self._params, self._say = navigator, params, say
        origin = np.array((laser.x, laser.y, 0.0))
        self._laser = Transform(from_angles(0.0, 0.0, laser.yaw), origin)
        self._seed, self._period, self._is_stamped = seed, 1.0 / rate, is_stamped
        self._is_simulated = is_simulated
        self._site = LocalFrame(params.latitude, params.longitude)
        self._start: Pose2D | None = None  # where the next goal finds the robot
        self._is_known = False  # whether the brain has followed the robot since it was told
        self._goal: Pose2D | None = None
        self._offset: float | None = None  # [s] of the clock at the goal's first tick
        self._last = -math.inf  # [s] of the clock at the last tick
        self._took = 0.0  # [s] of monotonic time that it took
        self._new: dict[str, Any] = {}  # what arrived since the last tick, the newest of each kind
        self._ages = {"scan": -math.inf, "odometry": -math.inf}  # [s] of the newest, on the clock
        self._count = 0  # messages so far
        self.refused = 0  # messages that cannot be used
        self._is_far = False  # whether fixes were too far from the datum, which is told once
        self._needed = ["scan", "odom"]  # topics without whose publishers it stands
        if is_simulated:
            self._needed.append("/clock")
        self._told = GoalStatus.STATUS_UNKNOWN  # the goal's, as published last
        self._is_stopped, self._why = True, ""  # and what the user was told of it last
        self._ticks: list[float] = []  # [s] of the clock that are to be driven
        self._node = rclpy.create_node(NODE)
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self._node)
        kind = TwistStamped if is_stamped else Twist
        self._commands = self._node.create_publisher(kind, "cmd_vel", 1)
        self._statuses = self._node.create_publisher(
            GoalStatusArray, "navigate_to_pose/_action/status", LATCHED
        )
        self._subscribe()

    def _subscribe(self) -> None:
        kinds = [
            (PoseWithCovarianceStamped, "initialpose", self._take_start),
            (PoseStamped, "goal_pose", self._take_goal),
            (OdometryMessage, "odom", self._take_odometry),
            (ImuMessage, "imu", self._take_imu),
            (NavSatFix, "gps/fix", self._take_fix),
            (ScanMessage, "scan", self._take_scan),
        ]
        if self._is_simulated:
            kinds.append((ClockMessage, "/clock", self._take_clock))
        for message, topic, take in kinds:
            self._node.create_subscription(message, topic, take, qos_profile_sensor_data)

    def spin(self, deadline: float = math.inf) -> None:
        """Drive until ``deadline`` [s] of the monotonic clock, or until it is interrupted.

        However it ends, the last command is to stop. A signal ends it between two ticks: raised
        within a callback, an interrupt could be lost there.

        Raises:
            KeyboardInterrupt: it was told to stop.
        """
        told: list[int] = []
        try:
            with heard(told):
                while time.monotonic() < deadline and not told:
                    self._spin_once()
            if told:
                raise KeyboardInterrupt
        finally:
            self._stop(f"leaving; {self.refused} messages could not be used")
            self._commands.wait_for_all_acked(ACKNOWLEDGED)
            self._executor.shutdown()
            self._node.destroy_node()

    def _spin_once(self) -> None:
        """Take in what came, and tick."""
        self._executor.spin_once(timeout_sec=LOOK)
        for _ in range(MOST_WAITING):
            # sensors of the same time are taken in before it is driven
            if not self._ticks or not self._is_more_coming():
                break
        now = time.time()
        if not self._is_simulated and not 0.0 <= now - self._last < self._period:
            self._ticks = [now]
        for each in self._ticks:
            self._tick(each)
        self._ticks = []
        if not self._is_stopped:
            self._stop_if(self._gone())

    def _is_more_coming(self) -> bool:
        """Take in one message more, if there is one."""
        before = self._count
        self._executor.spin_once(timeout_sec=0.0)
        return self._count != before

    def _gone(self) -> str:
        """The topics that nobody publishes; empty: none."""
        gone = [name for name in self._needed if not self._node.count_publishers(name)]
        if not gone:
            return ""
        return f"nobody publishes {' and '.join(gone)}"

    def _old(self, now: float) -> str:
        """The sensors whose newest stamp is far from ``now`` [s]; empty: none."""
        old = [name for name, stamp in self._ages.items() if not abs(now - stamp) <= MOST_AGE]
        if not old:
            return ""
        return f"no {' and no '.join(old)} with a stamp within {MOST_AGE:g} s of the clock"

    def _stop_if(self, why: str) -> bool:
        """Stop if there is a reason; whether there was."""
        if why:
            self._stop(why)
        return bool(why)

    def _tick(self, now: float) -> None:
        """Drive a tick at a time [s] of the clock."""
        jump, self._last = now - self._last, now
        most, self._took = MOST_JUMP + self._took, 0.0
        if self._goal is None:
            return
        if self._offset is not None and not 0.0 <= jump <= most:
            self._give_up(f"the clock jumped by {jump:.3g} s; {AGAIN}")
            return
        if self._stop_if(self._old(now) or self._gone()):
            return
        if self._offset is None:
            self._offset = now
        began = time.monotonic()
        observation = as_messages(Observation(now - self._offset, **self._taken(self._offset)))
        try:
            command = self._navigator.tick(observation)
        except NavstackError as error:
            self._give_up(f"{error}; {AGAIN}")
            return
        self._took = time.monotonic() - began
        if self._took > MOST_AGE and not self._is_simulated:
            self._stop(f"a cycle took more than {MOST_AGE:g} s, its command is that old")
            return
        self._send(command)
        self._is_stopped, self._why = False, ""
        self._tell(_STATUS[self._navigator.status])

    def _give_up(self, why: str) -> None:
        """End the goal; where the robot is then nobody follows."""
        self._goal, self._is_known = None, False
        self._stop(why)
        self._tell(GoalStatus.STATUS_ABORTED)

    def _taken(self, offset: float) -> dict[str, Any]:
        """What arrived since the last tick, with times from the goal's first tick on."""
        taken = {
            name: dataclasses.replace(each, stamp=each.stamp - offset)
            for name, each in self._new.items()
        }
        self._new = {}
        return taken

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
        if why != self._why:
            self._say(f"stopped: {why}")
        self._is_stopped, self._why = True, why

    def _tell(self, status: int) -> None:
        """Publish how the goal stands, if that is new."""
        if status == self._told:
            return
        self._told = status
        self._statuses.publish(GoalStatusArray(status_list=[GoalStatus(status=status)]))

    def _take(self, name: str, taken: GpsFix | Imu | LaserScan | Odometry | None) -> None:
        """Keep the newest of a kind; None: a message that cannot be used."""
        self._count += 1
        if taken is None:
            self.refused += 1
            return
        if name in self._ages:
            self._ages[name] = taken.stamp
        self._new[name] = taken

    def _take_clock(self, message: ClockMessage) -> None:
        self._count += 1
        self._ticks.append(messages.seconds(message.clock))

    def _take_start(self, message: PoseWithCovarianceStamped) -> None:
        self._start = self._pose_of(message, "an initial pose") or self._start

    def _take_goal(self, message: PoseStamped) -> None:
        goal = self._pose_of(message, "a goal")
        if goal is None:
            return
        if self._start is not None:
            believed = Belief(self._start)
        elif self._is_known:
            believed = dataclasses.replace(self._navigator.belief, stamp=0.0)
        else:
            self._say("a goal came before /initialpose; send that first")
            return
        self._start, self._is_known = None, True
        self._goal, self._offset, self._new = goal, None, {}
        self._told = GoalStatus.STATUS_UNKNOWN
        streams = np.random.default_rng(self._seed).spawn(3)
        self._navigator.reset(goal, believed, Generators(*streams))

    def _pose_of(self, message: Any, what: str) -> Pose2D | None:
        """The pose of a message in the map; None: it is none, and the user is told."""
        self._count += 1
        numbers, frame = received.pose_of(message), frame_name(message.header.frame_id)
        if numbers is None or frame != self._params.map_frame:
            self.refused += 1
            self._say(
                f"{what} in frame '{frame}' was refused; give numbers in '{self._params.map_frame}'"
            )
            return None
        return Pose2D(*numbers)

    def _take_odometry(self, message: OdometryMessage) -> None:
        self._take("odometry", received.odometry(message, received.stamp_of(message), IDENTITY))

    def _take_imu(self, message: ImuMessage) -> None:
        with np.errstate(invalid="ignore"):  # numbers that are none are refused
            taken = received.imu(message, received.stamp_of(message), IDENTITY)
        self._take("imu", taken)

    def _take_fix(self, message: NavSatFix) -> None:
        fix, coordinates = None, received.coordinates(message)
        if coordinates is not None:
            try:
                place, stamp = self._site.to_local(*coordinates), received.stamp_of(message)
                fix = received.gps_fix(message, stamp, place, np.zeros(3), 0.0)
            except InputError as error:
                self._tell_of_far_fix(error)
        self._take("gps", fix)

    def _tell_of_far_fix(self, error: InputError) -> None:
        """Say once why fixes have no effect: the datum is the simulator's, or another place's."""
        if not self._is_far:
            self._is_far = True
            self._say(
                f"fixes are refused: {error}; give the map's origin: --datum LATITUDE LONGITUDE"
            )

    def _take_scan(self, message: ScanMessage) -> None:
        self._take("scan", received.laser_scan(message, received.stamp_of(message), self._laser))
