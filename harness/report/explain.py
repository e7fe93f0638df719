"""The printed result of ``navbench explain``."""

import textwrap
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.text import Text

from harness.economics.cost_terms import COST_LABELS
from harness.explain.document import Explained, Saving, instant
from harness.explain.evidence import WEIGHTED, Evidence
from harness.explain.moments import COMPONENTS
from harness.explain.seconds import Seconds
from harness.explain.words import alternatives_at, gaps_to, is_same
from harness.metrics.columns import Row
from harness.report.markdown import number_text
from harness.report.sheet import Sheet, declared, print_sheet
from harness.report.texts import TEXTS, notes
from navstack.control.decision import RUNNER_UP, SLOWER

WORDS_WIDTH = 100  # [characters]
TITLES = COST_LABELS | {"contribution_margin": "contribution margin", "opex": "all costs"}


def print_explanation(
    evidence: Evidence,
    told: Sequence[Explained],
    saving: Saving | None,
    figures: Sequence[Path],
    console: Console,
) -> None:
    """Print each moment in words and as tables, and what a rewind had saved."""
    row = evidence.row
    head = f"{row['stack']}, episode {row['episode']} of seed {row['seed']} on {row['map']}: {row['outcome']}"
    source = (
        "from its recording"
        if evidence.source == "recording"
        else "driven again; its row came out as stored"
    )
    console.print(
        Text(f"{head} ({row['reason']}), {row['duration_s']:.1f} s; {source}.", style="bold")
    )
    if row.get("navigator_history"):
        _print_words(f"The navigator: {row['navigator_history']}.", console)
    for each in told:
        console.print()
        _print_words(each.words, console)
        if each.before is not None and is_same(each.before, each.seconds.moment):
            continue
        console.print()
        print_sheet(_instants(each.seconds), console)
        print_sheet(_scores(each.seconds), console)
    if saving is not None:
        _print_saving(saving, console)
    for figure in figures:
        console.print(f"figure: {figure}", soft_wrap=True)


def _print_words(words: str, console: Console) -> None:
    for line in textwrap.wrap(words, WORDS_WIDTH, break_long_words=False, break_on_hyphens=False):
        console.print(Text(line), soft_wrap=True)


def _instants(seconds: Seconds) -> Sheet:
    told = [instant(seconds, place) for place in seconds.instants()]
    columns = TEXTS.instants
    rows = [
        [_text(values[key], column.decimals) for key, column in columns.items()] for values in told
    ]
    title = f"The {-seconds.at[0]:.1f} s before event {seconds.moment.number}"
    return Sheet(title, [column.title for column in columns.values()], rows, texts=0)


def _scores(seconds: Seconds) -> Sheet:
    """What each critic or term said in the telling cycle; no rows: there is nothing to tell."""
    row = seconds.telling or {}
    names = [
        key.removesuffix(WEIGHTED)
        for key, value in row.items()
        if key.endswith(WEIGHTED) and value is not None
    ]
    names += [
        key.removesuffix("_rejected")
        for key, value in row.items()
        if key.endswith("_rejected") and value
    ]
    if not names:
        return Sheet("", (), ())
    others = alternatives_at(seconds, row)
    kinds = [
        (kind, title)
        for kind, title in ((RUNNER_UP, "second"), (SLOWER, "slower"))
        if kind in others
    ]
    gaps = {kind: gaps_to(row, others[kind]) for kind, _ in kinds}
    rows: list[tuple[str, ...]] = []
    for name in dict.fromkeys(names):
        own = (_text(row.get(f"{name}_raw"), 3), _text(row.get(f"{name}{WEIGHTED}"), 3))
        more = (_text(gaps[kind].get(name), 3) for kind, _ in kinds)
        rows.append((name, *own, *more, _text(row.get(f"{name}_rejected"), 0)))
    sums = (_text(others[kind].total - row["total_score"], 3) for kind, _ in kinds)
    speeds = (f"{others[kind].command.linear_x:.2f}" for kind, _ in kinds)
    rows += [
        (),
        ("total", "", _text(row["total_score"], 3), *sums, _text(row["rejected"], 0)),
        ("speed [m/s]", "", _text(row["wanted_linear_x_mps"], 2), *speeds, ""),
    ]
    back = seconds.moment.stamp - row["stamp_s"]
    headers = (
        "Critic or term",
        "raw",
        "weighted",
        *(f"{title}: +" for _, title in kinds),
        "illegal",
    )
    return Sheet(
        f"{row['decided_by']}, {back:.1f} s before event {seconds.moment.number}", headers, rows
    )


def _print_saving(saving: Saving, console: Console) -> None:
    rewound, row = saving.rewound, saving.rewound.delivery.row
    changes = ", ".join(
        f"{each.place.path} {each.place.value} -> {each.value}" for each in rewound.changes
    )
    when = (
        f"{saving.moment.stamp - rewound.take_over.stamp:.1f} s before event {saving.moment.number}"
    )
    saved = saving.difference("contribution_margin")  # by how much the margin is better [USD]
    effect = "cannot be priced without cargo"
    if saved is not None:
        effect = (
            "changes nothing"
            if saved == 0.0
            else f"{'saves' if saved > 0.0 else 'costs'} {abs(saved):.2f} USD"
        )
    _print_words(
        f"Rewound to {rewound.take_over.stamp:.1f} s, {when}, with {changes}: {_ended(saving.stored)} becomes "
        f"{_ended(row)}; that {effect}.",
        console,
    )
    rows = []
    for name in COMPONENTS:
        values = (saving.costs[name], saving.new_costs[name], saving.difference(name))
        rows.append((TITLES.get(name, name), *map(number_text, values)))
    console.print()
    print_sheet(declared("rewind", rows), console)
    for note in (_handed_over(saving), *notes("rewind")):
        _print_words(note, console)


def _ended(row: Row) -> str:
    people = row["pedestrian_contacts"]
    contacts = (
        f", {people} counted contact{'s' if people > 1 else ''} with people" if people else ""
    )
    return f"{row['outcome']} ({row['duration_s']:.1f} s{contacts})"


def _handed_over(saving: Saving) -> str:
    over = saving.rewound.take_over
    meant = (
        f" It had begun {over.recoveries} recoveries that nobody drove." if over.recoveries else ""
    )
    ended = (
        f" Its navigation had already {over.status.value}."
        if over.status.value != "running"
        else ""
    )
    return (
        f"When it took over it commanded {over.after.linear_x:.2f} m/s, {over.after.angular_z:+.2f} rad/s where the "
        f"unchanged brain would have commanded {over.before.linear_x:.2f} m/s, {over.before.angular_z:+.2f} rad/s."
        f"{meant}{ended}"
    )


def _text(value: float | str | None, decimals: int) -> str:
    if value is None or isinstance(value, str):
        return value or "--"
    return number_text(value, decimals)
