"""Whatever a peer does, each delivery ends in a row with its reason, and in time."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import navbench
from harness.ros2 import brain
from navbench.api.ros2 import serve
from navstack.types import Observation, Twist2D

STACK = """
title: "A peer that fails"
navigator: ros2
nav2_file: gps_ekf
localizer: peer
planning_map: navigation_mesh
sensors: rtk_good
carries: [lidar, gps]
robot: segway_e1
ros2: {most_missed: 0.3}
"""
FAULTS = ("flood", "nonsense", "kill", "abort", "stall")  # a longer run: 200 drawn by chance
SHORT = 4.0  # [s] of a delivery; a fault begins in its first second
START_LIMIT, WAIT, TIMEOUT = 20.0, 0.2, 0.2  # [s]
# [s] of wall time for a delivery: its start, a wait per period, and a slow machine
LONGEST = START_LIMIT + 20.0 * SHORT * WAIT + 20.0


@pytest.fixture
def unheard(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """For how long [s] of the clock a velocity stood to which there was no new command."""
    found: list[float] = []
    tick, heard = brain.Ros2Brain.tick, {"count": 0, "stamp": 0.0}

    def watched(driving: brain.Ros2Brain, observation: Observation) -> Twist2D:
        command = tick(driving, observation)
        if driving._robot.heard != heard["count"]:
            heard.update(count=driving._robot.heard, stamp=observation.stamp)
        if command != Twist2D():
            found.append(observation.stamp - heard["stamp"])
        return command

    monkeypatch.setattr(brain.Ros2Brain, "tick", watched)
    return found


@pytest.mark.slow
def test_each_delivery_of_a_failing_peer_ends_in_a_row(
    tmp_path: Path, hall: Path, in_process: None, unheard: list[float]
) -> None:
    shipped = Path(navbench.__file__).parents[1] / "params"
    rules, stack = tmp_path / "short.yaml", tmp_path / "over.yaml"
    text = (shipped / "rules" / "costnav.yaml").read_text()
    rules.write_text(text.replace("timeout: 241.0", f"timeout: {SHORT}"))
    stack.write_text(STACK)
    program = Path(__file__).with_name("faulty_peer.py")
    began = time.monotonic()
    command = [sys.executable, str(program), "11", *FAULTS]  # TwistStamped, also of the next one
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, text=True, start_new_session=True
    ) as peer:
        serve(
            "faults",
            stack=str(stack),
            settings={
                "controller_frequency": 20.0,
                "wait": WAIT,
                "settle": 0.0,
                "start_limit": START_LIMIT,
            },
            out=tmp_path / "run",
            rules=str(rules),
            map=str(hall),
            seed=3,
            pedestrians=2,
            world="easy",
            episodes=len(FAULTS),
        )
        os.killpg(peer.pid, signal.SIGKILL)  # with those that it started again
        told, _ = peer.communicate()
    assert time.monotonic() - began < len(FAULTS) * LONGEST
    assert told.split("under way\n") == [*(f"{each}\n" for each in FAULTS), ""]
    rows = dict(zip(FAULTS, navbench.load(str(tmp_path / "run")).table().to_pylist(), strict=True))
    assert rows["flood"]["outcome"] == "timeout" and rows["flood"]["stack_error"] is None
    assert "none that a robot can follow" in rows["nonsense"]["navigator_history"]
    for fault in ("nonsense", "kill", "stall"):
        assert "did not come in time" in rows[fault]["navigator_history"]
    assert rows["kill"]["reason"] == "stack failed" and "PeerError" in rows["kill"]["stack_error"]
    assert rows["abort"]["navigator_status"] == "failed"
    # no command is faster than 0.5 m/s but those that are refused
    assert 0.0 < max(row["distance_m"] for row in rows.values()) < 0.6 * SHORT
    assert unheard and max(unheard) < TIMEOUT
