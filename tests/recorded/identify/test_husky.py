"""The log of a real Husky, which has wheels, an inertial unit and fixes, but no commands."""

import os
from pathlib import Path

import numpy as np
import pytest

from harness.identify.identification import Identified, identify
from harness.identify.robot_file import DEFAULT_ROBOT
from harness.recorded.drive_log import DriveLog
from harness.recorded.log import LogRequest, read_log
from harness.storage.shipped import shipped
from harness.world.physics.robot import RobotParams
from navstack.params.strict import load_dataclass

DATA = Path(os.environ.get("NAVSTACK_DATA", "missing"))
HUSKY = DATA / "robot_localization" / "test1.bag"
MOUNTED = (
    "base_link imu_link 0 -0.3 0.52 1.5707963 0 -1.5707963",
    "base_link gps 0 0 0 0 0 0",
)

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not HUSKY.is_file(), reason="NAVSTACK_DATA has no log of the Husky"),
]


@pytest.fixture(scope="module")
def log() -> DriveLog:
    return read_log(LogRequest((HUSKY,), MOUNTED), lambda _: None)


@pytest.fixture(scope="module")
def found(log: DriveLog) -> Identified:
    default = shipped("params") / "robots" / f"{DEFAULT_ROBOT}.yaml"
    return identify(log, load_dataclass(RobotParams, default))


@pytest.mark.slow
def test_turns_are_those_of_the_gyro(log: DriveLog, found: Identified) -> None:
    scale = found.estimates["odometry_angular_scale"]
    yaw = np.unwrap(log.odometry[:, 3])
    gyro = np.trapezoid(log.imu[:, 2], log.imu[:, 0])
    # 3.46 rad by the wheels, 3.60 by the gyro from beginning to end
    assert scale.low < (yaw[-1] - yaw[0]) / gyro < scale.high
    assert scale.high - scale.low < 0.05


def test_the_filter_of_its_yaw_rate_is_no_delay_of_the_gyro(found: Identified) -> None:
    # the driver reports yaw rates 0.35 s late, its poses are not
    assert found.value("imu_stamp_delay_s") == pytest.approx(0.08, abs=0.05)


def test_turns_of_the_unused_half_are_predicted(found: Identified) -> None:
    of_turns = [each for each in found.predictions if each.against == "gyro"]
    assert [each.horizon_s for each in of_turns] == pytest.approx([0.1, 10.0], abs=0.01)
    for error in of_turns:
        assert error.n > 90 and error.gain_high_m > 0.0
        assert error.identified_m < error.constant_twist_m
    assert of_turns[1].identified_m < of_turns[1].default_m


def test_its_fixes_do_not_resolve_the_difference(found: Identified) -> None:
    of_places = [each for each in found.predictions if each.against == "fixes"]
    assert len(of_places) == 2
    for error in of_places:
        assert error.gain_low_m < 0.0 < error.gain_high_m
        assert error.identified_m < error.constant_twist_m


def test_what_needs_commands_is_not_identifiable(found: Identified) -> None:
    for key in ("dead_time_s", "lag_s", "linear_max_acceleration_mps2"):
        assert "cmd_vel" in found.estimates[key].advice
