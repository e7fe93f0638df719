"""Behaviors on an ideal robot, against hand-computed speeds and Nav2's numbers of what failed."""

import math

import numpy as np
import pytest

from navstack.behaviors.behavior_server import BehaviorServer
from navstack.behaviors.drive import BackUp, BackUpGoal, DriveGoal, DriveOnHeading
from navstack.behaviors.spin import Spin, SpinGoal
from navstack.behaviors.wait import Wait, WaitGoal
from navstack.costmap.costmap import LETHAL_OBSTACLE, NO_INFORMATION, Costmap
from navstack.errors import BehaviorError, ParameterError
from navstack.params.extensions import algorithms
from navstack.params.servers import BehaviorServerParams, DriveParams
from navstack.types import Pose2D, RobotState, Twist2D

FOOTPRINT = np.array([[0.2, 0.2], [0.2, -0.2], [-0.6, -0.2], [-0.6, 0.2]])  # a long tail
SERVER = BehaviorServerParams()
CYCLE = 1.0 / SERVER.cycle_frequency  # [s]
START = Pose2D(5.0, 5.0, 0.3)
GOALS = {
    "nav2_behaviors::Spin": SpinGoal(target_yaw=-1.57),
    "nav2_behaviors::BackUp": BackUpGoal(target_x=0.3, speed=0.15),
    "nav2_behaviors::DriveOnHeading": DriveGoal(target_x=0.3, speed=0.15),
    "nav2_behaviors::Wait": WaitGoal(duration=2.0),
}


def field() -> Costmap:
    """10 m x 10 m of free space."""
    return Costmap(np.zeros((200, 200), dtype=np.uint8), 0.05, 0.0, 0.0)


def make(kind, params=None, server=SERVER):
    """A behavior by its class, or by its type in a Nav2 file."""
    if isinstance(kind, str):
        entry = algorithms("behaviors")[kind]
        return entry.create(
            server, FOOTPRINT, entry.params and (params or entry.params()), parts={}
        )
    is_driver = issubclass(kind, DriveOnHeading)
    return kind(server, FOOTPRINT, (params or DriveParams()) if is_driver else None)


def moved(pose: Pose2D, command: Twist2D) -> Pose2D:
    """Where an ideal robot is one cycle later."""
    yaw = pose.yaw + command.angular_z * CYCLE
    step = command.linear_x * CYCLE
    return Pose2D(pose.x + step * math.cos(pose.yaw), pose.y + step * math.sin(pose.yaw), yaw)


def run(behavior, goal, costmap, start=START, began=0.0, obeys=True):
    """All commands until the behavior is done, and where the robot is then.

    The odom frame lies elsewhere.
    """
    pose = start
    odom = Pose2D(-3.0, 7.0, 3.0)
    behavior.start(goal, RobotState(pose, Twist2D(), began, odom))
    commands = []
    for k in range(1000):
        command = behavior.step(RobotState(pose, Twist2D(), began + k * CYCLE, odom), costmap)
        if command is None:
            return commands, pose
        commands.append(command)
        if obeys:
            pose = moved(pose, command)
            odom = moved(odom, command)
            odom = Pose2D(odom.x, odom.y, math.remainder(odom.yaw, math.tau))
    raise AssertionError("it never ends")


def test_every_behavior_has_a_goal() -> None:
    assert algorithms("behaviors").keys() == GOALS.keys()


@pytest.mark.parametrize("name", GOALS)
def test_every_behavior_ends_and_starts_afresh(name: str) -> None:
    behavior = make(name)
    first = run(behavior, GOALS[name], field())
    assert first[0]
    assert run(behavior, GOALS[name], field(), began=100.0) == first


@pytest.mark.parametrize("name", GOALS)
def test_every_behavior_fails_when_its_time_is_up(name: str) -> None:
    behavior = make(name)
    goal = GOALS[name]
    behavior.start(
        type(goal)(*_values(goal), time_allowance=0.5), RobotState(START, Twist2D(), 10.0)
    )
    assert behavior.step(RobotState(START, Twist2D(), 10.5), field()) is not None
    if name == "nav2_behaviors::Wait":
        return  # Nav2 gives waiting no time allowance
    with pytest.raises(BehaviorError) as caught:
        behavior.step(RobotState(START, Twist2D(), 10.6), field())
    numbers = {
        "nav2_behaviors::Spin": 701,
        "nav2_behaviors::BackUp": 711,
        "nav2_behaviors::DriveOnHeading": 721,
    }
    assert caught.value.code == "TIMEOUT"
    assert caught.value.number == numbers[name]


def _values(goal):
    return [
        getattr(goal, name) for name in type(goal).__dataclass_fields__ if name != "time_allowance"
    ]


@pytest.mark.parametrize("target", [1.57, -1.57, 5.0])
def test_spinning_brakes_as_the_acceleration_limit_allows(target: float) -> None:
    commands, pose = run(make(Spin), SpinGoal(target_yaw=target), field())
    turned = 0.0
    for command in commands:
        speed = math.sqrt(2.0 * 3.2 * (abs(target) - abs(turned)))
        expected = math.copysign(min(max(speed, 0.4), 1.0), target)
        assert command.angular_z == pytest.approx(expected, abs=1e-9)
        turned += command.angular_z * CYCLE
    assert abs(target) <= abs(pose.yaw - START.yaw) <= abs(target) + 0.4 * CYCLE + 1e-9
    assert commands[0].angular_z == math.copysign(1.0, target)
    assert abs(commands[-1].angular_z) < 1.0  # it was slowing down


def test_spinning_sees_only_as_far_ahead_as_it_has_turned() -> None:
    costmap = field()
    # the tail is there after 0.7 rad, its corner 0.32 rad earlier
    angle = START.yaw + math.pi + 0.7
    mx, my = costmap.world_to_map(5.0 + 0.6 * math.cos(angle), 5.0 + 0.6 * math.sin(angle))
    costmap.data[my, mx] = LETHAL_OBSTACLE
    behavior = make(Spin)
    behavior.start(SpinGoal(target_yaw=3.0), RobotState(START, Twist2D(), odom_pose=START))
    pose = START
    commands = 0
    with pytest.raises(BehaviorError) as caught:
        while True:
            command = behavior.step(RobotState(pose, Twist2D(), odom_pose=pose), costmap)
            pose = moved(pose, command)
            commands = commands + 1
    assert caught.value.code == "COLLISION_AHEAD"
    assert caught.value.number == 703
    turned = pose.yaw - START.yaw  # it sees up to twice this angle
    assert 0.15 < turned < 0.35
    assert commands == round(turned / 0.1)  # 1 rad/s at 10 Hz


def test_backing_up_stops_for_what_lies_within_the_distance_left_to_drive() -> None:
    def outcome(gap: float):
        costmap = field()
        costmap.data[:, int((5.0 - 0.6 - gap) / 0.05)] = LETHAL_OBSTACLE
        return run(
            make(BackUp), BackUpGoal(target_x=0.3, speed=0.15), costmap, Pose2D(5.0, 5.0, 0.0)
        )

    with pytest.raises(BehaviorError) as caught:
        outcome(0.22)
    assert caught.value.code == "COLLISION_AHEAD"
    assert caught.value.number == 714
    commands, pose = outcome(0.42)
    assert set(commands) == {Twist2D(linear_x=-0.15)}
    assert pose.x == pytest.approx(4.7, abs=0.0151)  # one cycle's way


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_it_looks_along_its_heading_before_it_sets_out(way: float) -> None:
    goal = DriveGoal(target_x=way, speed=0.3 * way)
    heading = np.array((math.cos(START.yaw), math.sin(START.yaw)))
    for side in (1.0, -1.0):
        costmap = field()
        behavior = make(DriveOnHeading)
        mx, my = costmap.world_to_map(*(np.array((START.x, START.y)) + 0.72 * side * way * heading))
        costmap.data[my, mx] = LETHAL_OBSTACLE
        behavior.start(goal, RobotState(START, Twist2D(), odom_pose=START))
        if side < 0.0:
            assert (
                behavior.step(RobotState(START, Twist2D(), odom_pose=START), costmap).linear_x * way
                > 0.0
            )
            continue
        with pytest.raises(BehaviorError) as caught:
            behavior.step(RobotState(START, Twist2D(), odom_pose=START), costmap)
        assert caught.value.code == "COLLISION_AHEAD"


def test_unknown_ground_and_the_end_of_the_costmap_are_obstacles() -> None:
    costmap = field()
    costmap.data[:, 105:] = NO_INFORMATION
    with pytest.raises(BehaviorError) as caught:
        run(
            make(DriveOnHeading),
            DriveGoal(target_x=0.3, speed=0.15),
            costmap,
            Pose2D(5.0, 5.0, 0.0),
        )
    assert caught.value.number == 723
    with pytest.raises(BehaviorError) as caught:
        run(
            make(DriveOnHeading),
            DriveGoal(target_x=0.5, speed=0.25),
            field(),
            Pose2D(9.6, 5.0, 0.0),
        )
    assert caught.value.number == 723


@pytest.mark.parametrize(
    ("kind", "goal", "sign"),
    [
        (DriveOnHeading, DriveGoal(target_x=0.4, speed=0.3), 1.0),
        (DriveOnHeading, DriveGoal(target_x=-0.4, speed=-0.3), -1.0),
        (BackUp, BackUpGoal(target_x=0.4, speed=0.3), -1.0),
    ],
)
def test_driving_keeps_to_its_acceleration_limits(kind: type, goal: DriveGoal, sign: float) -> None:
    params = DriveParams(acceleration_limit=1.0, deceleration_limit=-0.5, minimum_speed=0.05)
    commands, pose = run(make(kind, params), goal, field(), Pose2D(5.0, 5.0, 0.0))
    last = driven = 0.0
    for command in commands:
        slowest = last - 0.5 * CYCLE
        fastest = last + 1.0 * CYCLE
        braking = math.sqrt(2.0 * 0.5 * (0.4 - driven))  # from which 0.5 m/s2 stops at the target
        last = max(min(max(0.3, slowest), fastest, braking), 0.05)
        assert sign * command.linear_x == pytest.approx(last, abs=1e-9)
        driven += last * CYCLE
    assert sign * (pose.x - 5.0) >= 0.4


def test_backing_up_goes_back_whatever_the_signs_and_driving_on_insists_on_equal_ones() -> None:
    for target, speed in ((0.3, 0.15), (-0.3, 0.15), (-0.3, -0.15)):
        commands, _ = run(make(BackUp), BackUpGoal(target_x=target, speed=speed), field())
        assert commands[0] == Twist2D(linear_x=-0.15)
    with pytest.raises(BehaviorError, match="differ in sign") as caught:
        make(DriveOnHeading).start(
            DriveGoal(target_x=0.3, speed=-0.1), RobotState(START, Twist2D())
        )
    assert caught.value.code == "INVALID_INPUT"
    assert caught.value.number == 724


def test_waiting_stands_for_as_long_as_it_is_told() -> None:
    commands, pose = run(make(Wait), WaitGoal(duration=5.0), field(), began=1.3)
    assert commands == [Twist2D()] * 50
    assert pose == START


def test_progress_is_measured_in_the_odom_frame() -> None:
    behavior = make(BackUp)
    behavior.start(BackUpGoal(target_x=0.3, speed=0.15), RobotState(START, Twist2D()))
    jumped = Pose2D(START.x + 2.0, START.y, START.yaw)
    assert behavior.step(RobotState(jumped, Twist2D(), 0.1, Pose2D()), field()) == Twist2D(
        linear_x=-0.15
    )
    assert behavior.step(RobotState(START, Twist2D(), 0.2, Pose2D(-0.3)), field()) is None


def test_the_server_runs_one_behavior_at_a_time() -> None:
    server = BehaviorServer({"spin": make(Spin), "wait": make(Wait), "odd": make(Wait)}, field())
    state = RobotState(START, Twist2D())
    assert server.step(state) is None
    server.start("spin", SpinGoal(target_yaw=1.0), state)
    assert server.step(state).angular_z > 0.0
    server.start("wait", WaitGoal(duration=1.0), state)
    assert server.step(state) == Twist2D()
    assert server.step(RobotState(START, Twist2D(), 1.0)) is None
    server.start("wait", WaitGoal(duration=1.0), state)
    server.reset()
    assert server.step(state) is None


@pytest.mark.parametrize(
    ("name", "goal"), [("backup", BackUpGoal(0.3, 0.15)), ("spin", WaitGoal(1.0))]
)
def test_the_server_refuses_what_the_file_does_not_offer(name, goal) -> None:
    server = BehaviorServer({"spin": make(Spin)}, field())
    with pytest.raises(BehaviorError, match="behaviors of the file: spin") as caught:
        server.start(name, goal, RobotState(START, Twist2D()))
    assert caught.value.code == "UNAVAILABLE"
    assert caught.value.number == 0


@pytest.mark.parametrize(
    "values",
    [{"cycle_frequency": 0.0}, {"max_rotational_vel": -0.1}, {"simulate_ahead_time": -1.0}],
)
def test_senseless_parameters_are_refused(values) -> None:
    with pytest.raises(ParameterError, match=next(iter(values))):
        BehaviorServerParams(**values)


def test_limits_with_the_wrong_sign_count_with_the_right_one() -> None:
    """Nav2 logs an error and turns them (``drive_on_heading.hpp``)."""
    turned = DriveParams(acceleration_limit=-1.0, deceleration_limit=0.5)
    assert turned == DriveParams(acceleration_limit=1.0, deceleration_limit=-0.5)
    assert DriveParams(0.0, 0.0) == DriveParams()
