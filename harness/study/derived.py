"""What of a run folder follows from the rest of it by a formula."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from harness.economics.prices import Prices
from harness.economics.valuation import value
from harness.metrics.columns import Row
from harness.metrics.delivery_log import JOULES_PER_KWH
from harness.metrics.motion import success_weighted_path_length
from harness.storage.new_run import OF_STACKS
from harness.study.stored_run import StoredRun, StoredStack
from harness.world.outcome import ARRIVALS, Outcome

NEAR = 1e-9  # share by which sums may differ, which were added up in another order


def in_formulas(rows: Iterable[Row], prices: Prices) -> Iterator[tuple[Row, str]]:
    """Rows with a column that is not what its formula makes of others, and which."""
    force = prices.rolling_resistance_force
    for row in rows:
        distance, has_arrived = row["distance_m"], Outcome(row["outcome"]) in ARRIVALS
        told = {"published_energy_kwh": force * distance / JOULES_PER_KWH}
        if row["way_back"] is None:  # else the distance has a part that SPL has not
            shortest = row["shortest_path_m"]
            told["spl"] = success_weighted_path_length(has_arrived, shortest, distance)
        for name, known in told.items():
            if row[name] is not None and not is_near(row[name], known):
                yield row, f"{name} {row[name]:.4g}, which is {known:.4g}"


def in_economics(run: StoredRun) -> Iterator[str]:
    """Stacks of a packed run whose economics do not follow from their rows."""
    own, prices = run.about.get(OF_STACKS, {}), run.prices()
    for stack in run.stacks:
        told = own.get(stack.name, {}).get("economics")
        if told is not None and not _is_told(told, stack, prices, run.seed):
            yield f"the economics of {stack.name} in run.json do not follow from its deliveries"


def _is_told(told: Any, stack: StoredStack, prices: Prices, seed: int) -> bool:
    if not isinstance(told, Mapping) or not stack.rows:
        return False
    valuation = value(stack.rows, stack, prices, seed, left_out=stack.errors)
    ours = valuation.economics.as_json()
    return is_like(told, {key: ours.get(key) for key in told})


def is_near(one: float, other: float) -> bool:
    """Whether two numbers are equal but for their last digits."""
    return math.isclose(one, other, rel_tol=NEAR, abs_tol=NEAR)


def is_like(stored: Any, ours: Any) -> bool:
    """Whether two JSON documents say the same, numbers to the last digits but a few."""
    if isinstance(ours, Mapping):
        return (
            isinstance(stored, Mapping)
            and stored.keys() == ours.keys()
            and all(is_like(stored[key], ours[key]) for key in ours)
        )
    if isinstance(ours, Sequence) and not isinstance(ours, str):
        return (
            isinstance(stored, list)
            and len(stored) == len(ours)
            and all(map(is_like, stored, ours))
        )
    if isinstance(ours, float) and isinstance(stored, int | float):
        return is_near(stored, ours)
    return bool(stored == ours)
