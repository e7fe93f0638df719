"""The tables of a suite: Markdown for its page, and every quantity of every stack as Parquet."""

from collections.abc import Callable, Sequence
from pathlib import Path

from harness.analysis.rare import margin_with_unseen
from harness.economics.accountings import PUBLISHED
from harness.economics.cost_terms import MARGIN
from harness.economics.rates import MARGIN_PER_KM, PER_1000_KM, RATE_TITLES
from harness.report.markdown import table
from harness.report.numbers import bounds_text, interval_text, number_text, p_text
from harness.report.suite.results import Results, Standing
from harness.report.texts import OUTCOMES
from harness.statistics.interval import NO_INTERVAL, Interval
from harness.storage.files import writing
from harness.storage.rows import Row
from harness.storage.tables import write_table
from harness.storage.texts import name_of
from harness.study.suite import Condition

TABLE = "table.parquet"
COLUMNS = {
    "map": "string",
    "world": "string",
    "pedestrians": "int64",
    "sensors": "string",
    "stack": "string",
    "quantity": "string",
    "value": "double",
    "low": "double",
    "high": "double",
    "n": "int64",
}
MEANS = {  # of a valuation -> title, decimals
    "pedestrian_safety": ("injuries [USD]", 2),
    "avg_pedestrian_contacts": ("contacts with people", 3),
    "avg_velocity_mps": ("speed [m/s]", 2),
    MARGIN_PER_KM: ("margin [USD/km]", 2),
}
RATES = {key: title for key, title in RATE_TITLES.items() if key.endswith(PER_1000_KM.key)}


def counts(results: Results) -> str:
    """How many deliveries stand in each cell."""
    rows = [
        [stack, *(_count(each) for each in results.standings if each.stack == stack)]
        for stack in (name_of(name) for name in results.suite.stacks)
    ]
    return table(["stack", *map(results.label, results.conditions)], rows)


def margins(results: Results) -> str:
    """The margin of every stack under every condition, the best on average on top."""
    return _by_condition(results, lambda each: each.interval(MARGIN), _with_unseen)


def margins_under(results: Results, accounting: str) -> str:
    """The same under one accounting, stacks in the same order."""
    known = results.accounted
    return _by_condition(
        results, lambda each: known[each.condition, each.stack].get(accounting, NO_INTERVAL)
    )


def _with_unseen(standing: Standing) -> str:
    """The interval that admits an unseen loss."""
    assert standing.side is not None
    unseen = margin_with_unseen(standing.side.run, standing.side.stack)
    if unseen is None:
        return ""
    return f" ({bounds_text(unseen)})"


def _by_condition(
    results: Results,
    margin_of: Callable[[Standing], Interval],
    beside: Callable[[Standing], str] = lambda _: "",
) -> str:
    """A row for each stack, a column for each condition.

    ``margin_of`` is asked of cells with deliveries.
    """

    def cell(standing: Standing) -> str:
        if standing.valuation is None:
            return "not driven"
        return f"{interval_text(margin_of(standing), 2)}{beside(standing)}, n = {standing.n}"

    rows = [
        [f"`{stack}`", *(cell(each) for each in results.standings if each.stack == stack)]
        for stack in results.ranked
    ]
    return table(["stack", *map(results.label, results.conditions)], rows)


def of_condition(results: Results, condition: Condition) -> str:
    """What every stack that drove under a condition did, the best on average on top."""
    standings = {each.stack: each for each in results.under(condition)}
    first = name_of(results.suite.stacks[0])
    titles = [*OUTCOMES.values(), "margin [USD]", f"margin minus `{first}`'s", "p", "break-even"]
    further = [*(title for title, _ in MEANS.values()), *map(str.lower, RATES.values())]
    rows = [
        [f"`{stack}`", str(standings[stack].n), *_line(results, standings[stack])]
        for stack in results.ranked
        if standings[stack].valuation is not None
    ]
    return table(["stack", "n", *titles, *further], rows)


def _line(results: Results, standing: Standing) -> list[str]:
    assert standing.valuation is not None
    shares = [interval_text(standing.interval(key), 3) for key in OUTCOMES]
    difference = results.differences.get((standing.condition, standing.stack))
    against = ["", ""]
    if difference is not None:
        paired = difference.paired
        against = [interval_text(paired.difference, 2), p_text(paired.p_holm)]
    chance = number_text(standing.valuation.risk.break_even_probability, 2)
    means = [
        number_text(standing.interval(key).value, decimals) for key, (_, decimals) in MEANS.items()
    ]
    rates = [interval_text(standing.interval(key), 0) for key in RATES]
    margin = interval_text(standing.interval(MARGIN), 2)
    return [*shares, margin, *against, chance, *means, *rates]


def _count(standing: Standing) -> str:
    if standing.side is None:
        return "–"
    errors = ""
    if standing.errors:
        errors = f", {standing.errors} errors"
    if standing.is_complete:
        return f"{standing.n}{errors}"
    return f"{standing.n} of {standing.declared}{errors}"


def write_quantities(results: Results, folder: Path) -> Path:
    """Write ``table.parquet``: a row for each quantity of each stack under each condition.

    Raises:
        InputError: it cannot be written.
    """
    path = folder / TABLE
    with writing(path):
        write_table(
            path, COLUMNS, [row for each in results.standings for row in _quantities(results, each)]
        )
    return path


def _quantities(results: Results, standing: Standing) -> Sequence[Row]:
    """Quantities with an interval, and terms of the money and the risk without one."""
    valuation = standing.valuation
    if valuation is None:
        return []
    where = {
        "map": Path(standing.condition.map_name).stem,
        "world": Path(standing.condition.world).stem,
        "pedestrians": standing.condition.pedestrians,
        "sensors": standing.condition.sensors and name_of(standing.condition.sensors),
        "stack": standing.stack,
    }
    risk, accounted = (
        valuation.risk,
        results.accounted.get((standing.condition, standing.stack), {}),
    )
    intervals: dict[str, Interval | None] = {
        **dict(sorted(valuation.intervals.items())),
        **{f"{MARGIN}_{name}": each for name, each in accounted.items() if name != PUBLISHED},
        "opex_cvar95_usd_per_run": risk.opex_cvar95_usd_per_run,
    }
    others = {
        **valuation.economics.as_json(),
        "break_even_probability": risk.break_even_probability,
    }
    rows = [
        {**where, "quantity": key, **each.as_json()}
        for key, each in intervals.items()
        if each is not None
    ]
    rows += [
        {**where, "quantity": key, "value": value, "n": standing.n}
        for key, value in others.items()
        if key not in valuation.intervals and value is not None
    ]
    return rows
