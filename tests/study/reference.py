"""Eighteen deliveries as they were driven once, with all columns of their rows.

After a change that is meant to change what stacks do, write them anew:

    python tests/study/reference.py

With ``--check`` they are driven and compared, also on an emulated processor:

    qemu-x86_64 -cpu EPYC-Rome python tests/study/reference.py --check
"""

import navstack.dispatch  # isort: skip  # noqa: F401  first: it chooses the loops of numpy

import json
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from harness.episode.episode import run_episode
from harness.execution.arithmetic import machine, other_arithmetic, trouble_of_this_process
from harness.metrics.columns import EPISODE_COLUMNS, Row
from harness.study.manifest import LIBRARIES
from harness.task.study import make_study

TABLE = Path(__file__).with_name("reference_rows.parquet")
MAP, WORLD, SEED = "sidewalk_2", "paper_loose_bucket", 9000
SHORT = 10  # a delivery of 13 to 16 s
EVENTFUL = (  # with what must have happened on the way
    ("evasive-gps-ekf", 13, ("min_time_to_collision_s",)),
    ("graceful-gps-ekf", 8, ("pedestrian_contacts", "recoveries", "pieces_lost")),
    ("mppi-gps-ekf", 1, ("pedestrian_contacts",)),
    ("nav2-amcl", 8, ("pedestrian_contacts", "pieces_lost")),
    ("nav2-stock", 1, ("pedestrian_contacts", "recoveries")),
    ("paper-gps", 12, ("pedestrian_contacts",)),
    ("rpp-gps-ekf", 5, ("spins", "waits", "recoveries")),
)
STACKS = (
    "evasive-gps-ekf",
    "graceful-gps-ekf",
    "mpc-gps-ekf",
    "mppi-gps-ekf",
    "nav2-amcl",
    "nav2-amcl-gps",
    "nav2-gps-ekf",
    "nav2-stock",
    "ompl-gps-ekf",
    "paper-gps",
    "rpp-gps-ekf",
)
DELIVERIES = [(stack, SHORT) for stack in STACKS] + [each[:2] for each in EVENTFUL]


def drive(stack: str, episode: int) -> Row:
    """The row of a delivery."""
    study = make_study(stacks=[stack], episodes=episode + 1, seed=SEED, map_name=MAP, world=WORLD)
    task = next(each for each in study.tasks() if each.episode == episode)
    return run_episode(task).row


def stored() -> tuple[dict[tuple[str, int], Row], dict[str, Any]]:
    """The rows by stack and episode, and what is noted of the machine and the libraries."""
    table = pq.read_table(TABLE)
    rows = {(row["stack"], row["episode"]): row for row in table.to_pylist()}
    return rows, json.loads(table.schema.metadata[b"driven"])


def difference(driven: dict[str, Any]) -> str:
    """Why rows need not come out as they are stored; empty: they must, to the last bit."""
    for name in LIBRARIES:
        if driven["versions"][name] != version(name):
            return f"{name} {driven['versions'][name]} then, {version(name)} here"
    return other_arithmetic(driven["machine"])


def differing(row: Row, expected: Row) -> list[str]:
    """The columns in which a row is not as expected; NaN is as NaN."""
    return [
        name
        for name, value in expected.items()
        if row.get(name) != value and not (value != value and row.get(name) != row.get(name))
    ]


def write() -> None:
    """Drive all deliveries and store their rows."""
    assert not trouble_of_this_process()
    rows = [drive(*each) for each in DELIVERIES]
    table = pa.Table.from_pylist(
        [{name: row.get(name) for name in EPISODE_COLUMNS} for row in rows]
    )
    driven = {"machine": machine(), "versions": {name: version(name) for name in LIBRARIES}}
    table = table.replace_schema_metadata({"driven": json.dumps(driven)})
    pq.write_table(table, TABLE, compression="zstd")


def check() -> int:
    """Drive all deliveries, and say of each whether it came out as it is stored."""
    rows, driven = stored()
    sys.stdout.write(f"comparable: {difference(driven) or 'yes'}\n")
    others = 0
    for stack, episode in DELIVERIES:
        columns = differing(drive(stack, episode), rows[stack, episode])
        others += bool(columns)
        sys.stdout.write(f"{stack} {episode}: {', '.join(columns) or 'as stored'}\n")
        sys.stdout.flush()
    return min(others, 1)


if __name__ == "__main__":
    if sys.argv[1:] == ["--check"]:
        sys.exit(check())
    write()
