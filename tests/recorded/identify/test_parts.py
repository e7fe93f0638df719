"""Logs in parts, short ones, with a gamepad, on another map: what is no driving is told."""

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest

from harness.identify.drive_events import _hard_brakes, _interventions, doubt_of_map
from harness.recorded.drive_log import LEFT, PAUSE, DriveLog, Pauses
from harness.recorded.log import LogRequest, read_log
from navbench.api.cost_log import cost_log
from navbench.api.identify import identify
from navbench.cli.app import main
from navstack.costmap.occupancy_grid import OCCUPIED
from navstack.types import Pose2D

from ..writing import START, Entry, imu, odometry, scan, transforms
from . import drives, missions

DAY = 86_400.0  # [s]


def straight(since: float, speed: float = 1.0) -> list[Entry]:
    """Ten seconds straight on from the odometry's origin."""
    stamps = np.arange(0.0, 10.01, 0.05).tolist()
    return [odometry(START + since + t, Pose2D(speed * t), speed, 0.0) for t in stamps]


def read(tmp_path: Path, *parts: list[Entry]) -> tuple[DriveLog, list[str]]:
    """The log of some files, and what is said of it."""
    bags = [drives.write_mcap(tmp_path / f"{n}.mcap", part) for n, part in enumerate(parts)]
    told: list[str] = []
    return read_log(LogRequest(tuple(bags)), told.append), told


def test_a_pause_is_no_driving(tmp_path: Path) -> None:
    between = scan(START + 3600.0, np.ones(9), 0.0, 0.1)
    after = scan(START + DAY + 4.0, np.ones(9), 0.0, 0.1)
    log, told = read(tmp_path, straight(0.0), [between], [*straight(DAY), after])
    assert log.duration == pytest.approx(20.0 + LEFT, abs=0.01)
    assert log.steps.sum() == pytest.approx(20.0), "not the jump back to the odometry's origin"
    assert log.resumed == pytest.approx([10.0 + LEFT], abs=0.01)
    assert [each.stamp for each in log.scans] == pytest.approx([14.0 + LEFT], abs=0.01)
    assert f"the odometry pauses for 86390 s at 10 s; of each pause {LEFT:g} s are left" in told[-1]


def test_a_log_without_pauses_stays_as_it_is(tmp_path: Path) -> None:
    log, told = read(tmp_path, straight(0.0), straight(10.0 + PAUSE - 0.01))
    assert log.duration == pytest.approx(20.0 + PAUSE, abs=0.05)
    assert not len(log.resumed) and "pauses" not in " ".join(told)


def test_what_is_before_between_and_after_pauses() -> None:
    pauses = Pauses.between(np.array([0.0, 1.0, 101.0, 102.0, 1002.0]))
    stamps = np.array([-5.0, 1.0, 1.1, 100.9, 101.0, 102.0, 500.0, 1002.0, 1003.0])
    kept = pauses.leave(stamps)
    assert kept.tolist() == [True, True, False, False, True, True, False, True, True]
    expected = [-5.0, 1.0, 3.0, 4.0, 4.0 + LEFT, 5.0 + LEFT]
    assert pauses.taken_out(stamps[kept]) == pytest.approx(expected)


def test_a_robot_that_stands_elsewhere_after_a_pause_was_not_taken_over(tmp_path: Path) -> None:
    log, _ = read(tmp_path, straight(0.0, 0.0), straight(DAY, 0.0))
    carried = np.array([(5.0, 0.0, 0.0, 0.0), (15.0, 9.0, 0.0, 0.0)])
    assert _interventions(dataclasses.replace(log, poses=carried)) == []
    carried[:, 0] = 1.0, 5.0
    assert len(_interventions(dataclasses.replace(log, poses=carried))) == 1


@pytest.mark.parametrize(("spread", "count"), [(0.02, 1), (1.0, 1)])
def test_noise_of_fixes_is_no_takeover(tmp_path: Path, spread: float, count: int) -> None:
    """Of a receiver without corrections each fix is metres beside the last one."""
    log, _ = read(tmp_path, straight(0.0, 0.0))
    stamps = np.arange(0.0, 10.0, 0.1)
    places = np.random.default_rng(0).normal(0.0, spread, (len(stamps), 2))
    places[stamps > 5.0] += 20.0  # it is carried away
    fixes = np.column_stack((stamps, places, np.zeros(len(stamps))))
    assert len(_interventions(dataclasses.replace(log, fixes=fixes))) == count


@pytest.mark.parametrize("gap", [0.0, 2.0, DAY])
def test_what_is_missing_is_no_brake(tmp_path: Path, gap: float) -> None:
    """It stands when messages come again."""
    log, _ = read(tmp_path, straight(0.0, 1.5), straight(10.0 + gap, 0.0))
    brakes = _hard_brakes(log)
    assert [each.stamp for each in brakes] == ([] if gap else [pytest.approx(10.0, abs=0.2)])


@pytest.mark.parametrize(("pushed", "count"), [((1.0, 0.0), 0), ((1.0, 0.5), 1), ((-1.0, 0.0), 1)])
def test_a_trigger_at_rest_is_no_takeover(
    tmp_path: Path, pushed: tuple[float, float], count: int
) -> None:
    joystick = [
        Entry("/joy", "sensor_msgs/msg/Joy", START + at, {"axes": axes, "buttons": [0]})
        for at, axes in ((1.01, (1.0, 0.0)), (2.01, pushed))
    ]
    entries = sorted((*straight(0.0), *joystick), key=lambda entry: entry.stamp)
    log, _ = read(tmp_path, entries)
    assert len(log.takeovers) == count


@pytest.mark.parametrize("where", ["inside", "beyond", "in a wall"])
def test_poses_that_are_not_on_the_map_are_told(tmp_path: Path, where: str) -> None:
    scene = drives.yard()
    grid = scene.geometry
    row, column = np.argwhere(grid.data == OCCUPIED)[0]
    wall = np.array((column, row)) * grid.resolution + (grid.origin.x, grid.origin.y)
    places = {"inside": (0.0, 0.0), "beyond": (0.0, 99.0), "in a wall": wall + 0.01}
    log, _ = read(tmp_path, straight(0.0))
    assert doubt_of_map(log, scene) == "", "a log without poses says nothing"
    poses = np.zeros((10, 4))
    poses[5:, 1:3] = places[where]
    doubt = doubt_of_map(dataclasses.replace(log, poses=poses), scene)
    told = f"50% of the log's poses are not on free ground of map '{scene.name}'"
    assert doubt.startswith(told) == (where != "inside")


def test_a_drive_is_not_compared_with_itself(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bag = str(drives.write_mcap(tmp_path / "drive.mcap", straight(0.0)))
    with pytest.raises(SystemExit) as leaving:
        main(["cost-log", bag, "--against", bag, "--robot", "segway_e1", "--map", "sidewalk"])
    assert leaving.value.code == 1
    assert f"bag '{bag}' is given twice; give each once" in capsys.readouterr().err


def test_odometry_may_stand_in_transforms_alone(tmp_path: Path) -> None:
    """A metre a second, the laser 0.3 m ahead among the transforms."""
    moved = [
        transforms(
            START + t,
            ("odom", "base_link", (t, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)),
            ("base_link", "laser", (0.3, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)),
            topic="/tf",
        )
        for t in np.arange(0.0, 10.01, 0.05).tolist()
    ]
    bag = drives.write_mcap(tmp_path / "drive.mcap", moved)
    told: list[str] = []
    log = read_log(LogRequest((bag,)), told.append)
    assert told == ["there is no topic of odometry: it is taken from odom -> base_link in /tf"]
    assert log.steps.sum() == pytest.approx(9.95), "the first pose has no velocity"
    assert log.speeds == pytest.approx(1.0, abs=1e-4) and log.yaw_rates == pytest.approx(0.0)
    assert log.topics["nav_msgs/msg/Odometry"] == "/tf"


@pytest.mark.parametrize(
    ("others", "base"),
    [(("camera_pose",), None), (("camera_pose", "base_link"), "robot"), ((), "robot")],
)
def test_of_transforms_that_move_the_bases_is_taken(
    tmp_path: Path, others: tuple[str, ...], base: str | None
) -> None:
    """A camera that tracks by itself publishes first, and stands still."""
    own = base or "base_footprint"
    moved = [
        transforms(
            START + t,
            *(("odom", each, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)) for each in others),
            ("odom", own, (t, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)),
            topic="/tf",
        )
        for t in np.arange(0.0, 10.01, 0.05).tolist()
    ]
    bag = drives.write_mcap(tmp_path / "drive.mcap", moved)
    told: list[str] = []
    log = read_log(LogRequest((bag,), base_frame=base), told.append)
    assert told[0].startswith(f"there is no topic of odometry: it is taken from odom -> {own} in")
    assert log.steps.sum() == pytest.approx(9.95)


@pytest.mark.parametrize("is_told", [False, True])
def test_a_unit_whose_gravity_is_no_push_counts_once_its_mounting_is_told(
    tmp_path: Path, is_told: bool
) -> None:
    lying = gyro(100.0, 10.0)
    for entry in lying:
        entry.fields["linear_acceleration"] = {"x": 9.81}
        entry.fields["orientation_covariance"] = [-1.0] + [0.0] * 8  # it has none
    entries = sorted([*straight(0.0), *lying], key=lambda entry: entry.stamp)
    bag = drives.write_mcap(tmp_path / "drive.mcap", entries)
    given = ("base_link imu_link 0 0 0 0 -1.5707963 0",) if is_told else ()
    said: list[str] = []
    log = read_log(LogRequest((bag,), given), said.append)
    assert (len(log.imu) > 0) == is_told
    assert any("the inertial unit is left out" in line for line in said) != is_told
    assert np.abs(log.imu[:, 3:]).max(initial=0.0) < 0.1


def circle(rate: float, seconds: float, since: float = 0.0) -> list[Entry]:
    """Round a circle of a metre at 1 rad/s."""
    times = (np.arange(seconds * rate) / rate).tolist()
    return [
        odometry(START + since + t, Pose2D(math.sin(t), 1.0 - math.cos(t), t), 1.0, 1.0)
        for t in times
    ]


def gyro(rate: float, seconds: float, since: float = 0.0) -> list[Entry]:
    times = (np.arange(seconds * rate) / rate).tolist()
    return [imu(START + since + t, t, 1.0) for t in times]


@pytest.mark.parametrize(
    "entries",
    [
        [*circle(200.0, 0.1)],
        [*circle(20.0, 2.0), *gyro(100.0, 1.1)],
        [*circle(20.0, 4.0), *gyro(100.0, 4.0)],
        [*circle(20.0, 9.0), *gyro(100.0, 3.0, since=7.0)],
    ],
    ids=["a tenth of a second", "a second of gyro", "one long window", "hardly together"],
)
def test_a_short_log_has_costs_and_a_robot_file(tmp_path: Path, entries: list[Entry]) -> None:
    bag = drives.write_mcap(tmp_path / "drive.mcap", sorted(entries, key=lambda each: each.stamp))
    request = LogRequest((bag,))
    priced = cost_log(request, "segway_e1", str(missions.write_yard(tmp_path)))
    assert priced.cost.distance == pytest.approx(read_log(request, print).steps.sum())
    assert math.isfinite(priced.cost.total)
    robot = identify(request, tmp_path / "robot.yaml")
    assert robot.found.value("odometry_angular_scale") is None
