"""A robot is identified from a short drive, and its files are driven at once."""

import json
from pathlib import Path

import pytest

from harness.recorded.log import LogRequest
from harness.world.physics.robot import RobotParams
from harness.world.sensors.suite import SensorParams
from navbench.api.identify import IdentifiedRobot, identify
from navbench.cli.app import main
from navstack.params.strict import load_dataclass

from . import drives

DURATION = 75.0  # [s]
SHARE = {  # of the truth, in a drive as short as this
    "linear_max_acceleration_mps2": 0.05,
    "linear_max_deceleration_mps2": 0.05,
    "angular_max_acceleration_radps2": 0.05,
    "odometry_linear_scale": 0.02,
    "odometry_angular_scale": 0.02,
    "imu_yaw_rate_std_radps": 0.3,
    "imu_acceleration_std_mps2": 0.3,
    "lidar_noise_std_m": 0.1,
    "gps_position_std_m": 0.5,
    "odometry_velocity_std_mps": 0.3,
    "odometry_yaw_rate_std_radps": 0.3,
}
OFF = {"dead_time_s": 0.01, "lag_s": 0.02, "lidar_x_m": 0.03, "lidar_y_m": 0.03}
OFF |= {"lidar_yaw_rad": 0.02, "imu_yaw_rate_bias_radps": 0.001}


@pytest.fixture(scope="module")
def recorded() -> drives.Recorded:
    return drives.record(11, DURATION)


@pytest.fixture(scope="module")
def bag(recorded: drives.Recorded, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path: Path = tmp_path_factory.mktemp("drive") / "drive.mcap"
    return drives.write_mcap(path, recorded.entries)


@pytest.fixture(scope="module")
def robot(bag: Path) -> IdentifiedRobot:
    return identify(LogRequest((bag,)), bag.with_name("my_robot.yaml"))


@pytest.mark.parametrize("key", SHARE)
def test_a_value_is_found_within_its_share(
    key: str,
    robot: IdentifiedRobot,
    recorded: drives.Recorded,
) -> None:
    estimate = robot.found.estimates[key]
    assert estimate.value == pytest.approx(recorded.truth[key], rel=SHARE[key])
    assert estimate.low < estimate.value < estimate.high


@pytest.mark.parametrize("key", OFF)
def test_a_value_is_found_within_its_distance(
    key: str,
    robot: IdentifiedRobot,
    recorded: drives.Recorded,
) -> None:
    estimate = robot.found.estimates[key]
    assert estimate.value == pytest.approx(recorded.truth[key], abs=OFF[key])


def test_intervals_hold_the_truth(robot: IdentifiedRobot, recorded: drives.Recorded) -> None:
    held = []
    for key, true in recorded.truth.items():
        estimate = robot.found.estimates[key]
        if estimate.is_known:
            held.append(estimate.low <= true <= estimate.high)
    assert len(held) >= 18
    assert sum(held) >= 0.8 * len(held)


def test_computing_takes_as_long_as_the_stamps_of_commands_say(robot: IdentifiedRobot) -> None:
    latency = robot.found.value("computing_latency_s")
    assert latency == pytest.approx(drives.COMPUTED, abs=1e-3)


def test_what_needs_hours_is_not_identifiable(robot: IdentifiedRobot) -> None:
    walk = robot.found.estimates["imu_yaw_rate_bias_walk_radps_per_sqrt_s"]
    assert walk.value is None
    assert "an hour" in walk.advice


def test_the_unused_half_is_predicted(robot: IdentifiedRobot) -> None:
    step, long = robot.found.predictions
    assert step.horizon_s < 0.1
    assert long.horizon_s == 10.0
    for error in (step, long):
        assert error.n >= 5
        assert error.identified_m < 0.5 * error.default_m
    # in a step of 33 ms the noise of the wheels hides what constant twist misses
    assert long.identified_m < 0.5 * long.constant_twist_m


def test_the_files_are_those_of_a_robot(robot: IdentifiedRobot, recorded: drives.Recorded) -> None:
    made = load_dataclass(RobotParams, robot.written.robot)
    assert made.compute_latency == pytest.approx(recorded.truth["dead_time_s"], abs=0.01)
    true = recorded.robot.max_acceleration
    assert made.max_acceleration == pytest.approx(true, rel=0.08)  # gain and scale are two values
    sensors = load_dataclass(SensorParams, robot.written.sensors)
    assert sensors.lidar.beams == recorded.sensors.lidar.beams
    assert sensors.lidar.mount.x == pytest.approx(recorded.sensors.lidar.mount.x, abs=0.03)
    assert sensors.gps.latency == pytest.approx(recorded.sensors.gps.latency, abs=0.02)
    assert not sensors.imu.has_heading


@pytest.mark.slow
def test_the_command_prints_one_document(
    recorded: drives.Recorded,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    out = tmp_path / "my_robot.yaml"
    end = drives.START + 40.0
    short = [entry for entry in recorded.entries if entry.stamp < end and "scan" not in entry.topic]
    bag = drives.write_mcap(tmp_path / "drive.mcap", short)
    with pytest.raises(SystemExit) as leaving:
        main(["identify", str(bag), "--out", str(out), "--json"])
    assert leaving.value.code == 0
    document = json.loads(capsys.readouterr().out)
    assert document["values"]["dead_time_s"]["value"] is not None
    assert Path(document["robot"]) == out
    assert Path(document["sensors"]).is_file()
