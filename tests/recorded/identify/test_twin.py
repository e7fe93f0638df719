"""The mission of a log is driven again in the world."""

import dataclasses
import json
from pathlib import Path

import pytest

from harness.identify.twin import mission_of
from harness.recorded.drive_log import DriveLog
from harness.recorded.log import LogRequest, read_log
from harness.storage.shipped import shipped
from harness.world.physics.robot import RobotParams
from navbench.cli.app import main
from navstack.errors import InputError
from navstack.params.strict import dump_dataclass, load_dataclass

from . import missions

pytestmark = pytest.mark.slow

PARAMS = shipped("params")
NAV2 = PARAMS / "nav2" / "tuned.yaml"
SENSORS = PARAMS / "sensors" / "rtk_good.yaml"
DEFAULT = "segway_e1"
# slower than the default: it needs a second longer for 10 m
SLOW = {"max_acceleration": 0.7, "servo_time_constant": 0.15, "compute_latency": 0.08}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path: Path = tmp_path_factory.mktemp("mission")
    default = load_dataclass(RobotParams, PARAMS / "robots" / f"{DEFAULT}.yaml")
    (path / "slow.yaml").write_text(dump_dataclass(dataclasses.replace(default, **SLOW)))
    (path / "slow_sensors.yaml").write_text(SENSORS.read_text())
    yard = missions.write_yard(path)
    missions.record_mission(path / "drive.mcap", NAV2, path / "slow.yaml", SENSORS, yard)
    return path


@pytest.fixture(scope="module")
def log(folder: Path) -> DriveLog:
    return read_log(LogRequest((folder / "drive.mcap",)), lambda _: None)


def words(folder: Path, robot: Path | str) -> list[str]:
    """Of the command."""
    files = ["--robot", str(robot), "--map", str(folder / "yard.yaml"), "--nav2", str(NAV2)]
    return ["cost-log", str(folder / "drive.mcap"), *files]


def test_the_robots_own_file_drives_as_it_did(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as leaving:
        main([*words(folder, folder / "slow.yaml"), "--json"])
    assert leaving.value.code == 0
    twin = json.loads(capsys.readouterr().out)["simulator"]
    assert twin["arrived"] == twin["n"] == 5
    for key in ("time_s", "distance_m", "mean_speed_mps"):
        assert twin[key]["simulated"]["value"] == pytest.approx(twin[key]["bag"], rel=0.04)
    assert twin["speed_profile"]["rms_difference_mps"] < 0.05
    assert twin["localization_error_m"]["simulated"]["value"] > 0.0
    # fixes say nothing of a localizer that uses them
    assert twin["localization_error_m"]["bag"] is None


def test_another_robot_does_not(
    folder: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr("navbench.api.cost_log.DRIVES", 2)
    monkeypatch.setattr("navbench.api.progress.LINE_PERIOD", 0.01)
    other = tmp_path / "other.mcap"
    other.write_bytes((folder / "drive.mcap").read_bytes())
    with pytest.raises(SystemExit) as leaving:
        main([*words(folder, DEFAULT), "--against", str(other)])
    assert leaving.value.code == 0
    screen, progress = capsys.readouterr()
    assert f"2 times in the world by '{NAV2}'" in progress and "1 of 2 drives" in progress
    assert len(screen.splitlines()) <= 25 and "contacts per km" in screen
    assert "2 of 2 drives arrived" in screen
    difference = float(screen.split("parts [m/s]")[1].split()[0])
    assert difference > 0.1


def test_a_log_without_poses_has_no_mission(log: DriveLog) -> None:
    with pytest.raises(InputError, match="record /amcl_pose"):
        mission_of(dataclasses.replace(log, poses=log.poses[:0]))


def test_a_log_that_ends_where_it_began_has_no_mission(log: DriveLog) -> None:
    with pytest.raises(InputError, match="no mission"):
        mission_of(dataclasses.replace(log, poses=log.poses[:10]))
