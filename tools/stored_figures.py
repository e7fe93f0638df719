"""What pages tell of stored deliveries: runs of results/baseline, pooled over maps, as texts."""

import dataclasses
from pathlib import Path

from harness.analysis.rare import reach_of
from harness.economics.rates import event_rates
from harness.economics.unseen import margin_admitting_unseen
from harness.economics.valuation import margins, missions
from harness.report.numbers import interval_text
from harness.statistics.interval import wilson_interval
from harness.storage.manifest_file import read_manifest
from harness.storage.rows import values
from harness.study.stored_run import StoredRun, load_run
from navstack.types import FloatArray

ROOT = Path(__file__).resolve().parents[1]
BASELINE = ROOT / "results" / "baseline"
MAPS = ("sidewalk", "sidewalk_1", "sidewalk_2")


def stacks_at(folder: str, place: str) -> list[str]:
    """The stacks that have driven at a place, by the names of its run and of the run's folder."""
    run = BASELINE / folder / place
    if not (run / "run.json").is_file():
        return []
    return [stack["name"] for stack in read_manifest(run)["stacks"]]


def pooled(folder: str, stack: str, places: tuple[str, ...]) -> StoredRun:
    """The deliveries of a stack at some places as one run."""
    runs = [load_run(f"{BASELINE / folder / place}:{stack}") for place in places]
    rows = [dict(row) for run in runs for row in run.stacks[0].rows]
    return dataclasses.replace(runs[0], stacks=(dataclasses.replace(runs[0].stacks[0], rows=rows),))


def margins_of(run: StoredRun) -> FloatArray:
    """What each delivery earns less what it costs [USD], shape (n,)."""
    found = margins(run.stacks[0].rows, run.prices())
    assert found is not None, "cargo is simulated in these worlds"
    return found


def margin_text(run: StoredRun) -> str:
    """The mean margin [USD/delivery], and the interval that admits an unseen loss."""
    rows = run.stacks[0].rows
    return interval_text(
        margin_admitting_unseen(margins_of(run), reach_of(run), missions(rows), run.seed)
    )


def share(run: StoredRun, outcome: str) -> str:
    """Of deliveries that ended so, with Wilson's interval."""
    ends = values(run.stacks[0].rows, "outcome")
    return interval_text(wilson_interval(ends.count(outcome), len(ends)), 3)


def rate_text(run: StoredRun, key: str) -> str:
    """A rate of events, with its exact Poisson interval."""
    return interval_text(event_rates(run.stacks[0].rows, run.prices())[key], 0)


def total(run: StoredRun, column: str) -> float:
    """Sum of a column of all deliveries."""
    return float(sum(values(run.stacks[0].rows, column)))


def speed_text(run: StoredRun) -> str:
    """The mean speed of all metres [m/s]."""
    return f"{total(run, 'distance_m') / total(run, 'duration_s'):.2f}"
