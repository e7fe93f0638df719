"""Whether our brain behind ROS 2 drives the rows that it drives in one process.

``navbench run``, then ``navbench serve`` in lockstep with ``navbench drive`` in a process of its
own, on the same deliveries, with sensors as messages carry them. Printed is how many rows are
equal, and in what the others differ.

Usage: python -m tools.nav2.check_ros2 [--episodes N] [--seed N] [--out FOLDER]
"""

import json
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq

from harness.storage.files import write_text
from harness.storage.shipped import shipped
from tools.options import parsed

NAVBENCH = (sys.executable, "-m", "navbench")
LASER = ("-0.23", "0", "0")  # [m], [m], [rad] of the robot segway_e1's lidar
# who drove, and what only a brain in the own process tells
UNCOMPARED = tuple(
    """stack navigator_ gave_up plans failed_ recover clearings spins waits backups ghost_tracks
    localization_error_ heading_error_""".split()
)


def stacks_in(folder: Path) -> dict[str, Path]:
    """Files of the stack in one process and of the one behind ROS 2, by name."""
    preset = shipped("params") / "sensors" / "rtk_good.yaml"
    sensors = folder / "sensors.yaml"
    write_text(sensors, preset.read_text(encoding="utf-8") + "as_messages: true\n")
    shared = {
        "nav2_file": "gps_ekf",
        "planning_map": "navigation_mesh",
        "sensors": str(sensors),
        "carries": ["lidar", "gps"],
        "robot": "segway_e1",
    }
    drivers = {"own": ("nav2", "gps-ekf"), "over": ("ros2", "peer")}
    files = {}
    for name, (navigator, localizer) in drivers.items():
        about = {"title": name, "navigator": navigator, "localizer": localizer, **shared}
        files[name] = folder / f"{name}.yaml"
        write_text(files[name], json.dumps(about))
    return files


def differences(one: dict[str, Any], other: dict[str, Any]) -> list[str]:
    """The columns in which two rows differ."""
    compared = [key for key in one if not key.startswith(UNCOMPARED)]
    return [key for key in compared if repr(one[key]) != repr(other[key])]


def main() -> None:
    asked = parsed(__doc__, episodes=50, seed=0, out="results/check_ros2")
    folder = Path(asked.out)
    folder.mkdir(parents=True)
    files = stacks_in(folder.resolve())
    own, over = folder / "own", folder / "over"
    shared = ("--episodes", str(asked.episodes), "--seed", str(asked.seed))
    run = (*NAVBENCH, "run", "--stack", str(files["own"]), *shared, "--workers", "1")
    subprocess.run([*run, "--out", str(own)], check=True)
    drive = (*NAVBENCH, "drive", "--params", "gps_ekf", "--laser", *LASER)
    serve = (*NAVBENCH, "serve", "--stack", str(files["over"]), *shared, "--wait", "60")
    with subprocess.Popen(drive, stdout=subprocess.DEVNULL) as peer:
        try:
            command = [*serve, "--controller-frequency", "0", "--settle", "0.5", "--out", str(over)]
            subprocess.run(command, check=True)
        finally:
            peer.send_signal(signal.SIGINT)
    tables = [pq.read_table(each / "episodes.parquet").to_pylist() for each in (own, over)]
    pairs = list(zip(*tables, strict=True))
    unlike = {one["episode"]: differences(one, other) for one, other in pairs}
    unlike = {episode: columns for episode, columns in unlike.items() if columns}
    print(f"{len(pairs) - len(unlike)} of {len(pairs)} rows are equal")
    for episode, columns in unlike.items():
        print(f"episode {episode}: {', '.join(columns)}")
    sys.exit(bool(unlike))


if __name__ == "__main__":
    main()
