"""A stored run at other prices and under other accountings of contacts."""

import dataclasses
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from harness.analysis.rare import reach_of
from harness.economics.accountings import (
    ACCOUNTINGS,
    COUNTED,
    MONOTONE,
    PUBLISHED,
    accounted,
    contacts_of,
)
from harness.economics.break_even import break_even_runs
from harness.economics.contact_costs import turning_impulse
from harness.economics.contact_limits import beyond_limit, limit_speed
from harness.economics.cost_model import RunningCosts, running
from harness.economics.cost_terms import COUNTED_TERMS, MARGIN, OPTIONAL_TERMS, Paid
from harness.economics.optional_prices import load_optional_prices
from harness.economics.optional_terms import OptionalTerms, all_optional_costs, check_terms
from harness.economics.price import check_prices, names_of, with_values
from harness.economics.prices import Prices, checked, load_prices
from harness.economics.unseen import margin_admitting_unseen
from harness.economics.valuation import (
    CENT,
    Valuation,
    deliveries,
    has_too_few,
    missions,
    valuation_document,
    value,
)
from harness.metrics.columns import Row
from harness.statistics.interval import NO_INTERVAL, Interval, interval_json, wilson_interval
from harness.statistics.mean_intervals import mean_intervals
from harness.storage.rows import values
from harness.study.stored_run import StoredRun, StoredStack, repriced
from navstack.errors import InputError, UnknownNameError
from navstack.types import FloatArray

# the money that an accounting of contacts changes
VARIED = (
    *(key for key, term in COUNTED_TERMS.items() if term.paid is Paid.CONTACT),
    *("opex", MARGIN),
)
# beside accountings: the margin of the published one less that of ``monotone``
FORGIVEN = "forgiven"


@dataclass(frozen=True, slots=True)
class Choices:
    """Prices and terms that a user asked for."""

    prices: Prices
    optional: OptionalTerms
    settings: Mapping[str, float]  # what was set one by one, for the record


@dataclass(frozen=True, slots=True)
class Accounting:
    """The money under one way to account for contacts."""

    intervals: dict[str, Interval]  # of :data:`VARIED`
    break_even_runs: float | None
    margins: FloatArray | None  # (n,) [USD] of the deliveries; None: undefined


@dataclass(frozen=True, slots=True)
class Repriced:
    """One stack's deliveries at the chosen prices."""

    stack: StoredStack
    valuation: Valuation
    accountings: dict[str, Accounting]  # by name of harness.economics.accountings.ACCOUNTINGS
    forgiven: Interval | None  # [USD/run] see :data:`FORGIVEN`; None: the margin is undefined
    turn_ns: float  # [N s] beyond which a contact with a person costs less by the published rule
    turned: Interval  # share of the counted contacts with people that are beyond
    limit_mps: float  # [m/s] closing speed of ISO/TS 15066, see harness.economics.contact_limits
    beyond_limit: Interval  # share of all contacts with people that are beyond


def choose(
    run: StoredRun,
    prices: str | None,
    settings: Mapping[str, float],
    terms: Sequence[str],
) -> Choices:
    """What to price a run with.

    Args:
        run: the run, whose own prices are the default.
        prices: a name of params/prices or a file; None: the run's own. Its optional terms are among
            those asked for.
        settings: values by key of the price file or of the optional terms', with or without the
            unit.
        terms: names of optional terms.

    Raises:
        InputError: a price file, setting or term that cannot be used.
    """
    if prices is None:
        loaded = run.prices()
    else:
        loaded = load_prices(prices)
    optional = load_optional_prices(loaded)
    own, other = names_of(loaded), names_of(optional)
    for key in settings:
        if key not in own | other:
            raise UnknownNameError("price", key, sorted(own | other))
    loaded = with_values(loaded, {key: number for key, number in settings.items() if key in own})
    optional = with_values(
        optional, {key: number for key, number in settings.items() if key in other}
    )
    check_prices(optional, "--set")
    names = check_terms([*loaded.terms, *terms])
    for key in (key for key in settings if key in other):
        users = [name for name, term in OPTIONAL_TERMS.items() if other[key] in term.prices]
        if not set(users) & set(names):
            raise InputError(
                f"--set {key} has no effect without an optional term; add --with "
                f"{' or '.join(users)}"
            )
    return Choices(checked(loaded, "--set"), OptionalTerms(names, optional), settings)


def reprice(run: StoredRun, choices: Choices) -> list[Repriced]:
    """Price every stack of a run; one without a finished delivery is left out."""
    return [_reprice(run, stack, choices) for stack in run.stacks if stack.rows]


def _reprice(run: StoredRun, stack: StoredStack, choices: Choices) -> Repriced:
    stack = repriced(stack, run.events, choices.prices)
    prices = choices.prices
    valuation = value(stack.rows, stack, prices, run.seed, choices.optional, stack.errors)
    costs = dict(_running_costs(run, stack, choices))
    turn = turning_impulse(prices)
    counted = contacts_of(stack.rows, run.events, COUNTED)
    impulses = counted.impulses[counted.with_people]
    return Repriced(
        stack=stack,
        valuation=valuation,
        accountings={
            name: _accounting(run, stack, valuation, each) for name, each in costs.items()
        },
        forgiven=_intervals(_margins([costs]), stack.rows, run.seed).get(FORGIVEN),
        turn_ns=turn,
        turned=wilson_interval(int((impulses > turn).sum()), impulses.size),
        limit_mps=limit_speed(prices),
        beyond_limit=beyond_limit(stack.rows, run.events, prices),
    )


def _accounting(
    run: StoredRun,
    stack: StoredStack,
    valuation: Valuation,
    costs: RunningCosts,
) -> Accounting:
    """The money under an accounting, on the same resamples as under the others."""
    terms = {key: costs.amounts[key] for key in VARIED}
    if has_too_few(len(stack.rows), stack.errors):
        del terms[MARGIN]
    intervals = mean_intervals(terms, missions(stack.rows), run.seed, CENT)
    margin = intervals.get(MARGIN, NO_INTERVAL).value
    runs = break_even_runs(valuation.economics.capex_usd, margin)
    return Accounting(intervals, runs, terms.get(MARGIN))


def _running_costs(
    run: StoredRun,
    stack: StoredStack,
    choices: Choices,
    names: Collection[str] = ACCOUNTINGS,
) -> Iterator[tuple[str, RunningCosts]]:
    """What a stack's deliveries cost and earn under every accounting, an entry per delivery."""
    prices = choices.prices
    each = deliveries(stack.rows, prices.rolling_resistance_force)
    extra = all_optional_costs(each, stack.localizer, prices, choices.optional)
    for name in names:
        yield name, running(accounted(each, stack.rows, run.events, name, prices), prices, extra)


def accounted_margins(
    first: StoredRun,
    parts: Sequence[tuple[StoredRun, StoredStack]],
    names: Collection[str] = ACCOUNTINGS,
    choices: Choices | None = None,
) -> dict[str, Interval]:
    """The mean margin of a stack under accountings, and :data:`FORGIVEN`, on the same resamples.

    Arguments, and where it is empty: as in :func:`accounted_dollars`.
    """
    known = accounted_dollars(first, parts, names, choices)
    rows = [row for _, stack in parts for row in stack.rows]
    return _intervals(known, rows, first.seed)


def accounted_dollars(
    first: StoredRun,
    parts: Sequence[tuple[StoredRun, StoredStack]],
    names: Collection[str] = ACCOUNTINGS,
    choices: Choices | None = None,
) -> dict[str, FloatArray]:
    """The margin (n,) [USD] of each delivery of a stack under accountings, run after run.

    Empty where it is undefined: the cargo was not simulated, or too many deliveries have no result.

    Args:
        first: whose prices hold where there are no others.
        parts: the stack in each of its runs; those without a delivery are left out.
        names: of the accountings.
        choices: prices and optional terms; None: the first run's prices, without terms.

    Raises:
        InputError: rows and events of a run are of different states.
    """
    choices = choices or Choices(first.prices(), OptionalTerms((), load_optional_prices()), {})
    driven = [
        (run, repriced(stack, run.events, choices.prices)) for run, stack in parts if stack.rows
    ]
    finished = sum(len(stack.rows) for _, stack in parts)
    if has_too_few(finished, sum(stack.errors for _, stack in parts)):
        return {}
    known = [dict(_running_costs(run, stack, choices, names)) for run, stack in driven]
    return _margins(known)


def _margins(known: Sequence[Mapping[str, RunningCosts]]) -> dict[str, FloatArray]:
    """Margins by accounting of several runs' deliveries together.

    Empty where they are undefined.
    """
    if not known or any(
        costs.contribution_margin is None for each in known for costs in each.values()
    ):
        return {}
    return {
        name: np.concatenate([each[name].contribution_margin for each in known])
        for name in known[0]
    }


def _intervals(
    margins: Mapping[str, FloatArray], rows: Sequence[Row], seed: int
) -> dict[str, Interval]:
    """The means of margins, and :data:`FORGIVEN`."""
    columns = dict(margins)
    if {PUBLISHED, MONOTONE} <= set(columns):
        columns[FORGIVEN] = columns[PUBLISHED] - columns[MONOTONE]
    return mean_intervals(columns, missions(rows), seed, CENT) if columns else {}


def admitting_unseen(
    run: StoredRun, priced: Repriced, accounting: str, prices: Prices
) -> Interval | None:
    """The margin under an accounting with the interval that admits an unseen loss.

    None: it is undefined.
    """
    found = priced.accountings[accounting].margins
    if found is None:
        return None
    reach = reach_of(run, prices, accounting)
    return margin_admitting_unseen(found, reach, missions(priced.stack.rows), run.seed)


def repricing_document(run: StoredRun, results: Sequence[Repriced], choices: Choices) -> Row:
    """The JSON document: that of ``navbench run``, with accountings and optional terms."""
    return {
        "schema": 1,
        "settings": dict(choices.settings),
        "accounting": choices.prices.accounting,
        "runs": [_stack_document(run, result, choices) for result in results],
    }


def _stack_document(run: StoredRun, result: Repriced, choices: Choices) -> Row:
    valuation, stack = result.valuation, result.stack
    return {
        "stack": stack.name,
        "map": run.map_name,
        "seed": run.seed,
        "episodes": len(stack.rows),
        "errors": stack.errors,
        "failures": sum(each is not None for each in values(stack.rows, "stack_error")),
        **valuation_document(valuation),
        "accountings": {
            name: _accounting_document(each) for name, each in result.accountings.items()
        },
        "margin_with_unseen": interval_json(
            admitting_unseen(run, result, choices.prices.accounting, choices.prices)
        ),
        "forgiven_usd_per_run": interval_json(result.forgiven),
        "contacts_beyond_turn": {"impulse_ns": result.turn_ns, "share": result.turned.as_json()},
        "contacts_beyond_iso_ts_15066": {
            "closing_speed_mps": result.limit_mps,
            "share": result.beyond_limit.as_json(),
        },
        "optional_terms": {
            name: {
                "in_paper": False,
                "capex_usd": term.capex_usd,
                "opex_usd_per_run": term.opex,
                "prices": {
                    key: dataclasses.asdict(getattr(choices.optional.prices, key))
                    for key in OPTIONAL_TERMS[name].prices
                },
            }
            for name, term in valuation.terms.items()
        },
        "folder": str(run.folder),
    }


def _accounting_document(accounting: Accounting) -> Row:
    intervals = accounting.intervals
    terms = {term: interval_json(intervals.get(term)) for term in VARIED}
    return {**terms, "break_even_runs": accounting.break_even_runs}
