"""What ``navbench explain`` found, in at most 25 lines: the costliest event, the others by name."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path

from harness.explain.activities import Activity
from harness.explain.document import Explained, Saving
from harness.explain.evidence import RECORDING, Evidence
from harness.explain.moments import ASSISTANCE, TIMEOUT, costliest
from harness.explain.seconds import A_SECOND, STEP
from harness.report.blocks import Block, Chart, Text, declared
from harness.report.explain import (
    activities_table,
    ending,
    instants_table,
    saving_blocks,
)

HELD_UP = (ASSISTANCE, TIMEOUT)  # what comes of standing: the navigator tells why it stood
FIRST_STEPS, LAST_STEPS = 6, 2  # of the navigator's history that are told
MOST_EVENTS = 4  # others that are named
MOST_INSTANTS = 6  # rows of the table
SPENT = (0, 1, 3, 4, 7)  # columns of the activities, which fit into 80 characters
INSTANT = (  # columns of the table, likewise
    *("time_to_event_s", "speed_mps", "command_linear_x_mps", "command_angular_z_radps"),
    *("decided_by", "distance_m", "position_error_m"),
)


def short_explanation(
    evidence: Evidence,
    moments: Sequence[Explained],
    saving: Saving | None,
    figures: Sequence[Path],
    activities: Sequence[Activity] = (),
) -> list[Block]:
    """The costliest event in words and as a short table, and what a rewind had saved.

    The table of a delivery that was late says where all its time went.

    Args:
        evidence: the delivery.
        moments: its events that cost something, at least one.
        saving: by a rewind; None: none was asked for.
        figures: files that were drawn.
        activities: where the time went.
    """
    row, source = evidence.row, "driven again as it was"
    if evidence.source == RECORDING:
        source = "from its recording"
    head = Text(f"{ending(row)} after {row['duration_s']:.1f} s; {source}", "heading")
    dear = costliest([each.seconds.moment for each in moments])
    (told,) = (each for each in moments if each.seconds.moment is dear)
    others = [each for each in moments if each is not told]
    blocks: list[Block] = [head, Text(told.words, "paragraph")]
    if row.get("navigator_history") and dear.kind in HELD_UP:
        history = _cut(row["navigator_history"])
        blocks.append(Text(f"The navigator before: {history}.", "paragraph"))
    for each in others[:MOST_EVENTS]:
        what = each.words.split(". ")[0].replace("Event", "event", 1)
        blocks.append(Text(f"Also {what}.", "whole"))
    if len(others) > MOST_EVENTS:
        blocks.append(Text(f"and {len(others) - MOST_EVENTS} more events: --full"))
    table = instants_table(told.seconds, INSTANT)
    if dear.kind == TIMEOUT and activities:
        full = activities_table(activities)
        rows = [[row[place] for place in SPENT] for row in full.rows]
        blocks.append(declared("time_spent", rows))
    else:
        blocks.append(dataclasses.replace(table, rows=_few(table.rows)))
    if saving is not None:
        blocks += saving_blocks(saving)
    return [*blocks, *map(Chart, figures)]


def _cut(history: str) -> str:
    """The navigator's history without its middle, which repeats what its beginning says."""
    steps = history.split("; ")
    left_out = len(steps) - FIRST_STEPS - LAST_STEPS
    if left_out < 2:
        return history
    kept = [*steps[:FIRST_STEPS], f"{left_out} more of the kind", *steps[-LAST_STEPS:]]
    return "; ".join(kept)


def _few(rows: Sequence[Sequence[str]]) -> list[Sequence[str]]:
    """Rows at equal distances that end with the event, and that of a second before it.

    The words tell how the command changed within this second.
    """
    last = len(rows) - 1
    step = -(-len(rows) // MOST_INSTANTS)
    kept = set(range(last, -1, -step))
    if len(rows) > A_SECOND / STEP:
        kept.add(last - round(A_SECOND / STEP))
    return [rows[place] for place in sorted(kept)]
