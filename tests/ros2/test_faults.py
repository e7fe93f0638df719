"""Whatever a peer does, each delivery ends in a row with its reason, and in time."""

import subprocess
import sys
import time
from pathlib import Path

import navbench
from navbench.api.ros2 import serve

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
EPISODES, SHORT = 4, 2.0  # a longer run: 200 deliveries by the same peer
START_LIMIT, WAIT = 5.0, 0.2  # [s]
# [s] of wall time for a delivery: its start, a wait per period, and a slow machine
LONGEST = 2.0 * START_LIMIT + 20.0 * SHORT * WAIT + 20.0


def test_each_delivery_of_a_failing_peer_ends_in_a_row(tmp_path: Path) -> None:
    shipped = Path(navbench.__file__).parents[1] / "params"
    rules, stack = tmp_path / "short.yaml", tmp_path / "over.yaml"
    text = (shipped / "rules" / "costnav.yaml").read_text()
    rules.write_text(text.replace("timeout: 241.0", f"timeout: {SHORT}"))
    stack.write_text(STACK)
    program = Path(__file__).with_name("faulty_peer.py")
    began = time.monotonic()
    with subprocess.Popen([sys.executable, str(program), "1"], stdout=subprocess.DEVNULL) as peer:
        serve(
            "faults",
            stack=str(stack),
            settings={"rate": 20.0, "wait": WAIT, "settle": 0.0, "start_limit": START_LIMIT},
            out=tmp_path / "run",
            rules=str(rules),
            seed=3,
            pedestrians=2,
            world="easy",
            episodes=EPISODES,
        )
        peer.kill()
    rows = navbench.load(str(tmp_path / "run")).table().to_pylist()
    assert time.monotonic() - began < EPISODES * LONGEST
    assert len(rows) == EPISODES
    for row in rows:
        if row["outcome"] == "physical_assistance" and row["reason"] == "stack failed":
            assert "PeerError" in row["stack_error"]
        else:
            assert row["outcome"] == "timeout"
        # no command is faster than 0.5 m/s but those that are refused
        assert row["distance_m"] < 0.6 * SHORT
