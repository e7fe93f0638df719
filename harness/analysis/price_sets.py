"""A stored run under every shipped set of prices: who earns money where, and where the order of the stacks changes."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from harness.analysis.repricing import choose, reprice
from harness.economics.prices import price_sets
from harness.statistics.interval import Interval
from harness.study.stored_run import StoredRun

MARGIN = "contribution_margin"


@dataclass(frozen=True, slots=True)
class UnderSet:
    """The stacks of a run at one set of prices."""

    accounting: str  # by which contacts are paid
    margins: Mapping[str, Interval]  # [USD/run] by stack; those without a margin are left out

    @property
    def order(self) -> tuple[str, ...]:
        """The stacks, the one that earns most first."""
        return tuple(sorted(self.margins, key=lambda stack: -(self.margins[stack].value or 0.0)))

    def as_json(self) -> dict[str, Any]:
        """As one JSON object."""
        margins = {stack: margin.as_json() for stack, margin in self.margins.items()}
        return {"accounting": self.accounting, "margins": margins, "order": list(self.order)}


def under_price_sets(run: StoredRun) -> dict[str, UnderSet]:
    """What a run's stacks earn under each set, by its name; the published set first."""
    found = {}
    for name in price_sets():
        choices = choose(run, name, (), ())
        accounting = choices.prices.accounting
        results = {each.stack.name: each.accountings[accounting].intervals for each in reprice(run, choices)}
        margins = {stack: intervals[MARGIN] for stack, intervals in results.items() if MARGIN in intervals}
        found[name] = UnderSet(accounting, margins)
    return found
