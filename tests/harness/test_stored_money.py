"""The money of the stored studies at the published prices.

What they were published with, to a billionth.
"""

import json
from pathlib import Path

import numpy as np
import pytest

from harness.analysis.repricing import accounted_margins
from harness.economics.cost_model import price
from harness.economics.measured import Measured
from harness.economics.prices import load_prices
from harness.metrics.summary import summarize
from harness.report.suite.tables import COLUMNS
from harness.storage.tables import read_rows
from harness.study.stored_run import load_run, repriced

BASELINE = Path(__file__).parents[2] / "results" / "baseline"
FOLDERS = sorted(path.parent for path in BASELINE.rglob("episodes.parquet"))
PRICES = load_prices("costnav")
CLOSE = 1e-9


def published(folder):
    """The economics that are stored of a run's stacks."""
    own = json.loads((folder / "run.json").read_text(encoding="utf-8"))["of_stacks"]
    return {stack: said["economics"] for stack, said in own.items()}


@pytest.mark.parametrize("folder", FOLDERS, ids=lambda folder: str(folder.relative_to(BASELINE)))
def test_costnav_prices_give_what_is_published(folder):
    run = load_run(str(folder))
    stored = published(folder)
    for stack in run.stacks:
        again = repriced(stack, run.events, PRICES)
        for key in ("pedestrian_injury_usd", "collision_delta_v_mps"):
            told, found = ([row[key] for row in each.rows] for each in (stack, again))
            np.testing.assert_allclose(found, told, rtol=CLOSE, atol=CLOSE)
        measured = Measured(**summarize(again.rows, PRICES.rolling_resistance_force))
        money = price(measured, stack.carries, False, PRICES)
        for key, told in stored[stack.name].items():
            assert money.as_json()[key] == (
                None if told is None else pytest.approx(told, rel=CLOSE, abs=CLOSE)
            ), key


def test_published_accountings_are_those_of_the_stored_table():
    """Of a stack with squeezes, and of one with much property touched."""
    rows = read_rows(BASELINE / "study" / "table.parquet", COLUMNS)
    for stack in ("mpc-gps-ekf", "paper-amcl"):
        run = load_run(f"{BASELINE / 'published_3' / 'sidewalk'}:{stack}")
        found = accounted_margins(run, [(run, run.stacks[0])])
        own = {
            row["quantity"]: row["value"]
            for row in rows
            if (row["map"], row["stack"]) == ("sidewalk", stack)
        }
        for name, interval in found.items():
            key = "contribution_margin" if name == "published" else f"contribution_margin_{name}"
            assert interval.value == pytest.approx(own[key], abs=CLOSE), name
