"""What deliveries prove, in sentences, and what would decide where they prove nothing."""

import shlex
from collections.abc import Sequence
from pathlib import Path

from harness.analysis.compare import Comparison, compare
from harness.analysis.family import as_one_family
from harness.analysis.pairing import have_common_missions
from harness.analysis.rare import (
    deliveries_that_prove,
    margin_with_unseen,
    missions_that_exclude,
)
from harness.analysis.side import Side
from harness.economics.cost_terms import MARGIN
from harness.economics.valuation import CENT
from harness.report.numbers import all_of, counted, interval_text, number_text, p_text
from harness.statistics.interval import Interval, admitting, fewest_missions
from harness.statistics.paired import PairedDifference, needed_for
from harness.study.stored_run import StoredRun

# a stack's name, its deliveries and its margin [USD/run], if it is defined
Party = tuple[str, Side, Interval | None]

PROGRAM, MODULE = ["navbench"], ["python", "navbench/__main__.py"]  # as run.json has them
REPEATABLE = ("run", "ablate", "tune")  # commands
LENGTHENED = ("run", "ablate")  # whose --resume takes more --episodes
NOT_REPEATED = ("--episodes", "--only", "--out")  # options with a value
FEW = 20  # missions below which it is hardly known how many would decide
MOST = 10_000  # missions beyond which it is only said that more would be needed
DOUBT = "; an unseen loss could undo that"
WORTH_FINDING = 1.0  # [USD/delivery] of a difference: what is smaller counts as none


def earnings(parties: Sequence[Party]) -> list[str]:
    """A sentence for each stack with a margin: whether it is significantly positive."""
    return [
        f"{name}: {_earning(side, margin, margin_with_unseen(side.run, side.stack))}"
        for name, side, margin in _known(parties)
    ]


def rankings(parties: Sequence[Party]) -> list[str]:
    """A sentence for the best stack against each that drove missions of it.

    The margin alone decides: differences are paired by mission and tested together (Holm), with
    those of all other pairs, as the data say which is the best.
    """
    known = sorted(_known(parties), key=lambda each: -each[2].value)  # type: ignore[operator]
    others = [
        (name, side) for name, side, _ in known[1:] if have_common_missions(known[0][1], side)
    ]
    if not others:
        return []
    found = [compare(side, known[0][1], [MARGIN]) for _, side in others]
    family = as_one_family(found, [side for _, side, _ in known])
    best, _, margin = known[0]
    lines = []
    for (name, _), each, pair in zip(others, found, family.pairs, strict=True):
        if not pair.differs:
            lines.append(_alike(f"{best} and {name}", margin, each))
            continue
        span = admitting(pair.difference, each.unseen)
        told = f"{interval_text(span)} USD a delivery more over {counted(span.n, 'mission')}, p "
        told += p_text(pair.p_holm)
        if family.size > 1:
            told += f" adjusted for {family.size} comparisons"
        if pair.is_significant and span.low is not None and span.low <= 0.0:
            line = f"{best} earned more than {name} on these missions: {told}{DOUBT}"
        elif pair.is_significant:
            line = f"{best} earns more than {name}: {told}"
        else:
            more = undecided(pair, each.first.run, each.second.run)
            line = f"These deliveries cannot rank {best} and {name}: {best} earned {told}{more}"
        lines.append(line)
    return lines


def _alike(both: str, margin: Interval, comparison: Comparison) -> str:
    """Two stacks that earn the same on every mission: what that excludes, and what would more."""
    first, second = comparison.first.run, comparison.second.run
    earned = f"{number_text(margin.value)} USD a delivery"
    if margin.value is not None and margin.value > first.prices().delivery_fee.value - CENT:
        earned += ", the whole fee"
    text = f"{both} earn the same on {all_of(comparison.pairs, 'mission')}: {earned}"
    unseen = comparison.unseen
    if unseen is None or unseen.high is None or unseen.high <= WORTH_FINDING:
        return text
    text += f". Unseen losses leave a difference of up to {unseen.high:.2f} USD possible (95 %)"
    needed = missions_that_exclude(WORTH_FINDING, first, second)
    return text + _more(
        f"; about {needed:,d} missions without a loss would leave less than {WORTH_FINDING:g} USD, "
        f"{needed - comparison.pairs:,d} more",
        needed,
        first,
        second,
    )


def undecided(pair: PairedDifference, *runs: StoredRun) -> str:
    """What would decide a difference that is not significant, with the commands that drive it."""
    n, text = pair.difference.n, ""
    needed = pair.needed
    if pair.missions < pair.fewest:
        text = f"; fewer than {pair.fewest} missions decide nothing"
        needed = needed or pair.fewest
    if needed is None:
        return text
    if needed > MOST:
        return f"; more than {MOST:,d} missions would be needed"
    guess = ""
    if pair.fewest <= pair.missions < FEW:
        guess = ", a guess by so few"
    text += f"; about {needed:,d} missions would decide{guess}, {needed - n:,d} more"
    return _more(text, needed, *runs)


def _more(text: str, needed: int, *runs: StoredRun) -> str:
    """A text with the commands that drive so many deliveries, where there are such."""
    commands = list(dict.fromkeys(repeated(run, needed) for run in runs))
    if not commands or "" in commands:
        return text
    return "\n  ".join([f"{text}:", *commands])


def repeated(run: StoredRun, episodes: int) -> str:
    """The command that drives a run with so many deliveries.

    In its own folder, whose deliveries stay, where the folder can go on. Empty: it is not
    finished, or has not been driven by a command that could.
    """
    if not run.is_whole:
        return ""
    command = again(run.about.get("command", ()), episodes)
    if not command or not can_go_on(run):
        return command
    _, word, *_ = shlex.split(command)
    if word not in LENGTHENED:
        return command
    return going_on(word, run.folder, episodes)


def can_go_on(run: StoredRun) -> bool:
    """Whether a run's folder can take further deliveries: it is neither packed nor a selection."""
    return (run.folder / "params").is_dir() and not run.about.get("only")


def going_on(command: str, folder: Path, episodes: int) -> str:
    """The command that drives what a folder lacks of so many deliveries a stack."""
    return shlex.join([*PROGRAM, command, "--resume", str(folder), "--episodes", str(episodes)])


def again(command: Sequence[str], episodes: int, budget: str = "") -> str:
    """A command as ``run.json`` has it with so many deliveries; empty: it drives none.

    Args:
        command: its words.
        episodes: in place of those that it had.
        budget: likewise; empty: its own.
    """
    words = list(command)
    if words[:2] == MODULE:
        words = [*PROGRAM, *words[2:]]
    if len(words) < 2 or words[:1] != PROGRAM or words[1] not in REPEATABLE:
        return ""
    replaced: tuple[str, ...] = NOT_REPEATED
    added = ["--episodes", str(episodes)]
    if budget:
        replaced = (*NOT_REPEATED, "--budget")
        added += ["--budget", budget]
    return shlex.join([*without(words, replaced), *added])


def without(command: Sequence[str], options: Sequence[str]) -> list[str]:
    """A command's words without some options, each of which has a value."""
    kept, left = [], list(command)
    while left:
        word = left.pop(0)
        if word in options:
            left = left[1:]
        elif word.partition("=")[0] not in options:
            kept.append(word)
    return kept


def value_of(command: Sequence[str], option: str) -> str:
    """What a command's words give for an option; empty: it is not among them."""
    for word, following in zip(command, [*command[1:], ""], strict=True):
        if word == option:
            return following
        if word.startswith(f"{option}="):
            return word.partition("=")[2]
    return ""


def _known(parties: Sequence[Party]) -> list[tuple[str, Side, Interval]]:
    return [
        (name, side, margin)
        for name, side, margin in parties
        if margin is not None and margin.value is not None
    ]


def _earning(side: Side, margin: Interval, unseen: Interval | None) -> str:
    run, fewest, span = side.run, fewest_missions(), unseen or margin
    text = f"{interval_text(span, 2)} USD a delivery (n = {margin.n})"
    if margin.n < fewest:
        return _more(f"{text}: fewer than {fewest} deliveries decide nothing", fewest, run)
    if span.sign:
        return f"{text}: it {'earns' if span.sign > 0 else 'loses'} money"
    if margin.low is None or margin.high is None:
        text += f": all earned {number_text(margin.value)}"
        needed = deliveries_that_prove(margin, run)
        if needed is None:
            return text
        more = f"{DOUBT}; about {needed:,d} deliveries without a loss would show that it earns"
        return _more(text + more, needed, run)
    if margin.sign > 0:
        return f"{text}: it earned money on these missions{DOUBT}"
    text += ": these deliveries do not tell whether it earns"
    needed = needed_for(margin)
    if needed is None or needed <= margin.n:
        return text
    if needed > MOST:
        return f"{text}; more than {MOST:,d} would be needed"
    more = f"; about {needed:,d} would decide, {needed - margin.n:,d} more"
    return _more(text + more, needed, run)
