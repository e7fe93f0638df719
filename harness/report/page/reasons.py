"""Why a recorded delivery cost what it cost, in the words of ``navbench explain``."""

import dataclasses
from collections.abc import Mapping
from typing import Any

from harness.metrics.columns import Row
from harness.report.page.deliveries import rounded
from harness.report.page.entries import Entry
from harness.world.outcome import Rules
from navstack.errors import InputError
from navstack.params.strict import load_dataclass

BEFORE = 5.0  # [s] shown before each event


def reasons_of(entry: Entry, row: Row, arrays: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Each event of a delivery that cost something, in order of time: when [s], cost [USD] and words.

    Args:
        entry: whose delivery it is.
        row: of ``episodes.parquet``.
        arrays: its recording.

    Returns:
        Times rounded as those of contacts. Nothing where no event cost anything.
    """
    # what explains can also drive a delivery again: simulator and brain are imported only where there is a recording
    from harness.explain.document import explained
    from harness.explain.evidence import decisions_file, events_of, recorded
    from harness.explain.moments import is_costly, moments_of
    from harness.explain.seconds import seconds_before

    run, episode = dataclasses.replace(entry.run, stacks=(entry.stack,)), row["episode"]
    needed = (decisions_file(run, episode), run.folder / "params" / f"{entry.stack.name}-robot.yaml")
    if not is_costly(row, events_of(run, episode)) or not all(file.is_file() for file in needed):
        return []
    try:
        evidence = recorded(run, episode, arrays)
        moments = moments_of(evidence, load_dataclass(Rules, run.folder / "params" / "rules.yaml"), entry.prices)
        told = explained(evidence, [seconds_before(evidence, moment, BEFORE) for moment in moments])
    except InputError:  # a damaged table of decisions, or a delivery that was over at once: the replay stands without
        return []
    return [
        {"time": rounded(moment.stamp, 2), "cost": moment.cost, "words": each.words}
        for moment, each in zip(moments, told, strict=True)
    ]
