"""A log or a URDF that cannot be used is refused in one line; a damaged clock is survived."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from harness.identify.identification import _predictions
from harness.identify.urdf import read_urdf
from harness.recorded.log import LogRequest, read_log
from harness.recorded.ros_messages import TWIST_STAMPED
from navbench.cli.app import main
from navstack.errors import InputError
from navstack.types import Pose2D, Twist2D

from ..writing import START, Entry, imu, odometry
from . import drives

URDF = """<?xml version="1.0"?>
<robot name="cart">
 <link name="base_link">
  <inertial><origin xyz="-0.05 0 0.1"/><mass value="30"/>
   <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
  <collision><origin xyz="-0.1 0 0.15"/><geometry><box size="0.6 0.4 0.2"/></geometry></collision>
 </link>
 <link name="left_wheel">
  <collision><geometry><cylinder radius="0.1" length="0.04"/></geometry></collision></link>
 <link name="right_wheel">
  <collision><geometry><cylinder radius="0.1" length="0.04"/></geometry></collision></link>
 <link name="laser"/>
 <joint name="l" type="continuous"><parent link="base_link"/><child link="left_wheel"/>
  <origin xyz="0 0.2 0" rpy="-1.5707963 0 0"/><axis xyz="0 0 1"/></joint>
 <joint name="r" type="continuous"><parent link="base_link"/><child link="right_wheel"/>
  <origin xyz="0 -0.2 0" rpy="-1.5707963 0 0"/><axis xyz="0 0 1"/></joint>
 <joint name="s" type="fixed"><parent link="base_link"/><child link="laser"/>
  <origin xyz="0.1 0 0.3" rpy="0 0 0.1"/></joint>
</robot>
"""


XACRO = 'xmlns:xacro="http://ros.org/wiki/xacro"'


def straight(seconds: float = 10.0, child: str = "base_link") -> list[Entry]:
    """A second's metre straight on."""
    stamps = np.arange(0.0, seconds, 0.05)
    return [odometry(START + t, Pose2D(t, 0.0, 0.0), 1.0, 0.0, child) for t in stamps.tolist()]


def refusal(entries: list[Entry], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> str:
    """What the command says of a log, in one line and with status 1."""
    bag = drives.write_mcap(tmp_path / "drive.mcap", entries)
    with pytest.raises(SystemExit) as leaving:
        main(["identify", str(bag), "--out", str(tmp_path / "robot.yaml")])
    assert leaving.value.code == 1
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert not (tmp_path / "robot.yaml").exists()
    return said


def test_a_log_without_odometry(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    said = refusal([imu(START + 0.1 * n, 0.0, 0.0) for n in range(50)], tmp_path, capsys)
    assert "no message of nav_msgs/msg/Odometry" in said
    assert "/imu/data (sensor_msgs/msg/Imu)" in said


def test_odometry_of_another_type(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    units = [imu(START + 0.1 * n, 0.0, 0.0) for n in range(50)]
    entries = [dataclasses.replace(entry, topic="/odom") for entry in units]
    assert "It has: /odom (sensor_msgs/msg/Imu)" in refusal(entries, tmp_path, capsys)


def test_too_few_messages(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "1 usable messages of odometry" in refusal(straight()[:1], tmp_path, capsys)


def test_two_publishers_on_one_topic(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    entries = [*straight(), *straight(child="other_base")]
    said = refusal(sorted(entries, key=lambda entry: entry.stamp), tmp_path, capsys)
    assert "two publishers" in said


def test_two_publishers_in_one_frame(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    far = [odometry(entry.stamp + 0.01, Pose2D(500.0, 0.0, 0.0), 0.0, 0.0) for entry in straight()]
    entries = sorted((*straight(), *far), key=lambda entry: entry.stamp)
    assert "two nodes publish on one topic" in refusal(entries, tmp_path, capsys)


def test_sensors_of_two_clocks(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    units = [
        dataclasses.replace(imu(START + 0.1 * n - 3600.0, 0.0, 0.0), arrival=START + 0.1 * n)
        for n in range(100)
    ]
    entries = sorted((*straight(), *units), key=lambda entry: entry.arrival or entry.stamp)
    assert "clocks 3600.0 s apart" in refusal(entries, tmp_path, capsys)


def test_a_truncated_file_is_used_as_far_as_it_goes(tmp_path: Path) -> None:
    bag = drives.write_mcap(tmp_path / "drive.mcap", straight(600.0))
    bag.write_bytes(bag.read_bytes()[: bag.stat().st_size // 2])
    told: list[str] = []
    try:
        log = read_log(LogRequest((bag,)), told.append)
    except InputError as error:
        told.append(str(error))
    else:
        assert 0 < len(log.odometry) < 12_000
    assert "cut off" in " ".join(told)


def test_repeated_stamps_and_gaps_leave_rows_in_order(tmp_path: Path) -> None:
    entries = [entry for entry in straight() if not 3.0 < entry.stamp - START < 4.0]
    bag = drives.write_mcap(tmp_path / "drive.mcap", sorted(entries * 2, key=lambda e: e.stamp))
    shares: list[float] = []
    log = read_log(LogRequest((bag,)), lambda _: None, shares.append)
    assert shares == sorted(shares) and 0.9 < shares[-1] <= 1.0, "progress hears of each message"
    assert len(log.odometry) == len(entries)
    assert (np.diff(log.odometry[:, 0]) > 0.0).all()


@pytest.mark.parametrize(
    ("is_commanded", "why"),
    [(False, "there are no commands"), (True, "the first half has too few steps of the commands")],
)
def test_why_commands_do_not_predict(is_commanded: bool, why: str, tmp_path: Path) -> None:
    entries = straight(30.0)
    if is_commanded:
        entries += [drives.command_entry(entry.stamp, Twist2D(1.0)) for entry in entries]
    entries.sort(key=lambda entry: entry.arrival or entry.stamp)
    log = read_log(LogRequest((drives.write_mcap(tmp_path / "drive.mcap", entries),)), print)
    default = drives.draw(0)[0]
    assert _predictions(log, default)[1] == f"from wheels and gyro, for {why}"


@pytest.mark.parametrize(
    "text",
    [
        URDF.replace('"1.0"?>', '"1.0"?><!DOCTYPE r [<!ENTITY a SYSTEM "file:///etc/passwd">]>'),
        URDF.replace('name="cart">', f'name="cart" {XACRO}><xacro:wheel side="left"/>'),
        URDF.replace("base_link", "${namespace}base_link"),
        "<robot",
        "<robot/>",
        "nothing",
    ],
    ids=["entity", "xacro", "expression", "cut", "empty", "text"],
)
def test_a_urdf_that_is_refused(text: str, tmp_path: Path) -> None:
    path = tmp_path / "robot.urdf"
    path.write_text(text)
    with pytest.raises(InputError) as refused:
        read_urdf(path)
    assert str(path) in str(refused.value)
    assert "\n" not in str(refused.value)


COMMENTED = f'name="cart" {XACRO}> <!-- <xacro:include filename="$(find cart)/${{x}}"/> -->'


@pytest.mark.parametrize("root", ['name="cart">', COMMENTED])
def test_a_urdf_is_read(tmp_path: Path, root: str) -> None:
    """Also one as TurtleBot3's, which only names xacro."""
    path = tmp_path / "robot.urdf"
    path.write_text(URDF.replace('name="cart">', root))
    body = read_urdf(path)
    assert body.box is not None
    assert body.box == pytest.approx(np.array(((-0.4, -0.22), (0.2, 0.22))), abs=1e-6)
    assert body.mass == pytest.approx(30.0)
    assert body.wheel_radius == pytest.approx(0.1)
    assert body.track == pytest.approx(0.4)
    assert body.frames == ("base_link laser 0.1 0 0.3 0 0 0.1",)


@pytest.mark.parametrize("out", ["my_nav2.yaml", "my.yaml", "log/metadata.yaml"])
def test_what_is_read_is_never_overwritten(
    out: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Also not by the sensors file, or within a bag's folder."""
    names = {"my_nav2.yaml": "my_nav2.yaml", "my.yaml": "my_sensors.yaml"}
    nav2, folder = tmp_path / names.get(out, "nav2.yaml"), tmp_path / "log"
    folder.mkdir()
    for file in (nav2, folder / "metadata.yaml"):
        file.write_text("# mine")
    with pytest.raises(SystemExit) as leaving:
        main(["identify", str(folder), "--nav2", str(nav2), "--out", str(tmp_path / out)])
    assert leaving.value.code == 1
    assert "is a file that is read; give another name" in capsys.readouterr().err
    assert nav2.read_text() == (folder / "metadata.yaml").read_text() == "# mine"


@pytest.mark.parametrize(
    ("topic", "remap", "count"),
    [("/cmd_vel", (), 200), ("/gps/vel", (), 0), ("/gps/vel", ("/cmd_vel:=/gps/vel",), 200)],
)
def test_a_receivers_velocity_is_no_command(
    topic: str, remap: tuple[str, ...], count: int, tmp_path: Path
) -> None:
    moving = {"twist": {"linear": {"x": 1.0}}}
    twists = [Entry(topic, TWIST_STAMPED, START + 0.05 * n, moving) for n in range(200)]
    entries = sorted([*straight(), *twists], key=lambda entry: entry.stamp)
    bag = drives.write_mcap(tmp_path / "drive.mcap", entries)
    notes: list[str] = []
    log = read_log(LogRequest((bag,), remap=remap), notes.append)
    assert len(log.commands) == count
    assert any("is not taken for commands" in note for note in notes) == (count == 0)
