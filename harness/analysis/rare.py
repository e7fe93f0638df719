"""Margins of stored runs with intervals that admit an unseen loss."""

import math
from collections.abc import Mapping

import numpy as np

from harness.economics.unseen import (
    difference_admitting_unseen,
    margin_admitting_unseen,
    reach_of_loss,
)
from harness.economics.valuation import margins, missions
from harness.statistics.bootstrap import IntArray
from harness.statistics.interval import Interval
from harness.statistics.unseen import Reach
from harness.study.stored_run import StoredRun, StoredStack
from navstack.types import FloatArray


def reach_of(run: StoredRun) -> Reach:
    """What a delivery of a run could lose, at its prices and in its world."""
    world = run.condition("world")
    bodies = None
    if isinstance(world, Mapping):
        bodies = world.get("pedestrian_bodies")
    most = None
    if isinstance(bodies, Mapping):
        most = bodies.get("max_contact_impulse")
    return reach_of_loss(
        run.prices(), float(most) if isinstance(most, int | float) and most > 0.0 else math.inf
    )


def margin_with_unseen(run: StoredRun, stack: StoredStack) -> Interval | None:
    """The mean margin of a stack [USD/run].

    None: the cargo was not simulated, or it has driven nothing.
    """
    margin = None
    if stack.rows:
        margin = margins(stack.rows, run.prices())
    if margin is None:
        return None
    return margin_admitting_unseen(margin, reach_of(run), missions(stack.rows), run.seed)


def difference_with_unseen(
    first: StoredRun, second: StoredRun, differences: FloatArray, clusters: IntArray
) -> Interval:
    """The mean margin difference [USD/run] of two runs, by the wider reach of both."""
    both = reach_of(first), reach_of(second)
    reach = Reach(min(each.least for each in both), max(each.most for each in both))
    known = ~np.isnan(differences)
    return difference_admitting_unseen(differences[known], reach, clusters[known], first.seed)
