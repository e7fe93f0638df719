"""Nodes with timers of their own on /clock drive: planner, controller, tree and smoother."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

import navbench
from navbench.api.ros2 import serve

STACK = """
title: "A stand-in for Nav2"
navigator: ros2
nav2_file: gps_ekf
localizer: peer
planning_map: navigation_mesh
sensors: rtk_good
carries: [lidar, gps]
robot: segway_e1
"""
SHORT = 4.0  # [s] of a delivery
# a node's timer may rarely skip a period of the clock
ALMOST_NONE = r"(1 of \d+ commands did not come in time, 0 were none that a robot can follow)?"


@pytest.mark.slow
def test_timers_on_the_clock_drive_in_lockstep(tmp_path: Path) -> None:
    """In the second delivery the goal of the first is canceled, and the peer plans anew."""
    shipped = Path(navbench.__file__).parents[1] / "params"
    rules, stack = tmp_path / "short.yaml", tmp_path / "over.yaml"
    text = (shipped / "rules" / "costnav.yaml").read_text()
    rules.write_text(text.replace("timeout: 241.0", f"timeout: {SHORT}"))
    stack.write_text(STACK)
    program = Path(__file__).with_name("stand_in.py")
    command = [sys.executable, str(program), str(shipped / "nav2" / "gps_ekf.yaml"), "0.01"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        settings = {
            "controller_frequency": 20.0,
            "wait": 20.0,
            "settle": 0.5,
            "publishes_map_frame": True,
        }
        serve(
            "stand-in",
            stack=str(stack),
            settings=settings,
            out=tmp_path / "run",
            rules=str(rules),
            seed=3,
            pedestrians=2,
            world="easy",
            episodes=2,
        )
        process.terminate()
        told, _ = process.communicate(timeout=120.0)
    rows = navbench.load(str(tmp_path / "run")).table().to_pylist()
    assert "canceled" in told
    for row in rows:
        assert row["stack_error"] is None
        assert re.fullmatch(ALMOST_NONE, row["navigator_history"])
        assert (row["outcome"], row["duration_s"]) == ("timeout", SHORT)
    assert sum(row["distance_m"] for row in rows) > 1.0
