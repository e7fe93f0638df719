"""The margins of two stacks whose deliveries are not the same missions, or not as many."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harness.analysis.rare import reach_of
from harness.analysis.side import Side
from harness.economics.valuation import MISSION, margins
from harness.metrics.columns import Row
from harness.statistics.apart import Sample, cheapest_sizes, difference_apart
from harness.statistics.bootstrap import number_clusters
from harness.statistics.interval import Interval, fewest_missions
from harness.statistics.paired import z_of_power
from harness.storage.rows import values

KEY = ("seed", *MISSION)  # columns that tell missions of several runs apart


@dataclass(frozen=True, slots=True)
class Apart:
    """What all deliveries of both say of their margins."""

    deliveries: tuple[int, int]
    difference: Interval  # [USD] second less first, admitting losses not seen
    # deliveries of each that resolve 1 USD with a power of 0.8 in the least time, and their time
    # [s of a worker]; None: a run does not tell its times
    of_a_dollar: tuple[int, int] | None
    seconds: float | None


def apart(first: Side, second: Side) -> Apart | None:
    """Compare the mean margins of all finished deliveries of two stacks.

    Returns:
        None where a margin is not defined.
    """
    samples = _samples(first, second)
    if samples is None:
        return None
    rng = np.random.default_rng(first.run.seed)
    found = Apart(
        deliveries=(len(samples[0].values), len(samples[1].values)),
        difference=difference_apart(*samples, rng),
        of_a_dollar=None,
        seconds=None,
    )
    a, b = first.seconds, second.seconds
    if not a or not b:
        return found
    spreads = samples[0].spread, samples[1].spread
    sizes = cheapest_sizes(spreads, (a, b), 1.0 / z_of_power())
    least = fewest_missions()
    chosen = max(sizes[0], least), max(sizes[1], least)
    return dataclasses.replace(found, of_a_dollar=chosen, seconds=chosen[0] * a + chosen[1] * b)


def _samples(first: Side, second: Side) -> tuple[Sample, Sample] | None:
    rows = first.stack.rows, second.stack.rows
    numbers = number_clusters([*_missions(rows[0]), *_missions(rows[1])])
    middle = len(rows[0])
    samples = []
    for side, own, missions in zip(
        (first, second), rows, (numbers[:middle], numbers[middle:]), strict=True
    ):
        margin = margins(own, side.run.prices())
        if margin is None or not margin.size:
            return None
        reach = reach_of(side.run)
        samples.append(Sample(margin, missions, max(float(margin.max()), reach.least), reach))
    return samples[0], samples[1]


def _missions(rows: Sequence[Row]) -> list[tuple[object, ...]]:
    return list(zip(*(values(rows, key) for key in KEY), strict=True))
