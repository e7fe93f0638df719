"""The printed result of ``navbench price``.

The tables of a run, and the money under other accounting.
"""

from collections.abc import Mapping, Sequence

from rich.console import Console

from harness.analysis.price_sets import UnderSet
from harness.analysis.repricing import VARIED, Choices, Repriced
from harness.economics.accountings import PUBLISHED
from harness.economics.cost_terms import COST_TERMS, MARGIN
from harness.economics.valuation import Risk
from harness.report.markdown import interval_text
from harness.report.sheet import Sheet, declared, print_sheet
from harness.report.tables import own_column, render_tables
from harness.report.texts import TEXTS, notes, print_notes
from harness.statistics.interval import Interval
from harness.study.stored_run import StoredRun

TITLES = TEXTS.accountings
VARIED_TITLES = {"opex": "OPEX", MARGIN: "Margin"}


def print_repriced(
    run: StoredRun, results: Sequence[Repriced], choices: Choices, console: Console
) -> None:
    """Print the tables, the accountings, the risk and what was changed."""
    columns = [
        own_column(each.stack.name, each.valuation, len(each.stack.rows)) for each in results
    ]
    render_tables(columns, console)
    console.print()
    for each in results:
        print_sheet(_accountings(each), console)
    print_notes(notes("accountings"), console)
    if (paying := choices.prices.accounting) != PUBLISHED:
        console.print(f"these prices go with the accounting '{TITLES[paying]}': its row is theirs")
    for each in results:
        for text in (
            forgiven(each.forgiven),
            *_contact_texts(each),
            risk_text(each.valuation.risk),
        ):
            console.print(f"{each.stack.name}: {text}")
        if each.stack.errors:
            console.print(
                f"{each.stack.name}: {each.stack.errors} deliveries ended in an error, left out"
            )
        for name, term in each.valuation.terms.items():
            console.print(
                f"{each.stack.name}: optional term {name}, not in the paper, adds {term.capex_usd:,.2f} $ to CAPEX and "
                f"{term.opex:.4f} $/run to OPEX",
            )
    for key, number in choices.settings.items():
        console.print(f"set: {key} = {number:g}")
    console.print(f"run folder: {run.folder}", soft_wrap=True)


def print_price_sets(run: StoredRun, sets: Mapping[str, UnderSet], console: Console) -> None:
    """Print what each stack earns under each set of prices, what is left of it, and where the order changes."""
    stacks = [stack.name for stack in run.stacks if stack.rows]
    for sheet, key in (("price_sets", "margin"), ("price_set_profits", "profit")):
        rows = [
            (
                name,
                TITLES[each.choices.prices.accounting],
                ", ".join(each.choices.optional.names) or "--",
                *(
                    interval_text(getattr(each.money.get(stack), key, None), absent="undefined")
                    for stack in stacks
                ),
            )
            for name, each in sets.items()
        ]
        print_sheet(declared(sheet, rows, columns=stacks), console)
    (first, published), *others = sets.items()
    changed = [name for name, each in others if each.order != published.order]
    if len(stacks) > 1:
        told = ", ".join(f"{name} ({' > '.join(sets[name].order)})" for name in changed)
        console.print(
            f"order under {first}: {' > '.join(published.order)}; other under: {told or 'none'}",
            soft_wrap=True,
        )
    console.print(f"run folder: {run.folder}", soft_wrap=True)


def forgiven(difference: Interval | None) -> str:
    """How much the published rule does not charge for, in one line.

    By how much its margin is above monotone's.
    """
    if difference is None or difference.value is None:
        return "what the published rule forgives is undefined, because the cargo was not simulated"
    return (
        f"the published rule forgives {interval_text(difference)} $ a delivery (n = {difference.n}): injuries beyond "
        "its peak, touches of property below 100 N s and of kinds without a price"
    )


def _contact_texts(result: Repriced) -> list[str]:
    """How many contacts with people the peak of the published cost and ISO/TS 15066 concern."""
    return [
        f"{_of(result.turned)} counted contacts with people are beyond the peak of the published cost, "
        f"{result.turn_ns:,.0f} N s",
        f"{_of(result.beyond_limit)} contacts with people are beyond the limit of ISO/TS 15066 for a lower leg, "
        f"closing at {result.limit_mps:.2f} m/s",
    ]


def _of(share: Interval) -> str:
    if share.value is None:
        return "none of 0"
    return f"{round(share.value * share.n)} of {share.n} ({interval_text(share, 3)})"


def risk_text(risk: Risk) -> str:
    """The risk in one line."""
    worst = risk.opex_cvar95_usd_per_run
    if worst is None:
        return "chance of break-even and mean of the worst deliveries undefined: they need several missions, with cargo"
    few = "" if worst.low is not None else " (too few, or all alike: no interval)"
    text = f"the worst 5 % of deliveries cost {interval_text(worst)} $ each{few}"
    if risk.break_even_probability is None:
        why = "all deliveries earned the same, so nothing is known of rare ones"
        return f"{text}; chance of break-even undefined: {why}"
    return (
        f"{text}; breaks even within the robot's life of {risk.within_runs:,.0f} runs with probability "
        f"{risk.break_even_probability:.3f}"
    )


def _accountings(result: Repriced) -> Sheet:
    rows = []
    for name, found in result.accountings.items():
        cells = [interval_text(found.intervals.get(term), absent="undefined") for term in VARIED]
        runs = found.break_even_runs
        rows.append((TITLES[name], *cells, "--" if runs is None else f"{runs:,.0f}"))
    columns = [VARIED_TITLES.get(key) or COST_TERMS[key].title for key in VARIED]
    return declared("accountings", rows, columns=[*columns, "BEP (runs)"], stack=result.stack.name)
