"""The margin of original and incumbent under every way to account for contacts."""

from dataclasses import dataclass

import numpy as np

from harness.economics.accountings import ACCOUNTINGS, accounted
from harness.economics.cost_model import running
from harness.economics.valuation import CENT, deliveries
from harness.statistics import Interval
from harness.tuning.audit_findings import is_sure
from harness.tuning.audit_pairs import Pairs, Side
from navstack.types import FloatArray

PUBLISHED, NO_THRESHOLD = "published", "no_threshold"


@dataclass(frozen=True, slots=True)
class Score:
    """The contribution margin [USD/run] under one accounting, on the same deliveries."""

    accounting: str  # of harness.economics.accountings.ACCOUNTINGS
    original: float
    incumbent: float
    difference: Interval  # incumbent less original
    p: float  # of the paired sign-flip test

    @property
    def is_gain(self) -> bool:
        """Whether the incumbent is better, by a test at the auditor's level."""
        return (self.difference.value or 0.0) >= CENT and is_sure(self.p)

    @property
    def is_loss(self) -> bool:
        """Whether the incumbent is worse, by a test at the auditor's level."""
        return (self.difference.value or 0.0) <= -CENT and is_sure(self.p)


def score(pairs: Pairs) -> tuple[Score, ...]:
    """Score both under every accounting: the published one only where nobody kept events, none without a margin."""
    names = tuple(ACCOUNTINGS) if pairs.has_events else (PUBLISHED,)
    scores = []
    for name in names:
        original, incumbent = (margins(side, name, pairs) for side in (pairs.original, pairs.incumbent))
        if original is None or incumbent is None:
            return ()
        paired = pairs.compare_money(original, incumbent)
        means = float(original.mean()), float(incumbent.mean())
        scores.append(Score(name, *means, paired.difference, paired.p))
    return tuple(scores)


def margins(side: Side, accounting: str, pairs: Pairs) -> FloatArray | None:
    """Each delivery's contribution margin [USD]; None where the cargo is not modelled."""
    each = deliveries(side.rows, pairs.prices.rolling_resistance_force)
    if accounting != PUBLISHED:
        each = accounted(each, side.rows, side.events or (), accounting, pairs.prices)
    margin = running(each, pairs.prices).contribution_margin
    return None if margin is None else np.broadcast_to(np.asarray(margin, dtype=np.float64), len(side.rows))
