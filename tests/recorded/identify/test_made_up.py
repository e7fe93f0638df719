"""Made-up drives whose truth is known."""

import dataclasses

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

from harness.identify import travel
from harness.identify.collisions import find_impacts
from harness.identify.identification import _twist_noise
from harness.identify.stillness import lidar_noise
from harness.identify.turning import fit_turning
from harness.identify.wheel_path import path_of
from harness.recorded.drive_log import DriveLog, Pauses
from harness.recorded.log import _fill_twist
from harness.storage.shipped import shipped
from harness.world.physics.robot import RobotParams
from navstack.params.strict import load_dataclass
from navstack.types import FloatArray, LaserScan, Pose2D

STAND, SCALE, DELAY = 10.0, 1.02, 0.043  # [s] at first, [-] of the odometry, [s] of the gyro
NOISE = 0.02  # [m] of fixes and ranges
RADIUS = 1.6  # [m] of the figure of eight
SEGWAY = load_dataclass(RobotParams, shipped("params") / "robots" / "segway_e1.yaml")


def eight(seconds: float = 150.0, antenna: float = 0.0, seed: int = 0) -> DriveLog:
    """Figures of eight by wheels that count 2 % too much, an exact gyro and RTK fixes."""
    rng = np.random.default_rng(seed)
    stamps = np.arange(0.0, seconds, 0.02)
    speeds = np.where(stamps < STAND, 0.0, 0.8)
    rates = speeds / RADIUS * np.sin(0.25 * (stamps - STAND))
    yaw = cumulative_trapezoid(rates, stamps, initial=0.0)
    x = cumulative_trapezoid(speeds * np.cos(yaw), stamps, initial=0.0)
    y = cumulative_trapezoid(speeds * np.sin(yaw), stamps, initial=0.0)
    odometry = np.column_stack((stamps, SCALE * x, SCALE * y, yaw, SCALE * speeds, rates))
    times = np.arange(0.0, seconds, 0.01)
    gyro = np.interp(times - DELAY, stamps, rates) + 0.003 * rng.standard_normal(len(times))
    imu = np.column_stack((times, np.full(len(times), np.nan), gyro, 0.0 * times, 0.0 * times))
    at = np.arange(1.0, seconds - 1.0, 0.2)
    heading = np.interp(at, stamps, yaw)
    places = [np.interp(at, stamps, x), np.interp(at, stamps, y)]
    places[0] += antenna * np.cos(heading) + NOISE * rng.standard_normal(len(at))
    places[1] += antenna * np.sin(heading) + NOISE * rng.standard_normal(len(at))
    fixes = np.column_stack((at, *places, np.full(len(at), NOISE)))
    none = np.empty((0, 3))
    given = (odometry, imu, fixes, np.empty((0, 4)), np.empty(0), [], {}, True, {}, "made up")
    return DriveLog(0.0, none, *given, np.empty(0), np.array((antenna, 0.0)))


def scale_of(log: DriveLog) -> float:
    estimate = travel.fit_fixes(log, path_of(log, fit_turning(log)), NOISE).scale
    assert estimate.value is not None and estimate.low is not None and estimate.high is not None
    assert estimate.high - estimate.low < 0.003
    return estimate.value


@pytest.mark.parametrize("antenna", [0.0, 0.6])
def test_an_antenna_beside_the_base_is_no_length(antenna: float) -> None:
    assert scale_of(eight(antenna=antenna)) == pytest.approx(SCALE, abs=0.001)


@pytest.mark.parametrize(("begin", "end"), [(30.0, 1e9), (0.0, 90.0)])
def test_where_the_gyro_was_off_the_odometry_tells_the_heading(begin: float, end: float) -> None:
    log = eight()
    seen = (log.imu_stamps >= begin) & (log.imu_stamps < end)
    assert scale_of(dataclasses.replace(log, imu=log.imu[seen])) == pytest.approx(SCALE, abs=0.001)
    gap = (log.imu_stamps < 60.0) | (log.imu_stamps > 80.0)
    assert scale_of(dataclasses.replace(log, imu=log.imu[gap])) == pytest.approx(SCALE, abs=0.001)


def test_an_odometry_that_begins_anew_turns_and_drives_nothing_there() -> None:
    log = eight()
    odometry, half = log.odometry.copy(), len(log.odometry) // 2 + 150
    x, y, yaw = odometry[half, 1:4]
    cos, sin = np.cos(yaw), np.sin(yaw)
    dx, dy = (odometry[half:, 1:3] - (x, y)).T
    odometry[half:, 1:3] = np.column_stack((cos * dx + sin * dy, cos * dy - sin * dx))
    odometry[half:, 3] -= yaw
    anew = dataclasses.replace(log, odometry=odometry, imu=log.imu[:0])
    assert np.hypot(x, y) > 1.0 and np.flatnonzero(anew.jumps).tolist() == [half - 1]
    assert scale_of(anew) == pytest.approx(SCALE, abs=0.001)


def test_the_gyros_delay_is_found_in_its_noise() -> None:
    late = fit_turning(eight()).estimates[-1]
    assert late.low is not None and late.high is not None
    assert late.low <= DELAY <= late.high and late.high - late.low < 0.006


def test_pairs_of_scans_are_found_in_a_log_of_any_length(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(travel, "match", lambda before, after, guess: guess)
    monkeypatch.setattr(travel.Surfaces, "of", classmethod(lambda cls, scan: scan))
    for seconds in (300.0, 900.0):
        log = eight(seconds)
        stamps = np.arange(1.0, seconds - 1.0, 0.1).tolist()
        scans = [LaserScan(stamp, np.ones(3), 0.0, 0.1, 0.1, 30.0, Pose2D()) for stamp in stamps]
        pairs, _ = travel._matched(
            dataclasses.replace(log, scans=scans), path_of(log, fit_turning(log))
        )
        assert len(pairs) > 400
        assert np.allclose(np.diff(pairs, axis=1), 0.7)


@pytest.mark.parametrize("nothing", [np.inf, 0.0, 65.533])
def test_ranges_that_mean_nothing_have_no_noise(nothing: float) -> None:
    rng = np.random.default_rng(0)
    log = eight(30.0)
    scans = []
    for stamp in np.arange(0.5, 9.0, 0.1).tolist():
        ranges = 5.0 + NOISE * rng.standard_normal(360)
        ranges[rng.random(360) < 0.6] = nothing
        scans.append(LaserScan(stamp, ranges, 0.0, 0.01, 0.05, 30.0, Pose2D()))
    noise, dropout = lidar_noise(dataclasses.replace(log, scans=scans))
    assert noise.value == pytest.approx(NOISE, rel=0.05)
    assert dropout.value == pytest.approx(0.6, abs=0.15)


def test_encoders_that_stand_have_no_part_in_the_noise_of_speeds() -> None:
    log = eight()
    odometry = log.odometry.copy()
    moving = odometry[:, 0] > 80.0
    odometry[~moving, 1:3] = odometry[moving, 1:3][0]
    odometry[:, 4] = np.where(moving, odometry[:, 4], 0.0)
    odometry[moving, 4] += 0.03 * np.random.default_rng(0).standard_normal(moving.sum())
    odometry[~moving, 3] = odometry[moving, 3][0]
    found = _twist_noise(dataclasses.replace(log, odometry=odometry), None, None)[0]
    assert found.value == pytest.approx(0.03, rel=0.05)


def ramps(commands: FloatArray) -> DriveLog:
    """Up to 1 m/s and down again at 2 m/s2, every ten seconds, at 20 Hz."""
    log = eight(60.0)
    stamps = np.arange(0.0, 60.0, 0.05)
    phase = stamps % 10.0
    speeds = np.clip(np.minimum(2.0 * (phase - 2.0), 2.0 * (7.0 - phase)), 0.0, 1.0)
    zero = np.zeros(len(stamps))
    x = np.cumsum(speeds) * 0.05
    odometry = np.column_stack((stamps, x, zero, zero, speeds, zero))
    return dataclasses.replace(log, odometry=odometry, imu=log.imu[:0], commands=commands)


def test_what_the_drive_can_do_is_no_contact_where_nobody_knows_the_commands() -> None:
    robot = dataclasses.replace(SEGWAY, max_acceleration=2.0, max_deceleration=2.5)
    none = np.empty((0, 3))
    assert find_impacts(ramps(none), robot).found == ()
    ceased = np.column_stack((np.arange(0.0, 5.0, 0.05), np.full(100, 1.0), np.zeros(100)))
    assert find_impacts(ramps(ceased), robot).found == ()
    hit = ramps(none)
    hit.odometry[:, 4] = np.where(hit.stamps > 34.0, 0.0, hit.odometry[:, 4])  # 1 m/s in 0.05 s
    assert [round(each.stamp) for each in find_impacts(hit, robot).found] == [34]


def test_an_inertial_unit_that_ended_hides_no_contact() -> None:
    robot = dataclasses.replace(SEGWAY, max_acceleration=2.0, max_deceleration=2.5)
    log = ramps(np.empty((0, 3)))
    log.odometry[:, 4] = np.where(log.stamps > 34.0, 0.0, log.odometry[:, 4])
    times = np.arange(0.0, 15.0, 0.01)
    forces = 0.05 * np.random.default_rng(0).standard_normal((len(times), 2))
    imu = np.column_stack((times, np.full((len(times), 1), np.nan), 0.0 * times, forces))
    impacts = find_impacts(dataclasses.replace(log, imu=imu), robot)
    assert impacts.source == "imu"
    assert [round(each.stamp) for each in impacts.found] == [34]


def test_a_switch_of_a_robot_without_power_counts_when_that_went() -> None:
    pauses = Pauses(np.array((20.0,)), np.array((35.0,)))
    assert pauses.at_begins(np.array((3.0, 20.5, 33.0, 36.0))).tolist() == [3.0, 20.0, 20.0, 36.0]


def test_velocities_from_poses_are_none_of_a_jump() -> None:
    stamps = np.arange(0.0, 10.0, 0.1)
    x = np.where(stamps < 5.0, stamps, stamps - 5.0)
    odometry = np.column_stack((stamps, x, *np.zeros((4, len(stamps)))))
    odometry[stamps >= 5.0, 2] = 100.0
    assert _fill_twist(odometry)
    assert odometry[:, 4] == pytest.approx(np.ones(len(stamps)))
