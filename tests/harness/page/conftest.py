"""Recordings without a simulation."""

import json

import numpy as np
import pytest

from harness.metrics.columns import EPISODE_COLUMNS, EVENT_COLUMNS
from harness.metrics.decisions import CRITIC_COLUMNS, DECISION_COLUMNS
from harness.storage.checksums import write_checksums
from harness.storage.shipped import shipped
from harness.storage.tables import read_rows, write_table
from harness.study.manifest import map_digest
from harness.world.map.scene_io import load_scene

CRITIC = {f"PathDist_{end}": kind for end, kind in CRITIC_COLUMNS.items()}
HITS = (4.0, 9.0)  # [s] of two contacts that cost something


def arrays_of(row, seed=0, beams=36, people=5):
    """A recording of a drive along a bent line from start to goal, with all that a replay shows."""
    rng = np.random.default_rng(seed)
    stamps = np.arange(0.1, row["duration_s"], 0.1)
    share = stamps / row["duration_s"]
    x = row["start_x_m"] + share * (row["goal_x_m"] - row["start_x_m"])
    y = (
        row["start_y_m"]
        + share * (row["goal_y_m"] - row["start_y_m"])
        + 3.0 * np.sin(np.pi * share)
    )
    yaw = np.arctan2(np.gradient(y), np.gradient(x))
    speed, rows = np.hypot(np.gradient(x), np.gradient(y)) * 10.0, len(stamps)
    believed = np.column_stack((x, y, yaw)) + rng.normal(0.0, 0.05, (rows, 3))
    motion = np.column_stack((speed, np.zeros(rows)))
    crowd = np.column_stack((x, y))[:, None, :] + rng.uniform(-8.0, 8.0, people * 2).reshape(
        1, people, 2
    )
    plans = [np.column_stack((x, y))[k::10].astype(np.float32) for k in range(0, rows, 50)]
    tracks = np.column_stack(
        (np.full(rows, 7.0), crowd[:, 0], np.zeros((rows, 2)), np.full(rows, 0.3))
    )
    ranges = rng.integers(2000, 12000, (rows, beams)).astype(np.uint16)
    ranges[:, 0] = 65535
    return {
        "trace": np.column_stack((stamps, x, y, yaw, motion, believed, motion)),
        "crowd": crowd,
        "pieces_lost": np.minimum(np.arange(rows) // 100, 3).astype(np.int32),
        "motion_energy_j": 30.0 * stamps,
        "odometry": np.column_stack((x - x[0], y - y[0], yaw, motion)),
        "belief_covariance": np.full((rows, 3), (0.04, 0.01, 0.02), dtype=np.float32),
        "track_count": np.ones(rows, dtype=np.int32),
        "tracks": tracks.astype(np.float32),
        "option_count": np.full(rows, 2, dtype=np.int32),
        "option_total": np.tile((1.25, 2.5), rows),
        "option_size": np.full(2 * rows, 3, dtype=np.int32),
        "option_xy": (
            np.column_stack((x, y)).repeat(6, axis=0) + np.tile(np.arange(6.0), rows)[:, None]
        ).astype("f4"),
        "scan_stamp": stamps,
        "scan_mm": ranges,
        "scan_geometry": np.array((-np.pi, 2.0 * np.pi / beams, 0.15, 12.0, -0.2, 0.0, 0.0)),
        "plan_stamp": stamps[::50],
        "plan_size": np.array([len(plan) for plan in plans], dtype=np.int32),
        "plan_xy": np.concatenate(plans),
    }


def decision(stamp):
    """A cycle in which DWB kept to 1 m/s."""
    row = {
        **dict.fromkeys(DECISION_COLUMNS),
        "stamp_s": stamp,
        "decided_by": "DWBLocalPlanner",
        "samples": 100,
    }
    row |= {f"{kind}_linear_x_mps": 1.0 for kind in ("wanted", "command")}
    row |= {f"{kind}_angular_z_radps": 0.0 for kind in ("wanted", "command")}
    row |= dict.fromkeys(("believed_x_m", "believed_y_m", "believed_yaw_rad"), 0.0)
    return row | {"rejected": 7, "total_score": 1.2} | dict(zip(CRITIC, (2.0, 1.2, 7), strict=True))


@pytest.fixture(scope="session")
def make_arrays():
    """See :func:`arrays_of`."""
    return arrays_of


@pytest.fixture(scope="session")
def record():
    """Give deliveries of a run folder recordings, and its costed contacts places and times."""

    def add(folder, stack, episodes, **more):
        (folder / "recordings").mkdir(exist_ok=True)
        for row in read_rows(folder / "episodes.parquet", EPISODE_COLUMNS):
            if row["stack"] == stack and row["episode"] in episodes:
                arrays = arrays_of(row, row["episode"], **more)
                name = f"{stack}-{row['episode']}"
                np.savez_compressed(folder / "recordings" / f"{name}.npz", **arrays)
                rows = [decision(float(stamp)) for stamp in arrays["trace"][:, 0]]
                write_table(
                    folder / "recordings" / f"{name}-decisions.parquet",
                    DECISION_COLUMNS | CRITIC,
                    rows,
                )
        robot = (shipped("params") / "robots" / "segway_e1.yaml").read_text(encoding="utf-8")
        (folder / "params" / f"{stack}-robot.yaml").write_text(robot, encoding="utf-8")
        place_events(folder)
        write_checksums(folder)  # as if a run had written all of it

    return add


@pytest.fixture
def folder(write_run, record):
    """A run of one stack with one recorded delivery, in which people were hit."""

    def short(row):
        row |= {"duration_s": 20.0, "distance_m": 40.0, "average_speed_mps": 2.0, "outcome": "sla"}

    made = write_run(
        "one",
        episodes=4,
        crowd=3.0,
        change=short,
        map_sha256=map_digest(load_scene("sidewalk")),
    )
    record(made, "mine", range(1, 2))
    return made


def place_events(folder):
    """Contacts happen on the way, a few seconds apart."""
    ends = {
        (row["stack"], row["episode"]): row
        for row in read_rows(folder / "episodes.parquet", EPISODE_COLUMNS)
    }
    events = list(read_rows(folder / "events.parquet", EVENT_COLUMNS))
    for event in events:
        row = ends[event["stack"], event["episode"]]
        event |= {"x_m": row["start_x_m"] + 1.0, "y_m": row["start_y_m"] + 1.0}
        event["stamp_s"] = HITS[event["partner_id"] % 2]
    write_table(folder / "events.parquet", EVENT_COLUMNS, events)


@pytest.fixture
def rename_map():
    """Let a run folder say that its map has another name."""

    def rename(folder, name):
        about = json.loads((folder / "run.json").read_text(encoding="utf-8"))
        (folder / "run.json").write_text(json.dumps({**about, "map_name": name}), encoding="utf-8")
        rows = read_rows(folder / "episodes.parquet", EPISODE_COLUMNS)
        write_table(
            folder / "episodes.parquet", EPISODE_COLUMNS, [{**row, "map": name} for row in rows]
        )

    return rename
