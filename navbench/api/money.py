"""What runs earn: compared, at other prices, and what it depends on."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from harness.analysis.audited import audit_sides
from harness.analysis.compare import Comparison, side_of
from harness.analysis.compare import compare as compare_sides
from harness.analysis.price_sets import UnderSet, under_price_sets
from harness.analysis.repricing import Choices, Repriced, choose, reprice, repricing_document
from harness.analysis.sensitivity import (
    MAPS,
    Sensitivity,
    sensitivities,
    sensitivity_document,
)
from harness.metrics.columns import Row
from harness.report.sensitivity import draw_figures
from harness.study.stored_run import require_different
from navbench.api.runs import Run
from navstack.errors import InputError


def compare(first: Run, second: Run, metrics: Collection[str] = ()) -> Comparison:
    """Two runs of one stack each, mission by mission: second minus first, and audited.

    Args:
        first: the baseline.
        second: what is compared with it.
        metrics: keys such as ``margin`` and ``sla``; none: all.

    Raises:
        InputError: several stacks in one, twice the same, no mission in common, or an unknown
            metric.
    """
    sides = side_of(first.stored), side_of(second.stored)
    require_different([side.run for side in sides])
    found = compare_sides(*sides, metrics)
    return replace(found, audit=audit_sides(*sides))


@dataclass(frozen=True)
class Repricing(Mapping[str, Repriced]):
    """A run at other prices: results by stack."""

    run: Run
    choices: Choices
    results: list[Repriced]

    def __getitem__(self, stack: str) -> Repriced:
        for each in self.results:
            if each.stack.name == stack:
                return each
        raise KeyError(stack)

    def __iter__(self) -> Iterator[str]:
        return (each.stack.name for each in self.results)

    def __len__(self) -> int:
        return len(self.results)

    @property
    def has_margins(self) -> bool:
        """Whether every stack has one; else nothing can be said of what they depend on."""
        paying = self.choices.prices.accounting
        return all(each.accountings[paying].margins is not None for each in self.results)

    def as_json(self) -> Row:
        """As ``navbench price --json`` prints it."""
        return repricing_document(self.run.stored, self.results, self.choices)


def price(
    run: Run,
    prices: str | None = None,
    settings: Mapping[str, float] | None = None,
    terms: Sequence[str] = (),
) -> Repricing:
    """A run at other prices, without driving again.

    Args:
        run: the run.
        prices: a name of params/prices or a file; None: the run's own.
        settings: other values of single prices, such as ``{"delivery_fee": 4.99}``.
        terms: costs that the paper leaves out, such as ``operator``.

    Raises:
        InputError: a price file, setting or term that cannot be used, or no finished delivery.
    """
    choices = choose(run.stored, prices, settings or {}, terms)
    results = reprice(run.stored, choices)
    if not results:
        raise InputError(
            f"run folder '{run.folder}' has no finished delivery; there is nothing to price"
        )
    return Repricing(run, choices, results)


def price_sets(run: Run) -> dict[str, UnderSet]:
    """A run under every set of prices in params/prices."""
    return under_price_sets(run.stored)


@dataclass(frozen=True)
class Sensitivities:
    """What the money of each stack of a run depends on."""

    run: Run
    choices: Choices
    results: list[Sensitivity]
    figures: list[str]

    def as_json(self) -> Row:
        """As ``navbench sensitivity --json`` prints it."""
        return sensitivity_document(self.run.stored, self.results, self.choices, self.figures)


def sensitivity(
    run: Run,
    prices: str | None = None,
    settings: Mapping[str, float] | None = None,
    terms: Sequence[str] = (),
    *,
    maps: Sequence[tuple[str, str]] = (),
    out: Path | None = None,
) -> Sensitivities:
    """What the money of a run depends on: every price, pairs of prices, chance.

    Args:
        run: the run.
        prices: as of :func:`price`.
        settings: as of :func:`price`.
        terms: as of :func:`price`.
        maps: pairs of prices, or of groups such as ``injury.costs``, that vary together.
        out: folder for the figures; None: none.

    Raises:
        InputError: an unknown price, no finished delivery, or a margin that is undefined.
    """
    choices = choose(run.stored, prices, settings or {}, terms)
    results = sensitivities(run.stored, choices, maps or MAPS)
    figures: list[str] = []
    if out is not None:
        figures = [str(path) for result in results for path in draw_figures(result, out)]
    return Sensitivities(run, choices, results, figures)
