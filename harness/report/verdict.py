"""What a run proves, in sentences.

Whether each stack earns money, and whether the best is told from the others.
"""

from collections.abc import Sequence

from harness.analysis.compare import Side, compare, have_common_missions
from harness.analysis.rare import margin_with_unseen
from harness.economics.cost_terms import MARGIN
from harness.report.numbers import bounds_text, interval_text, p_text
from harness.statistics.interval import Interval
from harness.statistics.paired import SURE, holm

# a stack's name, its deliveries and its margin [USD/run], if it is defined
Party = tuple[str, Side, Interval | None]


def earnings(parties: Sequence[Party]) -> list[str]:
    """A sentence for each stack with a margin: whether it surely earns money."""
    return [
        f"{name}: {_earning(margin, margin_with_unseen(side.run, side.stack))}"
        for name, side, margin in _known(parties)
    ]


def rankings(parties: Sequence[Party]) -> list[str]:
    """A sentence for the best stack against each that drove missions of it.

    Whether it surely earns more.

    Differences are paired by mission; their p values are adjusted together (Holm).
    """
    known = sorted(_known(parties), key=lambda each: -each[2].value)  # type: ignore[operator]
    others = [
        (name, side) for name, side, _ in known[1:] if have_common_missions(known[0][1], side)
    ]
    found = [compare(side, known[0][1], [MARGIN]) for _, side in others]
    pairs = [each.differences[MARGIN].paired.in_family(len(found)) for each in found]
    lines = []
    adjusted = holm([pair.p for pair in pairs])
    for (name, _), each, pair, p in zip(others, found, pairs, adjusted, strict=True):
        n = pair.difference.n
        span = f"{interval_text(pair.difference)} USD a delivery over {n} missions, p {p_text(p)}"
        if p < SURE:
            lines.append(f"{known[0][0]} earns more than {name}: {span}{_doubt(each.unseen)}")
        else:
            needed = ""
            if pair.needed:
                needed = f"; about {pair.needed:,d} would"
            lines.append(f"These deliveries cannot rank {known[0][0]} and {name}: {span}{needed}")
    return lines


def _known(parties: Sequence[Party]) -> list[tuple[str, Side, Interval]]:
    return [
        (name, side, margin)
        for name, side, margin in parties
        if margin is not None and margin.value is not None
    ]


def _earning(margin: Interval, unseen: Interval | None) -> str:
    text = f"{interval_text(margin, 2)} USD a delivery (n = {margin.n})"
    if margin.low is None or margin.high is None:
        return f"{text}, the same each time{_doubt(unseen)}"
    if margin.low > 0.0:
        return f"{text}: it earns money{_doubt(unseen)}"
    surely_loses = margin.high < 0.0 and (
        unseen is None or unseen.high is None or unseen.high < 0.0
    )
    if surely_loses:
        return f"{text}: it loses money"
    return f"{text}: these deliveries do not tell whether it earns"


def _doubt(unseen: Interval | None) -> str:
    """What a loss that has not happened yet makes of a gain; empty: it stays one."""
    if unseen is None or unseen.low is None or unseen.low > 0.0:
        return ""
    return f"; a loss that has not happened yet could undo that: {bounds_text(unseen)}"
