"""Whatever happens around the robot, it stands within 0.2 s; nothing unusable reaches the brain."""

import math
import random
import struct
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from harness.task.ros2_params import Ros2Params
from navstack.errors import InputError, NavstackError
from navstack.navigation_status import Status
from navstack.types import Belief, Observation, Pose2D, Twist2D

drive = pytest.importorskip("harness.ros2.drive", exc_type=ImportError)

import rclpy  # noqa: E402
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, TwistStamped  # noqa: E402
from nav_msgs.msg import OccupancyGrid, Odometry  # noqa: E402
from rclpy.executors import SingleThreadedExecutor  # noqa: E402
from rosgraph_msgs.msg import Clock  # noqa: E402
from sensor_msgs.msg import Imu, LaserScan, NavSatFix  # noqa: E402

from harness.ros2 import messages  # noqa: E402

WITHIN = 0.2  # [s]
PERIOD = 0.02  # [s] between the sensors' messages
BEGIN = 1000.0  # [s] of the simulated clock
HOSTILE = (math.nan, math.inf, -math.inf, 1e308, -1e308, 0.0, 1e-320)


class Eager:
    """Drives on whatever it sees, and keeps it."""

    status = Status.RUNNING

    def __init__(self) -> None:
        self.seen: list[Observation] = []
        self.began: list[tuple[Pose2D, Belief]] = []
        self.error: NavstackError | None = None
        self.thinks = 0.0  # [s] of the next cycle

    def reset(self, goal: Pose2D, belief: Any, generators: Any) -> None:
        self.goal = goal
        self.belief = belief
        self.began.append((goal, belief))

    def tick(self, observation: Observation) -> Twist2D:
        self.seen.append(observation)
        time.sleep(self.thinks)
        self.thinks = 0.0
        if self.error is not None:
            raise self.error
        return Twist2D(0.5)


class Rig:
    """A robot's sensors and base, and the node that drives it, each with a thread."""

    def __init__(self, is_simulated: bool) -> None:
        self.told: list[str] = []
        self.leaving: list[str] = []  # publishers that are to end
        self.commands: list[tuple[float, float]] = []  # [s] of arrival, [m/s]
        self.brain, self.shift = Eager(), 0.0  # [s] of scans' stamps
        self.clock = time.time
        self.node = drive.DriveNode(
            self.brain, Ros2Params(), Pose2D(), 50.0, 0, self.told.append, is_simulated=is_simulated
        )
        self.robot = rclpy.create_node("rig")
        publish = self.robot.create_publisher
        self.publishers = {
            "scan": publish(LaserScan, "scan", 10),
            "odom": publish(Odometry, "odom", 10),
        }
        if is_simulated:
            began = time.time()
            self.clock = lambda: BEGIN + time.time() - began
            self.publishers["clock"] = publish(Clock, "/clock", 10)
        self.start = publish(PoseWithCovarianceStamped, "initialpose", 10)
        self.goal = publish(PoseStamped, "goal_pose", 10)
        self.robot.create_subscription(TwistStamped, "cmd_vel", self._take_command, 10)
        self.executor = SingleThreadedExecutor()
        self.executor.add_node(self.robot)
        self._ends = threading.Event()
        self.stopped = threading.Event()
        self._threads = [threading.Thread(target=each) for each in (self._sense, self._drive)]
        for thread in self._threads:
            thread.start()

    def _drive(self) -> None:
        while not self._ends.is_set() and not self.stopped.is_set():
            self.node._spin_once()
        self.node.spin(0.0)

    def _sense(self) -> None:
        while not self._ends.is_set():
            self.executor.spin_once(timeout_sec=PERIOD)
            self.send()

    def send(self) -> None:
        """Publish what sensors see now."""
        while self.leaving:
            self.robot.destroy_publisher(self.publishers.pop(self.leaving.pop()))
            self.lost = time.monotonic()
        now, publishers = self.clock(), self.publishers
        if "scan" in publishers:
            scan = LaserScan(angle_increment=0.1, range_min=0.1, range_max=9.0)
            scan.ranges = [5.0] * 10
            scan.header.stamp = messages.time_of(now + self.shift)
            publishers["scan"].publish(scan)
        if "odom" in publishers:
            odometry = Odometry()
            odometry.header.stamp = messages.time_of(now)
            publishers["odom"].publish(odometry)
        if "clock" in publishers:
            publishers["clock"].publish(Clock(clock=messages.time_of(now)))

    def lose(self, name: str) -> None:
        """End a publisher, in the thread that publishes."""
        self.leaving.append(name)

    def set_off(self) -> None:
        """Send a start and a goal until the robot drives."""
        deadline = time.monotonic() + 20.0
        while not self.commands or self.commands[-1][1] == 0.0:
            assert time.monotonic() < deadline, self.told
            self.start.publish(messages.start_message(Pose2D(), 0.0, "map"))
            self.goal.publish(messages.goal_message(Pose2D(5.0), 0.0, "map"))
            time.sleep(0.2)

    def stands_after(self, began: float, limit: float = 10.0) -> float:
        """How long after a moment [s] the first command to stand came that was not revoked."""
        time.sleep(0.4)
        while self.commands[-1][1] != 0.0 and time.monotonic() < began + limit:
            time.sleep(0.05)
        moving = [stamp for stamp, speed in self.commands if speed != 0.0]
        standing = [stamp for stamp, speed in self.commands if speed == 0.0 and stamp > moving[-1]]
        assert standing, "it drives on"
        return standing[0] - began

    def close(self) -> None:
        self._ends.set()
        for thread in self._threads:
            thread.join(20.0)
        self.executor.shutdown()
        self.robot.destroy_node()

    def _take_command(self, message: TwistStamped) -> None:
        self.commands.append((time.monotonic(), message.twist.linear.x))


@pytest.fixture
def make_rig() -> Iterator[Callable[[bool], Rig]]:
    drive.join()
    made: list[Rig] = []

    def make(is_simulated: bool) -> Rig:
        made.append(Rig(is_simulated))
        made[0].set_off()
        return made[0]

    yield make
    for rig in made:
        rig.close()


@pytest.mark.parametrize(
    ("is_simulated", "lost"), [(False, "scan"), (False, "odom"), (True, "scan"), (True, "clock")]
)
def test_it_stands_once_a_publisher_is_gone(
    make_rig: Callable[[bool], Rig], is_simulated: bool, lost: str
) -> None:
    rig = make_rig(is_simulated)
    began = time.monotonic()
    rig.lose(lost)
    assert rig.stands_after(began) < WITHIN
    assert any(f"nobody publishes {lost}" in line.replace("/", "") for line in rig.told)


@pytest.mark.parametrize("jump", [-3600.0, -0.5, 30.0])
def test_it_stands_after_a_jump_of_the_wall_clock(
    make_rig: Callable[[bool], Rig], monkeypatch: pytest.MonkeyPatch, jump: float
) -> None:
    rig, real = make_rig(False), time.time
    began = time.monotonic()
    monkeypatch.setattr(time, "time", lambda: real() + jump)
    assert rig.stands_after(began) < WITHIN
    assert any("clock jumped" in line for line in rig.told)


def test_a_stamp_in_the_future_is_not_a_fresh_scan(make_rig: Callable[[bool], Rig]) -> None:
    rig = make_rig(False)
    began, rig.shift = time.monotonic(), 1000.0
    assert rig.stands_after(began) < WITHIN
    assert any("no scan with a stamp within" in line for line in rig.told)


def test_it_stands_when_the_brain_fails_and_takes_the_next_goal(
    make_rig: Callable[[bool], Rig],
) -> None:
    rig = make_rig(False)
    began, rig.brain.error = time.monotonic(), InputError("nothing works")
    assert rig.stands_after(began) < WITHIN
    rig.brain.error = None
    rig.set_off()


def test_a_command_that_took_too_long_is_not_sent_and_the_goal_is_kept(
    make_rig: Callable[[bool], Rig],
) -> None:
    rig = make_rig(False)
    goals, before = len(rig.brain.began), len(rig.commands)
    rig.brain.thinks = 1.3
    time.sleep(2.0)
    assert any("a cycle took more than 1 s" in line for line in rig.told)
    stood = [speed for _, speed in rig.commands[before:]].index(0.0)
    silent = rig.commands[before + stood][0] - rig.commands[before + stood - 1][0]
    assert silent > 1.2, "the first command after the long cycle is to stand"
    assert rig.commands[-1][1] != 0.0, "it drives on"
    assert len(rig.brain.began) == goals
    assert not any("clock jumped" in line for line in rig.told)


def test_in_simulation_a_long_cycle_is_no_jump_of_the_clock(
    make_rig: Callable[[bool], Rig],
) -> None:
    """How much of its time the simulator's clock took for it nobody knows."""
    rig = make_rig(True)
    goals = len(rig.brain.began)
    for _ in range(2):
        rig.brain.thinks = 1.3
        time.sleep(1.8)
    assert rig.commands[-1][1] != 0.0
    assert len(rig.brain.began) == goals and not any("jumped" in line for line in rig.told)


def test_fixes_from_elsewhere_are_told_once() -> None:
    drive.join()
    told: list[str] = []
    node = drive.DriveNode(Eager(), Ros2Params(), Pose2D(), 50.0, 0, told.append)
    fix = sound(NavSatFix)
    fix.status.status = 0
    for fix.latitude, fix.longitude in ((47.37, 8.54), (47.38, 8.54), (34.05, -118.25)):
        node._take_fix(fix)
    assert node.refused == 2
    (line,) = told
    assert "fixes are refused: (47.37, 8.54)" in line and "--datum LATITUDE LONGITUDE" in line
    node.spin(0.0)


def test_the_last_command_is_to_stand(make_rig: Callable[[bool], Rig]) -> None:
    rig = make_rig(False)
    began = time.monotonic()
    rig.stopped.set()
    assert rig.stands_after(began) < WITHIN


def test_a_flood_does_not_hold_commands_up(make_rig: Callable[[bool], Rig]) -> None:
    """Neither the next command, nor the one to stand."""
    rig = make_rig(True)
    before, until = len(rig.commands), time.monotonic() + 1.0
    flood = rig.robot.create_publisher(Imu, "imu", 10)
    while time.monotonic() < until:
        flood.publish(Imu())
    assert len(rig.commands) > before + 5
    began = time.monotonic()
    rig.lose("scan")
    while time.monotonic() < began + 0.4:
        flood.publish(Imu())
    assert rig.stands_after(rig.lost) < WITHIN  # the flood holds the rig up, too


def sound(kind: type) -> Any:
    """A message that can be used."""
    message = kind()
    message.header.frame_id, message.header.stamp = "map", messages.time_of(time.time())
    if kind is LaserScan:
        message.angle_increment, message.range_min, message.range_max = 0.1, 0.1, 9.0
        message.ranges = [5.0, math.inf, math.nan]
    return message


def hostile(kind: type, chance: random.Random) -> Any:
    """A message with numbers that no robot has in some of its fields."""
    message = sound(kind)
    for path in FIELDS[kind]:
        if chance.random() < SHARE:
            place = message
            for name in path[:-1]:
                place = getattr(place, name)
            values: Any = chance.choice(HOSTILE)
            if path[-1] == "ranges":
                values = [min(max(values, -1e38), 1e38)] * chance.choice((0, 1, 3, 200))
            setattr(place, path[-1], values)
    if chance.random() < SHARE:
        message.header.frame_id = chance.choice(("", "odom"))
    if chance.random() < SHARE:
        message.header.stamp = messages.time_of(chance.choice((0.0, 2e9)))
    return message


TURN = [("orientation", name) for name in "xyzw"]
POSE = [("position", "x"), ("position", "y"), *TURN]
FIELDS: dict[type, list[tuple[str, ...]]] = {
    Odometry: [
        *[("pose", "pose", *path) for path in POSE],
        ("twist", "twist", "linear", "x"),
        ("twist", "twist", "angular", "z"),
    ],
    LaserScan: [("ranges",), ("angle_increment",), ("angle_min",)],
    Imu: [
        *TURN,
        ("angular_velocity", "z"),
        ("linear_acceleration", "x"),
    ],
    NavSatFix: [("latitude",), ("longitude",), ("altitude",)],
    PoseStamped: [("pose", *path) for path in POSE],
    PoseWithCovarianceStamped: [("pose", "pose", *path) for path in POSE],
}
TAKES = {
    Odometry: "_take_odometry",
    LaserScan: "_take_scan",
    Imu: "_take_imu",
    NavSatFix: "_take_fix",
    PoseStamped: "_take_goal",
    PoseWithCovarianceStamped: "_take_start",
}
ROUNDS = 300
SHARE = 0.1  # of fields that are hostile


def test_nothing_unusable_reaches_the_brain() -> None:
    """Messages straight into the node's callbacks: ``ROUNDS`` of each type."""
    drive.join()
    brain, told, chance = Eager(), [], random.Random(5)
    node = drive.DriveNode(brain, Ros2Params(), Pose2D(), 50.0, 0, told.append, is_simulated=False)
    node._gone = lambda: ""
    for _ in range(ROUNDS):
        for kind, take in TAKES.items():
            getattr(node, take)(hostile(kind, chance))
        node._tick(time.time())
    assert node.refused > ROUNDS / 2
    assert len(brain.seen) > 20
    limits = Pose2D(*[1e7] * 3).as_array()
    assert (np.abs(brain.goal.as_array()) <= limits).all()
    for seen in brain.seen:
        if seen.odometry is not None:
            assert (np.abs(seen.odometry.pose.as_array()) <= limits).all()
            assert abs(seen.odometry.twist.linear_x) <= 1e4
        if seen.gps is not None:
            assert math.hypot(seen.gps.x, seen.gps.y) <= 1e7
        if seen.imu is not None:
            assert abs(seen.imu.angular_velocity_z) <= 1e4
        if seen.scan is not None:
            assert len(seen.scan.ranges) > 1 and not np.isnan(seen.scan.ranges).all()
    node.spin(0.0)


@pytest.mark.parametrize("fault", ["cells", "resolution", "origin", "empty"])
def test_a_map_that_is_none_is_one_line(fault: str) -> None:
    message = OccupancyGrid(data=[0] * 6)
    message.info.width, message.info.height, message.info.resolution = 3, 2, 0.05
    assert messages.grid_of(message).data.shape == (2, 3)
    if fault == "cells":
        message.info.width = 2**31
    elif fault == "resolution":
        message.info.resolution = struct.unpack("f", b"\x00\x00\xc0\x7f")[0]  # not a number
    elif fault == "origin":
        message.info.origin.position.x = 1e308
    else:
        message.data, message.info.width = [], 0
    with pytest.raises(InputError, match="/map has"):
        messages.grid_of(message)


def test_a_later_goal_goes_on_from_where_the_robot_is() -> None:
    brain, told = Eager(), []
    drive.join()
    node = drive.DriveNode(brain, Ros2Params(), Pose2D(), 50.0, 0, told.append, is_simulated=False)

    def send(x: float) -> None:
        node._take_goal(messages.goal_message(Pose2D(x, 0.0), 0.0, "map"))

    send(30.0)
    assert brain.began == [] and "came before /initialpose" in told[0]
    node._take_start(messages.start_message(Pose2D(1.0, 0.0), 0.0, "map"))
    send(30.0)
    brain.belief = Belief(Pose2D(29.9, 0.0), 0.01 * np.eye(3), stamp=40.0)
    send(60.0)
    (_, first), (goal, second) = brain.began
    assert (first.pose.x, goal.x, second.pose.x) == (1.0, 60.0, 29.9)
    assert second.covariance[0, 0] == 0.01 and second.stamp == 0.0
    node._give_up("the clock jumped")
    send(90.0)
    assert len(brain.began) == 2 and "came before /initialpose" in told[-1]
    node._take_start(messages.start_message(Pose2D(5.0, 0.0), 0.0, "map"))
    send(90.0)
    assert brain.began[-1][1].pose.x == 5.0
    node.spin(0.0)
