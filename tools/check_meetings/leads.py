"""Whether meetings come to the same however long before them people appear.

Usage: python -m tools.check_meetings.leads [--stack NAME] [--missions N] [--seed N] [--kept FILE]

The same meetings are driven with each lead time. Their hits and losses are held against those of
the first. Each finished mission is a line of FILE; the same command goes on after them.
"""

import dataclasses
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from harness.meetings.draw import drawn
from harness.meetings.drive import drive_arm
from harness.meetings.mission import STREAM, crowd_along, kept_stage
from harness.meetings.results import ratio_interval
from harness.meetings.strata import NUMBER, PRIOR, PRIOR_SUM
from harness.report.markdown import table
from harness.report.numbers import interval_text
from harness.task.study import EpisodeTask, make_study
from navstack.types import FloatArray
from tools.options import parsed

LEADS = (6.0, 12.0, 24.0)  # [s]
MORE = 8.0  # [s] of the record before the longest lead


@dataclass(frozen=True, slots=True)
class Mission:
    """What one mission's meetings come to with each of :data:`LEADS`."""

    episode: int
    hits: list[float]  # people hit by a delivery
    losses: list[float]  # [USD a delivery]


def driven(task: EpisodeTask) -> Mission:
    """Drive a mission's meetings with each lead."""
    rng = task.generators()[STREAM]
    way, record, pool = crowd_along(task, rng, before=LEADS[-1] + MORE)
    meetings = drawn(pool, PRIOR, PRIOR_SUM / NUMBER, rng)
    hits, losses = [], []
    for lead in LEADS:
        arm = drive_arm(task, kept_stage(task), way, record, meetings, lead)
        hits.append(arm.expected_hits)
        losses.append(arm.margin - arm.expected_margin)
    return Mission(task.episode, hits, losses)


def printed(missions: Sequence[Mission]) -> str:
    """A table of what each lead comes to, and how many times the first."""
    hits = np.array([each.hits for each in missions])
    losses = np.array([each.losses for each in missions])
    rows = [
        (
            f"{lead:g} s",
            str(len(missions)),
            f"{hits[:, number].mean():.4f}",
            times(hits, number),
            f"{losses[:, number].mean():.2f}",
            times(losses, number),
        )
        for number, lead in enumerate(LEADS)
    ]
    first = f"times that of {LEADS[0]:g} s"
    return table(["people appear", "n", "people hit", first, "loss [USD]", first], rows)


def times(values: FloatArray, number: int) -> str:
    """The ratio of a lead's sum to that of the first, with its interval over missions.

    Args:
        values: of missions by leads, shape (n, leads).
        number: of the lead.
    """
    if number == 0 or values[:, 0].sum() == 0.0:
        return ""
    return interval_text(ratio_interval(values[:, number], values[:, 0]), 2)


def main() -> None:
    asked = parsed(
        __doc__,
        stack="nav2-gps-ekf",
        missions=40,
        seed=8500,
        kept="results/check_leads.jsonl",
    )
    file, missions = Path(asked.kept), []
    if file.exists():
        missions = [Mission(**json.loads(line)) for line in file.read_text("utf-8").splitlines()]
    study = make_study(stacks=[asked.stack], episodes=asked.missions, seed=asked.seed, workers=1)
    with file.open("a", encoding="utf-8") as lines:
        for episode in range(len(missions), asked.missions):
            missions.append(driven(study.task(0, episode)))
            lines.write(json.dumps(dataclasses.asdict(missions[-1])) + "\n")
            lines.flush()
    print(printed(missions))


if __name__ == "__main__":
    main()
