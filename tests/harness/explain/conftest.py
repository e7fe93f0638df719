"""A run folder with a recorded delivery that cost something."""

import numpy as np
import pytest

from harness.metrics.columns import EVENT_COLUMNS
from harness.metrics.decisions import CRITIC_COLUMNS, DECISION_COLUMNS
from harness.storage.checksums import write_checksums
from harness.storage.shipped import shipped
from harness.storage.tables import write_table

from .made_up import CRITICS, END, HIT, arrays, contact, decision


@pytest.fixture
def folder(write_run):
    """A run of two deliveries.

    The first is recorded, with a contact that cost something; the second is without cost.
    """

    def change(row):
        row |= {
            "outcome": "sla",
            "reason": "arrived",
            "duration_s": END,
            "distance_m": END,
            "start_x_m": 0.0,
            "start_y_m": 0.0,
            "goal_x_m": END,
            "goal_y_m": 0.0,
            "pieces_at_start": 100,
            "pieces_lost": 3,
        }

    made = write_run("run", episodes=2, crowd=0.0, change=change)
    robot = (shipped("params") / "robots" / "segway_e1.yaml").read_text(encoding="utf-8")
    (made / "params" / "mine-robot.yaml").write_text(robot, encoding="utf-8")
    write_table(
        made / "events.parquet", EVENT_COLUMNS, [contact(HIT, 20.0), contact(15.0, 30.0, 0)]
    )
    (made / "recordings").mkdir()
    np.savez_compressed(made / "recordings" / "mine-0.npz", **arrays())
    critics = {f"{name}_{end}": kind for name in CRITICS for end, kind in CRITIC_COLUMNS.items()}
    rows = [decision(stamp) for stamp in np.arange(0.0, END, 0.05)]
    write_table(made / "recordings" / "mine-0-decisions.parquet", DECISION_COLUMNS | critics, rows)
    write_checksums(made)
    return made
