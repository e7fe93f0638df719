"""What a run of one stack measured, as far as the published rows tell of it."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from harness.calibration.candidate import changes
from harness.metrics import Row
from harness.report.published import PublishedMethod
from harness.statistics import Interval
from harness.stored_run import StoredRun
from harness.valuation import OUTCOMES, mean_intervals, missions, value
from navstack.errors import InputError

METHODS = {"paper-gps": "nav2_gps", "paper-amcl": "nav2_amcl"}  # stack -> published method that it stands for
STANDING = ("parked", "navdp")  # a stack that never moves and the published method that almost stands still
STACKS = (*METHODS, STANDING[0])
INJURY = "pedestrian_injury_usd_per_run"
MEANS = (INJURY, "avg_collision_impulse_ns", "avg_distance_km", "avg_runtime_h", "avg_velocity_mps")
PROPERTY = ("mailbox_contacts", "trash_bin_contacts", "building_glass_contacts", "bollard_contacts")


@dataclass(frozen=True, slots=True)
class Reading:
    """A run of one stack."""

    folder: Path
    stack: str
    seed: int
    n: int  # finished deliveries
    errors: int  # deliveries without a result
    counts: dict[str, int]  # deliveries by outcome
    means: dict[str, Interval]  # by key of MEANS, per delivery
    margin: Interval  # [USD/run]
    injury_per_second: Interval  # [USD/s] all injuries over all time
    property_contacts: int  # counted contacts with what the paper lists
    settings: dict[str, Any]  # in which the world differs from the shipped one

    def share(self, outcome: str) -> float:
        """Share of the deliveries with an outcome."""
        return self.counts[outcome] / self.n


def read_run(run: StoredRun) -> Reading:
    """What a run measured.

    Raises:
        InputError: it has several stacks, or no finished delivery.
    """
    if len(run.stacks) != 1 or not run.stacks[0].rows:
        raise InputError(f"run folder '{run.folder}' must hold one stack with finished deliveries")
    (stack,) = run.stacks
    rows = stack.rows
    valuation = value(rows, stack, run.prices(), run.seed)
    outcomes = [row["outcome"] for row in rows]
    measured, intervals = valuation.measured, valuation.intervals
    return Reading(
        folder=run.folder,
        stack=stack.name,
        seed=run.seed,
        n=len(rows),
        errors=stack.errors,
        counts={outcome: outcomes.count(outcome) for outcome in OUTCOMES},
        means={key: intervals.get(key, Interval(measured[key], None, None, len(rows))) for key in MEANS},
        margin=intervals.get("contribution_margin", Interval(None, None, None, len(rows))),
        injury_per_second=_per_second(rows, run.seed),
        property_contacts=round(sum(measured[key] or 0.0 for key in PROPERTY) * len(rows)),
        settings=changes(run),
    )


def published_count(method: PublishedMethod, outcome: str) -> int:
    """Published deliveries with an outcome."""
    share: float = getattr(method.measured, outcome)
    return round(share * method.episodes)


def published_property_contacts(method: PublishedMethod) -> int:
    """Published counted contacts with property."""
    return round(sum(getattr(method.measured, key) or 0.0 for key in PROPERTY) * method.episodes)


def by_stack(readings: Iterable[Reading]) -> dict[str, Reading]:
    """The readings by their stack."""
    return {reading.stack: reading for reading in readings}


def _per_second(rows: tuple[Row, ...], seed: int) -> Interval:
    """Injuries over time [USD/s], a ratio of sums: each delivery weighs as long as it lasts."""
    cost = np.array([row["pedestrian_injury_usd"] for row in rows])
    seconds = np.array([row["duration_s"] for row in rows])
    rate = float(cost.sum() / seconds.sum())
    # The mean of what each delivery costs beyond its share is 0; its interval over the mean time is that of the ratio.
    beyond = mean_intervals({"rate": cost - rate * seconds}, missions(rows), seed)["rate"]
    if beyond.low is None or beyond.high is None:
        return Interval(rate, None, None, len(rows))
    mean = float(seconds.mean())
    return Interval(rate, rate + beyond.low / mean, rate + beyond.high / mean, len(rows))
