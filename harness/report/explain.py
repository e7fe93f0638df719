"""What ``navbench explain`` found."""

from collections.abc import Collection, Sequence
from pathlib import Path

from harness.economics.cost_terms import COST_LABELS, MARGIN
from harness.explain.activities import Activity
from harness.explain.decision_words import alternatives_at, gaps_to
from harness.explain.document import Explained, Saving, instant
from harness.explain.evidence import RECORDING, WEIGHTED, Evidence
from harness.explain.moments import COMPONENTS
from harness.explain.seconds import Seconds
from harness.explain.words import REASONS, is_same
from harness.metrics.columns import Row
from harness.report.blocks import Block, Chart, Table, Text, declared
from harness.report.numbers import UNDEFINED, counted, number_text
from harness.report.texts import TEXTS, notes
from navstack.control.decision import RUNNER_UP, SLOWER
from navstack.navigation_status import Status

COLUMNS = {RUNNER_UP: "second", SLOWER: "slower"}
REJECTED = "_rejected"  # end of the columns that count what a critic was the first to reject
TITLES = COST_LABELS | {MARGIN: "contribution margin", "opex": "all costs"}


def explanation_blocks(
    evidence: Evidence,
    moments: Sequence[Explained],
    saving: Saving | None,
    figures: Sequence[Path],
    activities: Sequence[Activity] = (),
) -> list[Block]:
    """Where the time went, each moment in words and as tables, and what a rewind had saved."""
    row = evidence.row
    source = "driven again; its row came out as stored"
    if evidence.source == RECORDING:
        source = "from its recording"
    mission = f"{row['stack']}, episode {row['episode']} of seed {row['seed']} on {row['map']}"
    end = f"{ending(row)}, {row['duration_s']:.1f} s"
    blocks: list[Block] = [Text(f"{mission}: {end}; {source}.", "heading")]
    if row.get("navigator_history"):
        blocks.append(Text(f"The navigator: {row['navigator_history']}.", "paragraph"))
    if activities:
        blocks += [Text(""), activities_table(activities)]
    for each in moments:
        blocks += [Text(""), Text(each.words, "paragraph")]
        if each.before is None or not is_same(each.before, each.seconds.moment):
            blocks += [Text(""), instants_table(each.seconds), _scores(each.seconds)]
    if saving is not None:
        blocks += saving_blocks(saving)
    return [*blocks, *map(Chart, figures)]


def activities_table(activities: Sequence[Activity]) -> Table:
    """Where the time of the delivery went."""
    rows = []
    for each in activities:
        place = f"{each.longest_s:.0f} s from {each.longest_since_s:.0f} s on at "
        place += f"({each.longest_x_m:.0f}, {each.longest_y_m:.0f})"
        numbers = (each.time_s, each.distance_m, each.progress_m)
        texts = [number_text(number, 0) for number in numbers]
        around = (each.people_near, each.ghost_tracks, each.street_width_m)
        texts += [number_text(number, 1) for number in around]
        rows.append((each.activity, *texts, place))
    return declared("activities", rows)


def instants_table(seconds: Seconds, shown: Collection[str] = ()) -> Table:
    """The seconds before an event, an instant in each row; ``shown``: in these columns only."""
    known = [instant(seconds, place) for place in seconds.instants()]
    columns = {
        key: each for key, each in TEXTS.instants.items() if key in (shown or TEXTS.instants)
    }
    rows = [
        [_text(values[key], column.decimals) for key, column in columns.items()] for values in known
    ]
    title = f"The {-seconds.at[0]:.1f} s before event {seconds.moment.number}"
    return Table(title, [column.title for column in columns.values()], rows, texts=0)


def _scores(seconds: Seconds) -> Table:
    """What each critic or term said in the telling cycle; no rows where none did."""
    row = seconds.telling or {}
    names = [
        key.removesuffix(WEIGHTED)
        for key, value in row.items()
        if key.endswith(WEIGHTED) and value is not None
    ]
    names += [
        key.removesuffix(REJECTED) for key, value in row.items() if key.endswith(REJECTED) and value
    ]
    if not names:
        return Table("", (), ())
    known = alternatives_at(seconds, row)
    others = {title: known[kind] for kind, title in COLUMNS.items() if kind in known}
    gaps = [gaps_to(row, other) for other in others.values()]
    rows: list[tuple[str, ...]] = []
    for name in dict.fromkeys(names):
        own = (_text(row.get(f"{name}_raw"), 3), _text(row.get(f"{name}{WEIGHTED}"), 3))
        more = (_text(each.get(name), 3) for each in gaps)
        rows.append((name, *own, *more, _text(row.get(f"{name}{REJECTED}"), 0)))
    sums = (_text(each.total - row["total_score"], 3) for each in others.values())
    speeds = (f"{each.command.linear_x:.2f}" for each in others.values())
    rows += [
        (),
        ("total", "", _text(row["total_score"], 3), *sums, _text(row["rejected"], 0)),
        ("speed [m/s]", "", _text(row["wanted_linear_x_mps"], 2), *speeds, ""),
    ]
    back = seconds.moment.stamp - row["stamp_s"]
    title = f"{row['decided_by']}, {back:.1f} s before event {seconds.moment.number}"
    columns = (f"{each}: +" for each in others)
    return Table(title, ("Critic or term", "raw", "weighted", *columns, "rejected"), rows)


def saving_blocks(saving: Saving) -> list[Block]:
    """What a rewind had saved."""
    rewound, stamp = saving.rewound, saving.rewound.take_over.stamp
    changes = ", ".join(
        f"{each.place.path} {each.place.value} -> {each.value}" for each in rewound.changes
    )
    when = f"{saving.moment.stamp - stamp:.1f} s before event {saving.moment.number}"
    ends = f"{_ended(saving.stored)} becomes {_ended(rewound.delivery.row)}"
    effect = _effect(saving.difference(MARGIN))
    rows = []
    for name in COMPONENTS:
        values = (saving.costs[name], saving.new_costs[name], saving.difference(name))
        rows.append((TITLES.get(name, name), *map(number_text, values)))
    return [
        Text(
            f"Rewound to {stamp:.1f} s, {when}, with {changes}: {ends}; that {effect}.", "paragraph"
        ),
        Text(""),
        declared("rewind", rows),
        *(Text(note, "paragraph") for note in (_handed_over(saving), *notes("rewind"))),
    ]


def _effect(saved: float | None) -> str:
    """What a better margin by so much [USD] comes to; None: the cargo is not modelled."""
    if saved is None:
        return "cannot be priced without cargo"
    if saved == 0.0:
        return "changes nothing"
    if saved > 0.0:
        return f"saves {saved:.2f} USD"
    return f"costs {-saved:.2f} USD"


def ending(row: Row) -> str:
    """How a delivery ended, and why where that is not the same."""
    outcome = str(TEXTS.outcomes.get(row["outcome"], row["outcome"]))
    why = REASONS.get(row["reason"], row["reason"])
    if why in (row["outcome"], "arrived"):
        return outcome
    return f"{outcome} ({why})"


def _ended(row: Row) -> str:
    contacts = ""
    if people := row["pedestrian_contacts"]:
        contacts = f", {counted(people, 'counted contact')} with people"
    outcome = TEXTS.outcomes.get(row["outcome"], row["outcome"])
    return f"{outcome} ({row['duration_s']:.1f} s{contacts})"


def _handed_over(saving: Saving) -> str:
    over = saving.rewound.take_over
    text = (
        f"When it took over it commanded {over.after.linear_x:.2f} m/s, "
        f"{over.after.angular_z:+.2f} rad/s where the unchanged brain would have commanded "
        f"{over.before.linear_x:.2f} m/s, {over.before.angular_z:+.2f} rad/s."
    )
    if over.recoveries:
        text += f" It had begun {over.recoveries} recoveries that nobody drove."
    if over.status is not Status.RUNNING:
        text += f" Its navigation had already {over.status.value}."
    return text


def _text(value: float | str | None, decimals: int) -> str:
    if value is None or isinstance(value, str):
        return value or UNDEFINED
    return number_text(value, decimals)
