"""The stacks that a page shows, each with its money delivery by delivery."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harness.analysis.side import Side
from harness.economics.break_even import profit_draws
from harness.economics.cost_model import RunningCosts, running
from harness.economics.prices import Prices
from harness.economics.valuation import (
    CENT,
    Valuation,
    deliveries,
    has_too_few,
    missions,
    tells_of_rare,
    value,
)
from harness.metrics.columns import Row
from harness.report.numbers import all_of
from harness.report.page.origin import Place, page_origin
from harness.report.paper_tables import Column, own_column
from harness.report.repriced import NO_CARGO, TOO_FEW
from harness.report.short.run import admitting_unseen
from harness.study.stored_run import StoredRun, StoredStack
from navstack.errors import InputError
from navstack.types import FloatArray


@dataclass(frozen=True, slots=True)
class PageEntry:
    """One stack of one run."""

    label: str  # unlike every other on the page
    # of the run's map: its name, and its version where another map of the page has that name, too
    map_label: str
    run: StoredRun
    stack: StoredStack
    prices: Prices
    valuation: Valuation
    running: RunningCosts  # [USD/run] arrays (n,), one entry per delivery
    events: dict[int, list[Row]]  # of every delivery, by episode
    origin: Place  # from which the page counts places of the map

    @property
    def side(self) -> Side:
        """As it is compared with others."""
        return Side(self.run, self.stack)

    @property
    def margin(self) -> FloatArray | None:
        """What each delivery earns less what it costs [USD], shape (n,).

        None: the cargo was not simulated.
        """
        margin: FloatArray | None = self.running.contribution_margin
        return margin

    @property
    def column(self) -> Column:
        """Its column of the tables, with the margin's interval that screens show."""
        column = own_column(self.label, self.valuation, len(self.stack.rows))
        return admitting_unseen(self.run, self.stack, column)

    @property
    def has_too_few(self) -> bool:
        """Whether so many deliveries have no result that nothing is said of the mean margin."""
        return has_too_few(len(self.stack.rows), self.stack.errors)

    @property
    def no_margin(self) -> str:
        """Why nothing is said of the mean margin; empty: it is known."""
        if self.margin is None:
            return NO_CARGO
        return TOO_FEW if self.has_too_few else ""

    @property
    def no_draws(self) -> str:
        """Why the mean margin has no bootstrap; empty: it has one."""
        if self.margin is None or self.has_too_few:
            return self.no_margin
        if tells_of_rare(self.margin, missions(self.stack.rows)):
            return ""
        if np.ptp(self.margin) <= CENT:
            return "all deliveries earned the same"
        return "too few deliveries"

    def mean_draws(self) -> FloatArray | None:
        """Bootstrap draws of the mean margin [USD/run].

        None: undefined, or too few or too much alike to tell.
        """
        if self.margin is None or self.no_draws:
            return None
        return profit_draws(self.margin, missions(self.stack.rows), self.run.seed)[0]


def entries_of(runs: Sequence[StoredRun]) -> list[PageEntry]:
    """Every stack that finished a delivery, in the order given.

    Raises:
        InputError: none did.
    """
    pairs = [(run, stack) for run in runs for stack in run.stacks if stack.rows]
    if not pairs:
        raise InputError("no delivery of these runs finished: there is nothing to report")
    names = [stack.name for _, stack in pairs]
    labels = [
        stack.name if names.count(stack.name) == 1 else f"{run.folder.resolve().name}:{stack.name}"
        for run, stack in pairs
    ]
    unlike = [
        label if labels.count(label) == 1 else f"{label} ({labels[:number].count(label) + 1})"
        for number, label in enumerate(labels)
    ]
    maps = _map_labels([run for run, _ in pairs])
    origins: dict[str, Place] = {}
    for run, stack in pairs:
        start = (stack.rows[0][key] or 0.0 for key in ("start_x_m", "start_y_m"))
        origins.setdefault(maps[_map_of(run)], page_origin(*start))
    return [
        _entry(label, maps[_map_of(run)], origins, run, stack)
        for label, (run, stack) in zip(unlike, pairs, strict=True)
    ]


def _map_labels(runs: Sequence[StoredRun]) -> dict[tuple[str, str], str]:
    """A label for each map, by its name and its digest."""
    maps = list(dict.fromkeys(map(_map_of, runs)))
    names = [name for name, _ in maps]
    return {
        (name, digest): name if names.count(name) == 1 else f"{name} ({digest[:12] or 'unknown'})"
        for name, digest in maps
    }


def _map_of(run: StoredRun) -> tuple[str, str]:
    return run.map_name, str(run.about.get("map_sha256", ""))


def notes_of(runs: Sequence[StoredRun]) -> list[str]:
    """Notes on stacks that have not driven all deliveries, or of which nothing is shown."""
    told = ((run, stack, _missing(run, stack)) for run in runs for stack in run.stacks)
    return [
        f"{run.folder.resolve().name}: {stack.name} {missing}"
        for run, stack, missing in told
        if missing
    ]


def _missing(run: StoredRun, stack: StoredStack) -> str:
    """What a stack lacks; empty: nothing."""
    done, asked = len(stack.rows) + stack.errors, run.asked_of(stack.name)
    if not done:
        return "is left out: it has driven nothing yet; --resume of the run goes on"
    if not stack.rows:
        return f"is left out: {all_of(done, 'delivery')} of it ended in an error"
    if done < asked:
        return f"has driven {done} of its {asked} deliveries; --resume of the run goes on"
    return ""


def _entry(
    label: str, map_label: str, origins: dict[str, Place], run: StoredRun, stack: StoredStack
) -> PageEntry:
    prices = run.prices()
    each = running(deliveries(stack.rows, prices.rolling_resistance_force), prices)
    events: dict[int, list[Row]] = {row["episode"]: [] for row in stack.rows}
    for event in run.events:
        if event["stack"] == stack.name and event["episode"] in events:
            events[event["episode"]].append(event)
    return PageEntry(
        label,
        map_label,
        run,
        stack,
        prices,
        value(stack.rows, stack, prices, run.seed, left_out=stack.errors),
        each,
        events,
        origins[map_label],
    )
