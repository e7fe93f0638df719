"""What deliveries prove, in sentences, and what would decide where they prove nothing."""

import shlex
from collections.abc import Sequence

from harness.analysis.compare import Side, compare, have_common_missions
from harness.analysis.rare import margin_with_unseen
from harness.economics.cost_terms import MARGIN
from harness.report.numbers import bounds_text, interval_text, p_text
from harness.statistics.interval import Interval, fewest_missions
from harness.statistics.paired import PairedDifference, together
from harness.study.stored_run import StoredRun

# a stack's name, its deliveries and its margin [USD/run], if it is defined
Party = tuple[str, Side, Interval | None]

PROGRAM, MODULE = ["navbench"], ["python", "navbench/__main__.py"]  # as run.json has them
REPEATABLE = ("run", "ablate", "tune")  # commands
NOT_REPEATED = ("--episodes", "--only", "--out")  # options with a value


def earnings(parties: Sequence[Party]) -> list[str]:
    """A sentence for each stack with a margin: whether it is significantly positive."""
    return [
        f"{name}: {_earning(margin, margin_with_unseen(side.run, side.stack))}"
        for name, side, margin in _known(parties)
    ]


def rankings(parties: Sequence[Party]) -> list[str]:
    """A sentence for the best stack against each that drove missions of it.

    Differences are paired by mission and tested together (Holm).
    """
    known = sorted(_known(parties), key=lambda each: -each[2].value)  # type: ignore[operator]
    others = [
        (name, side) for name, side, _ in known[1:] if have_common_missions(known[0][1], side)
    ]
    found = [compare(side, known[0][1], [MARGIN]) for _, side in others]
    pairs = together([each.differences[MARGIN].paired for each in found])
    lines = []
    for (name, _), each, pair in zip(others, found, pairs, strict=True):
        span = interval_text(pair.difference)
        told = f"{span} USD a delivery over {pair.difference.n} missions, p {p_text(pair.p_holm)}"
        if pair.is_significant:
            line = f"{known[0][0]} earns more than {name}: {told}{_doubt(each.unseen)}"
        else:
            more = undecided(pair, each.first.run, each.second.run)
            line = f"These deliveries cannot rank {known[0][0]} and {name}: {told}{more}"
        lines.append(line)
    return lines


def undecided(pair: PairedDifference, *runs: StoredRun) -> str:
    """What would decide a difference that is not significant, with the commands that drive it."""
    n, text = pair.difference.n, ""
    needed = pair.needed
    if pair.missions < pair.fewest:
        text = f"; fewer than {pair.fewest} missions decide nothing"
        needed = needed or pair.fewest
    if needed is None:
        return text
    text += f"; about {needed:,d} missions would decide, {needed - n:,d} more"
    commands = list(dict.fromkeys(repeated(run, needed) for run in runs))
    if not commands or "" in commands:
        return text
    return f"{text}: {' && '.join(commands)}"


def repeated(run: StoredRun, episodes: int) -> str:
    """The command that drives a run again with so many deliveries.

    Empty: it has not been driven by a command that could.
    """
    return again(run.about.get("command", ()), episodes)


def again(command: Sequence[str], episodes: int) -> str:
    """A command as ``run.json`` has it with so many deliveries; empty: it drives none."""
    words = list(command)
    if words[:2] == MODULE:
        words = [*PROGRAM, *words[2:]]
    if len(words) < 2 or words[:1] != PROGRAM or words[1] not in REPEATABLE:
        return ""
    kept, left = words[:2], words[2:]
    while left:
        word = left.pop(0)
        if word in NOT_REPEATED:
            left = left[1:]
        elif word.partition("=")[0] not in NOT_REPEATED:
            kept.append(word)
    return shlex.join([*kept, "--episodes", str(episodes)])


def _known(parties: Sequence[Party]) -> list[tuple[str, Side, Interval]]:
    return [
        (name, side, margin)
        for name, side, margin in parties
        if margin is not None and margin.value is not None
    ]


def _earning(margin: Interval, unseen: Interval | None) -> str:
    text = f"{interval_text(margin, 2)} USD a delivery (n = {margin.n})"
    if margin.n < fewest_missions():
        return f"{text}: fewer than {fewest_missions()} deliveries decide nothing"
    if margin.low is None or margin.high is None:
        return f"{text}, all alike{_doubt(unseen)}"
    if margin.sign > 0:
        return f"{text}: it earns money{_doubt(unseen)}"
    if margin.sign < 0 and (unseen is None or unseen.high is None or unseen.high < 0.0):
        return f"{text}: it loses money"
    return f"{text}: these deliveries do not tell whether it earns"


def _doubt(unseen: Interval | None) -> str:
    """What an unseen loss makes of a gain; empty: it stays one."""
    if unseen is None or unseen.low is None or unseen.low > 0.0:
        return ""
    return f"; an unseen loss could undo that: {bounds_text(unseen)}"
