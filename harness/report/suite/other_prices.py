"""What a suite comes to at other prices.

Who is ahead in which price set, and who earns under which injury curve.
"""

from collections.abc import Mapping
from importlib.resources import files
from itertools import combinations
from string import Template

from harness.analysis.price_sets import CURVES, Money, Parts, money_of, order, under_curves
from harness.analysis.repricing import Choices, choose
from harness.economics.contact_limits import beyond_limit, limit_speed
from harness.economics.prices import price_sets
from harness.report.markdown import table
from harness.report.numbers import interval_text
from harness.report.suite.results import Results
from harness.statistics.interval import Interval, wilson_interval

MOST_NAMED = 6  # pairs of stacks that change places


def template(name: str) -> Template:
    """A text of the page with gaps for tables and numbers, a file of this folder."""
    return Template((files("harness.report.suite") / name).read_text(encoding="utf-8"))


def at_other_prices(results: Results) -> str:
    """The section of the page.

    Empty as long as no stack has driven under every condition, with cargo.
    """
    parts = {stack: own for stack in results.ranked if (own := _parts(results, stack))}
    if not parts:
        return ""
    first = next(iter(parts.values()))[0][0]
    sets = {name: choose(first, name, {}, ()) for name in price_sets()}
    money = {
        name: {stack: money_of(own, choices) for stack, own in parts.items()}
        for name, choices in sets.items()
    }
    if any(each.margin.value is None for own in money.values() for each in own.values()):
        return ""
    curves = {stack: under_curves(own) for stack, own in parts.items()}
    return template("prices.md").substitute(
        meant="; ".join(_meant(name, choices) for name, choices in sets.items()),
        sets=_sets_table(money),
        moves="\n".join(_moves(money, name) for name in price_sets()[1:]),
        limit=f"{limit_speed(first.prices()):.2f} m/s",
        curves=_curves_table(parts, curves),
        earners="\n".join(_earners(curves, name) for name in CURVES),
    )


def _parts(results: Results, stack: str) -> Parts:
    """A stack in all of its runs.

    Nothing unless it has finished deliveries under every condition.
    """
    own = [each for each in results.standings if each.stack == stack]
    if any(each.n == 0 for each in own):
        return []
    return [(run, run.stacks[0]) for each in own for run in each.runs if run.stacks[0].rows]


def _meant(name: str, choices: Choices) -> str:
    terms = ""
    if choices.optional.names:
        terms = f" with {' and '.join(choices.optional.names)}"
    return f"`{name}` {choices.prices.accounting}{terms}"


def _sets_table(money: Mapping[str, Mapping[str, Money]]) -> str:
    places = {name: order(own) for name, own in money.items()}
    rows = [
        [
            f"`{stack}`",
            *(
                f"{places[name].index(stack) + 1}. {interval_text(own[stack].profit)}"
                for name, own in money.items()
            ),
        ]
        for stack in next(iter(money.values()))
    ]
    return table(["stack", *(f"`{name}`" for name in money)], rows)


def _moves(money: Mapping[str, Mapping[str, Money]], name: str) -> str:
    """Which pairs of stacks stand the other way round than at the published prices."""
    published = price_sets()[0]
    pairs, after = list(combinations(order(money[published]), 2)), order(money[name])
    turned = [(a, b) for a, b in pairs if after.index(a) > after.index(b)]
    if not turned:
        return f"- `{name}`: the order of `{published}`"
    named = ", ".join(f"`{b}` before `{a}`" for a, b in turned[:MOST_NAMED])
    more = ""
    if len(turned) > MOST_NAMED:
        more = f" and {len(turned) - MOST_NAMED} more"
    counted = f"{len(turned)} of {len(pairs)} pairs of stacks change places against `{published}`"
    return f"- `{name}`: {counted}: {named}{more}"


def _curves_table(parts: Mapping[str, Parts], curves: Mapping[str, Mapping[str, Interval]]) -> str:
    rows = [
        [f"`{stack}`", *(_earned(own[name]) for name in CURVES), _beyond(parts[stack])]
        for stack, own in curves.items()
    ]
    return table(["stack", *CURVES, "ISO/TS 15066"], rows)


def _earned(margin: Interval) -> str:
    text = interval_text(margin)
    if earns(margin):
        return f"**{text}**"
    return text


def earns(margin: Interval) -> bool:
    """Whether it is significantly positive."""
    return margin.sign > 0


def _earners(curves: Mapping[str, Mapping[str, Interval]], name: str) -> str:
    found = [f"`{stack}`" for stack, own in curves.items() if earns(own[name])]
    named = ""
    if found:
        named = f": {', '.join(found)}"
    return f"- {name}: {len(found)} of {len(curves)} stacks earn money{named}"


def _beyond(parts: Parts) -> str:
    """Contacts beyond the limit, of how many."""
    found = [beyond_limit(stack.rows, run.events, run.prices()) for run, stack in parts]
    count = sum(round((each.value or 0.0) * each.n) for each in found)
    share = wilson_interval(count, sum(each.n for each in found))
    return f"{count} of {share.n}, {interval_text(share)}"
