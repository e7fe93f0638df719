"""Deliveries driven over ROS 2 by other processes: the same rows, and an end whatever they do."""

import contextlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest

import navbench
from harness.metrics.columns import Row
from navbench.api.ros2 import serve
from navstack.errors import InputError

MAKE_LAW = """
import math, sys, time
import rclpy
from geometry_msgs.msg import PoseStamped, Twist, TwistStamped
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock

kind, reliability, fault = sys.argv[1:4]
rclpy.init()
node = rclpy.create_node("law")
quality = QoSProfile(depth=5, reliability=getattr(ReliabilityPolicy, reliability))
commands = node.create_publisher(TwistStamped if kind == "stamped" else Twist, "cmd_vel", quality)
state = {"begin": None, "count": 0}

def goal(message):
    state["begin"] = None
    state["goal"] = True

def clock(message):
    if "goal" not in state:
        return
    now = message.clock.sec + 1e-9 * message.clock.nanosec
    if state["begin"] is None:
        state["begin"] = now
    state["count"] += 1
    if fault == "kill" and state["count"] > 40:
        sys.exit(3)
    if fault == "stall" and state["count"] > 40:
        time.sleep(1000.0)
    since = round(now - state["begin"], 6)
    twist = Twist()
    twist.linear.x = 0.6
    twist.angular.z = 0.3 * math.sin(since)
    if fault == "nonsense":
        twist.linear.x = (math.nan, math.inf, 1e308)[state["count"] % 3]
    for _ in range(200 if fault == "flood" else 1):
        commands.publish(TwistStamped(twist=twist) if kind == "stamped" else twist)

node.create_subscription(PoseStamped, "goal_pose", goal, quality)
node.create_subscription(Clock, "/clock", clock, quality)
rclpy.spin(node)
"""
LAW = '''
import math

import numpy as np


class Law:
    """What the node does, in the harness's own process."""

    def reset(self, seed):
        pass

    def act(self, seen):
        return np.array((0.6, 0.3 * math.sin(round(seen.stamp, 6))))
'''
STACK = """
title: "A law"
navigator: {navigator}
nav2_file: gps_ekf
localizer: {localizer}
planning_map: navigation_mesh
sensors: rtk_good
carries: [lidar, gps]
robot: segway_e1
"""
SAME = {"seed": 3, "pedestrians": 2, "world": "easy", "episodes": 2}


@contextlib.contextmanager
def peer(tmp_path: Path, *arguments: str) -> Iterator["subprocess.Popen[bytes]"]:
    program = tmp_path / "law_node.py"
    program.write_text(MAKE_LAW)
    with subprocess.Popen(
        [sys.executable, str(program), *arguments], stderr=subprocess.DEVNULL
    ) as process:
        try:
            yield process
        finally:
            process.kill()


def stack_file(folder: Path, name: str, navigator: str, localizer: str, more: str = "") -> str:
    file = folder / f"{name}.yaml"
    file.write_text(STACK.format(navigator=navigator, localizer=localizer) + more)
    return str(file)


@pytest.fixture
def rules(tmp_path: Path) -> str:
    file = tmp_path / "short.yaml"
    shipped = Path(navbench.__file__).parents[1] / "params" / "rules" / "costnav.yaml"
    lines = [
        line if not line.startswith("timeout") else "timeout: 6.0"
        for line in shipped.read_text().splitlines()
    ]
    file.write_text("\n".join(lines))
    return str(file)


def rows_of(folder: Path) -> list[Row]:
    rows: list[Row] = navbench.load(str(folder)).table().to_pylist()
    return rows


def driven(rows: Sequence[Row]) -> list[dict[str, Any]]:
    """What the world says: not who drove, nor what its brain counts or believes."""
    own = ("stack", "stack_number", "plans", "navigator_history")
    return [
        {
            key: value
            for key, value in row.items()
            if key not in own and not key.startswith(("localization_error", "heading_error"))
        }
        for row in rows
    ]


@pytest.mark.parametrize(
    ("kind", "reliability"), [("plain", "RELIABLE"), ("stamped", "BEST_EFFORT")]
)
def test_a_law_over_ros_2_drives_as_in_the_own_process(
    tmp_path: Path, hall: Path, rules: str, kind: str, reliability: str
) -> None:
    (tmp_path / "law.py").write_text(LAW)
    own = stack_file(tmp_path, "own", "law.py:Law", "gps-ekf", "policy: {rate: 60}\n")
    over = stack_file(tmp_path, "over", "ros2", "peer")
    navbench.run(own, rules=rules, map=str(hall), workers=1, out=tmp_path / "first", **SAME)
    with peer(tmp_path, kind, reliability, "none"):
        serve(
            "law",
            stack=over,
            settings={"rate": 0.0, "wait": 20.0, "settle": 0.3},
            out=tmp_path / "second",
            rules=rules,
            map=str(hall),
            **SAME,
        )
    first, second = (driven(rows_of(tmp_path / name)) for name in ("first", "second"))
    assert second == first
    assert first[0]["distance_m"] > 2.0


@pytest.mark.parametrize("fault", ["kill", "stall", "nonsense", "flood"])
def test_every_delivery_ends_in_a_row(tmp_path: Path, hall: Path, rules: str, fault: str) -> None:
    over = stack_file(tmp_path, "over", "ros2", "peer")
    began = time.monotonic()
    with peer(tmp_path, "plain", "RELIABLE", fault):
        serve(
            "law",
            stack=over,
            settings={"rate": 20.0, "wait": 0.2, "settle": 0.0, "start_limit": 5.0},
            out=tmp_path / "run",
            rules=rules,
            map=str(hall),
            **{**SAME, "episodes": 1},
        )
    (row,) = rows_of(tmp_path / "run")
    assert time.monotonic() - began < 40.0
    if fault == "flood":
        assert row["stack_error"] is None and row["outcome"] == "timeout"
        assert row["distance_m"] > 2.0
    else:
        assert row["outcome"] == "physical_assistance"
        assert "PeerError" in row["stack_error"]
        # some 40 ticks at 0.6 m/s; within 0.2 s of the clock the robot stands
        assert row["distance_m"] < 0.6 * 3.0


def test_nobody_who_drives_is_told_of(tmp_path: Path, hall: Path, rules: str) -> None:
    over = stack_file(tmp_path, "over", "ros2", "peer")
    settings = {"start_limit": 1.0}
    serve(
        "nobody", stack=over, settings=settings, out=tmp_path / "run", rules=rules,
            map=str(hall),
        **{**SAME, "episodes": 1},
    )  # fmt: skip
    (row,) = rows_of(tmp_path / "run")
    assert "nobody listens to /goal_pose within 1 s" in row["stack_error"]


def test_what_cannot_be_served_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="navigator 'nav2'; serve needs ros2"):
        serve(stack="nav2-gps")
    with pytest.raises(InputError, match="--workers 2 is given, give --workers 1"):
        serve(workers=2, episodes=1, out=tmp_path / "two")
    with pytest.raises(InputError, match="ros2 has no speed"):
        serve(settings={"speed": 2.0})


def test_our_brain_in_another_process_drives_the_same(
    tmp_path: Path, hall: Path, rules: str
) -> None:
    """Beams are float32 in a message: what differs is below a millimetre."""
    own = stack_file(tmp_path, "own", "nav2", "gps-ekf")
    over = stack_file(tmp_path, "over", "ros2", "peer")
    same = {**SAME, "episodes": 1}
    navbench.run(own, rules=rules, map=str(hall), workers=1, out=tmp_path / "first", **same)
    command = [sys.executable, "-m", "navbench", "drive", "--params", "gps_ekf"]
    told = tmp_path / "told.txt"
    with (
        told.open("w") as text,
        subprocess.Popen(
            [*command, "--laser", "-0.23", "0", "0"], stderr=text, env=os.environ
        ) as process,
    ):
        serve(
            "ours",
            stack=over,
            settings={"rate": 0.0, "wait": 60.0, "settle": 0.3},
            out=tmp_path / "second",
            rules=rules,
            map=str(hall),
            **same,
        )
        process.send_signal(signal.SIGINT)
        try:
            assert process.wait(20.0) == 130
        finally:
            process.kill()
    (first,), (second,) = (driven(rows_of(tmp_path / name)) for name in ("first", "second"))
    assert second["outcome"] == first["outcome"]
    assert second["duration_s"] == first["duration_s"]
    assert second["distance_m"] == pytest.approx(first["distance_m"], abs=1e-3)
    assert second["goal_distance_m"] == pytest.approx(first["goal_distance_m"], abs=1e-3)
    assert "stopped: leaving" in told.read_text()
