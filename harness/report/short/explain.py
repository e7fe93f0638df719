"""What ``navbench explain`` found, in at most 25 lines: the costliest event, the others by name."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path

from harness.explain.activities import Activity
from harness.explain.document import Explained, Saving
from harness.explain.evidence import Evidence
from harness.explain.moments import TIMEOUT, costliest
from harness.report.blocks import Block, Chart, Text
from harness.report.explain import (
    activities_table,
    explanation_blocks,
    instants_table,
    saving_blocks,
)

MOST_EVENTS = 4  # others that are named
MOST_INSTANTS = 6  # rows of the table


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
    head = explanation_blocks(evidence, (), None, ())[0]
    dear = costliest([each.seconds.moment for each in moments])
    (told,) = (each for each in moments if each.seconds.moment is dear)
    others = [each for each in moments if each is not told]
    blocks = [head, Text(told.words, "paragraph")]
    blocks += [Text(f"Also {each.words.split('. ')[0]}.", "whole") for each in others[:MOST_EVENTS]]
    if len(others) > MOST_EVENTS:
        blocks.append(Text(f"and {len(others) - MOST_EVENTS} more events: --full"))
    table = instants_table(told.seconds)
    step = -(-len(table.rows) // MOST_INSTANTS)
    if dear.kind == TIMEOUT and activities:
        blocks.append(activities_table(activities))
    else:
        blocks.append(dataclasses.replace(table, rows=table.rows[::-1][::step][::-1]))
    if saving is not None:
        blocks += saving_blocks(saving)
    return [*blocks, *map(Chart, figures)]
