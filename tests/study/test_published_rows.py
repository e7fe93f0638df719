"""The program drives what the published studies hold.

The shortest deliveries of their stacks, column by column.

A number that changes anywhere on a delivery's way shows here. After a change that is meant to
change what stacks do, drive their cells anew (``tools/published_study.py``).
"""

import json
import math
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest

from harness.episode.episode import run_episode
from harness.task.study import make_study

BASELINE = Path(__file__).parents[2] / "results" / "baseline"
MAP, WORLD = "sidewalk_2", "published"
STUDIES = {"study": 3000, "evasive_study": 4000}  # folder -> seed
STACKS = (
    *(
        "nav2-gps-ekf",
        "nav2-amcl",
        "nav2-amcl-gps",
        "nav2-stock",
        "rpp-gps-ekf",
        "mpc-gps-ekf",
        "mppi-gps-ekf",
    ),
    *("graceful-gps-ekf", "ompl-gps-ekf", "paper-gps"),
)
CELLS = [*(("study", stack, ()) for stack in STACKS), ("evasive_study", "evasive-gps-ekf", ())]
CELLS += [  # with what must have happened on the way
    ("study", "nav2-gps-ekf", ("pedestrian_contacts",)),
    ("study", "graceful-gps-ekf", ("spins", "waits")),
    ("study", "rpp-gps-ekf", ("recoveries", "pieces_lost")),
]
CELLS.sort(key=lambda cell: cell[1])  # a stack's brain is made once
OTHER = ("stack_number", "episode")  # count something else in a run of one delivery


@pytest.mark.parametrize(
    ("study", "stack", "met"), CELLS, ids=[" ".join((cell[1], *cell[2])) for cell in CELLS]
)
def test_the_shortest_delivery_is_driven_as_it_was(
    study: str, stack: str, met: tuple[str, ...]
) -> None:
    folder = BASELINE / study / f"{MAP}-{WORLD}-seed{STUDIES[study]}-{stack}"
    driven_with = json.loads((folder / "run.json").read_text())["versions"]
    others = [
        name for name in driven_with if name != "navbench" and version(name) != driven_with[name]
    ]
    if others:
        pytest.skip(f"the study was driven with other versions of {', '.join(others)}")
    rows = pq.read_table(folder / "episodes.parquet").to_pylist()
    eventful = [
        row for row in rows if all(row[name] for name in met) and (met or row["outcome"] == "sla")
    ]
    wanted = min(eventful, key=lambda row: row["duration_s"])
    number = wanted["episode"]
    driven = make_study(
        stacks=[stack], episodes=number + 1, seed=STUDIES[study], map_name=MAP, world=WORLD
    )
    task = next(each for each in driven.tasks() if each.episode == number)
    row = run_episode(task).row
    differing = {
        name: (row.get(name), value)
        for name, value in wanted.items()
        if not _is_same(row.get(name), value)
    }
    assert not {name: pair for name, pair in differing.items() if name not in OTHER}


def _is_same(ours: Any, stored: Any) -> bool:
    if isinstance(stored, float) and isinstance(ours, float):
        return math.isclose(ours, stored, rel_tol=1e-9, abs_tol=1e-9) or (
            math.isnan(ours) and math.isnan(stored)
        )
    return bool(ours == stored)
