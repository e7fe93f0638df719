"""What ``navbench price`` found.

The tables of a run, and the money under other accounting.
"""

from collections.abc import Iterator, Mapping, Sequence

from harness.analysis.price_sets import UnderSet
from harness.analysis.repricing import VARIED, Choices, Repriced
from harness.economics.accountings import AT_FAULT, PUBLISHED
from harness.economics.cost_terms import COST_TERMS, MARGIN
from harness.economics.valuation import MOST_LEFT_OUT, Risk, has_too_few
from harness.report.blocks import Block, Table, Text, declared, notes_of
from harness.report.numbers import UNDEFINED, count_text, counted, interval_text, number_text
from harness.report.paper_tables import own_column, paper_blocks
from harness.report.texts import TEXTS, notes
from harness.statistics.interval import Interval
from harness.study.stored_run import StoredRun

TITLES = TEXTS.accountings
NO_CARGO, TOO_FEW = "the cargo was not simulated", "too many deliveries have no result"
NO_MARGIN = (
    f"no margin: more than {MOST_LEFT_OUT:.0%} of the deliveries have no result; drive them again "
    "with navbench run --resume DIR --retry-errors"
)
# of the accountings, those that screens show; tables and documents have all
SHOWN = (PUBLISHED, AT_FAULT, "no_threshold")
VARIED_TITLES = {"opex": "OPEX", MARGIN: "Margin"}


def repriced_blocks(run: StoredRun, results: Sequence[Repriced], choices: Choices) -> list[Block]:
    """The tables, the accountings, the risk and what was changed."""
    # which reads worlds, and so the simulator's parameters
    from harness.report.short.setup import robot_price_line

    columns = [
        own_column(each.stack.name, each.valuation, len(each.stack.rows)) for each in results
    ]
    blocks = [*paper_blocks(columns), Text(""), *map(_accountings, results)]
    blocks += notes_of(notes("accountings"))
    if rule := goes_with(choices):
        blocks.append(Text(f"{rule}: its row is theirs, the lines below are by the published rule"))
    for each in results:
        blocks += [Text(f"{each.stack.name}: {line}") for line in _lines(each)]
    blocks += [Text(f"set: {key} = {number:g}") for key, number in choices.settings.items()]
    lines = [robot_price_line(run, choices.prices), f"run folder: {run.folder}"]
    return [*blocks, *(Text(line, "whole") for line in lines if line)]


def goes_with(choices: Choices) -> str:
    """By which accounting the chosen prices are paid; empty: by the published one."""
    paying = choices.prices.accounting
    if paying == PUBLISHED:
        return ""
    return f"these prices go with the accounting '{TITLES[paying]}'"


def _lines(result: Repriced) -> Iterator[str]:
    """What is to be said of one stack."""
    is_short = has_too_few(len(result.stack.rows), result.stack.errors)
    yield forgiven(result.forgiven, TOO_FEW if is_short else "")
    yield (
        f"{_share_text(result.turned)} counted contacts with people are beyond the peak of the "
        f"published cost, {result.turn_ns:,.0f} N s"
    )
    yield (
        f"{_share_text(result.beyond_limit)} contacts with people are beyond the limit of "
        f"ISO/TS 15066 for a lower leg, closing at {result.limit_mps:.2f} m/s"
    )
    yield risk_text(result.valuation.risk, is_short)
    if result.stack.errors:
        yield f"{counted(result.stack.errors, 'delivery')} ended in an error, left out"
    if is_short:
        yield NO_MARGIN
    for name, term in result.valuation.terms.items():
        yield (
            f"optional term {name}, not in the paper, adds {term.capex_usd:,.2f} $ to CAPEX and "
            f"{number_text(term.opex, 4)} $/run to OPEX"
        )


def price_set_blocks(run: StoredRun, sets: Mapping[str, UnderSet]) -> list[Block]:
    """What each stack earns under each set of prices, what is left, and where the order changes."""
    stacks = [stack.name for stack in run.stacks if stack.rows]
    blocks: list[Block] = []
    for sheet, key in (("price_sets", "margin"), ("price_set_profits", "profit")):
        rows = [_price_set_row(name, each, stacks, key) for name, each in sets.items()]
        blocks.append(declared(sheet, rows, columns=stacks))
    (first, published), *others = sets.items()
    if len(stacks) > 1:
        changed = [
            f"{name} ({' > '.join(each.order)})"
            for name, each in others
            if each.order != published.order
        ]
        order = " > ".join(published.order)
        under = ", ".join(changed) or "none"
        blocks.append(Text(f"order under {first}: {order}; other under: {under}", "whole"))
    return [*blocks, Text(f"run folder: {run.folder}", "whole")]


def _price_set_row(name: str, each: UnderSet, stacks: Sequence[str], key: str) -> list[str]:
    choices = each.choices
    terms = ", ".join(choices.optional.names) or UNDEFINED
    money = [
        interval_text(getattr(each.money.get(stack), key, None), absent="undefined")
        for stack in stacks
    ]
    return [name, TITLES[choices.prices.accounting], terms, *money]


def forgiven(difference: Interval | None, why: str = "") -> str:
    """How much the published rule does not charge for, in one line.

    By how much its margin is above monotone's; ``why`` it is unknown, if it is.
    """
    if difference is None or difference.value is None:
        return f"what the published rule forgives is undefined, because {why or NO_CARGO}"
    return (
        f"the published rule forgives {interval_text(difference)} $ a delivery (n = "
        f"{difference.n}): injuries beyond "
        "its peak, touches of property below 100 N s and of kinds without a price"
    )


def _share_text(share: Interval) -> str:
    if share.value is None:
        return "none of 0"
    return f"{round(share.value * share.n)} of {share.n} ({interval_text(share, 3)})"


def risk_text(risk: Risk, is_short: bool = False) -> str:
    """The risk in one line; ``is_short``: too many deliveries have no result to tell a margin."""
    worst = risk.opex_cvar95_usd_per_run
    if worst is None:
        return (
            "chance of break-even and mean of the worst deliveries undefined: "
            "they need several missions, with cargo"
        )
    text = f"the worst 5 % of deliveries cost {interval_text(worst)} $ each"
    if worst.low is None:
        text += " (too few, or all alike: no interval)"
    if risk.break_even_probability is None:
        why = "all deliveries earned the same, so nothing is known of rare ones"
        if is_short:
            why = TOO_FEW
        return f"{text}; chance of break-even undefined: {why}"
    return (
        f"{text}; breaks even within the robot's life of {risk.within_runs:,.0f} runs with "
        f"probability {risk.break_even_probability:.3f}"
    )


def _accountings(result: Repriced) -> Table:
    rows = []
    for name, found in result.accountings.items():
        cells = [interval_text(found.intervals.get(term), absent="undefined") for term in VARIED]
        rows.append((TITLES[name], *cells, count_text(found.break_even_runs)))
    columns = [VARIED_TITLES.get(key) or COST_TERMS[key].title for key in VARIED]
    return declared("accountings", rows, columns=[*columns, "BEP (runs)"], stack=result.stack.name)
