"""A mission that a Nav2 file drives in the yard, and the log that its robot records."""

from pathlib import Path

import numpy as np
from PIL import Image

from harness.episode.episode import RunningDelivery
from harness.metrics.replay_log import TRACE_COLUMNS
from harness.task.study import make_study
from navstack.costmap.occupancy_grid import OCCUPIED
from navstack.types import FloatArray

from . import drives

START, GOAL = (-6.0, -4.0, 0.6), (6.0, 4.0, 0.6)
TICKS_PER_POSE = 3


def write_yard(folder: Path) -> Path:
    """The yard as a map_server YAML file."""
    grid = drives.yard().geometry
    picture = np.where(grid.data >= OCCUPIED, 0, 254).astype(np.uint8)[::-1]
    Image.fromarray(picture).save(folder / "yard.png")
    path = folder / "yard.yaml"
    origin = f"[{grid.origin.x}, {grid.origin.y}, 0.0]"
    path.write_text(
        f"image: yard.png\nresolution: {grid.resolution}\norigin: {origin}\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    return path


def record_mission(
    path: Path,
    nav2: Path,
    robot: Path | str,
    sensors: Path | str,
    yard: Path,
) -> FloatArray:
    """Drive the mission and write its log; returns its trace, rows of :data:`TRACE_COLUMNS`."""
    study = make_study(
        stacks=[str(nav2)],
        episodes=1,
        seed=5,
        map_name=str(yard),
        pedestrians=0,
        robot=str(robot),
        sensors=str(sensors),
        start=START,
        goal=GOAL,
        workers=1,
        record="full",
    )
    running = RunningDelivery(study.task(0, 0))
    entries: drives.Entries = []
    number = 0
    while running.verdict is None:
        stamp, seen = drives.START + running.truth.stamp, running.observation
        entries += drives.entries_of(seen, stamp)
        running.drive_tick()
        entries.append(drives.command_entry(stamp, running._command))
        if number % TICKS_PER_POSE == 0 and running.brain.belief is not None:
            entries.append(drives.belief(stamp, running.brain.belief.pose))
        number += 1
    delivery = running.finish()
    assert delivery.row["outcome"] in ("sla", "arrived"), delivery.row["outcome"]
    drives.write_mcap(path, entries)
    assert delivery.recording is not None
    return np.asarray(delivery.recording["trace"]).reshape(-1, len(TRACE_COLUMNS))
