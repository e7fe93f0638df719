"""How often the intervals of an estimate by meetings hold the truth.

Usage: python -m tools.check_meetings.coverage --runs FOLDER... [--studies N] [--missions N]

Each folder is one of ``navbench check --estimator meetings``, or of ``ablate``. Its missions stand
for all that there are, and studies of fewer are drawn from them, with replacement. What differs
between its first two stacks is looked at as ``check`` does: it errs where one look does.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from harness.meetings.kept import kept_missions
from harness.meetings.looks import MeetingLooks, differences_of
from harness.meetings.mission import MissionDrive
from harness.meetings.results import result_of
from harness.report.markdown import table
from harness.report.numbers import interval_text
from harness.statistics.interval import Interval, wilson_interval
from tools.options import parsed

LEAST = 2  # missions of a folder


def holds(interval: Interval, truth: float) -> bool:
    """Whether an interval holds a value; without ends it holds all."""
    if interval.low is None or interval.high is None:
        return True
    return interval.low <= truth <= interval.high


def errs(drives: Sequence[MissionDrive], truth: float, seed: int) -> bool:
    """Whether the bound of a check excludes the true difference [USD] at any look."""
    looks = MeetingLooks(seed)
    for drive in drives:
        looks.add(drive)
        if not holds(looks.bound, truth):
            return True
    return False


def covered(
    all_missions: Sequence[MissionDrive], missions: int, studies: int, rng: np.random.Generator
) -> dict[str, tuple[int, int]]:
    """How many intervals hold the truth, and of how many, by what they are of.

    Args:
        all_missions: that stand for all there are.
        missions: of a study.
        studies: to draw.
        rng: that draws.
    """
    truth = result_of(all_missions)
    difference = None
    if len(truth.arms) > 1:
        difference = float(differences_of(all_missions).mean())
    margins = hits = right = 0
    for study in range(studies):
        chosen = rng.integers(len(all_missions), size=missions)
        drives = [all_missions[number] for number in chosen.tolist()]
        found = result_of(drives, study)
        for arm, true_arm in zip(found.arms, truth.arms, strict=True):
            margins += holds(arm.margin, _value(true_arm.margin))
            hits += holds(arm.hits, _value(true_arm.hits))
        if difference is not None:
            right += not errs(drives, difference, study)
    intervals = studies * len(truth.arms)
    counts = {"margin": (margins, intervals), "people hit": (hits, intervals)}
    if difference is not None:
        counts["difference, at all looks"] = (right, studies)
    return counts


def _value(interval: Interval) -> float:
    assert interval.value is not None, "missions were driven"
    return interval.value


def main() -> None:
    asked = parsed(__doc__, runs=["results/latest"], studies=200, missions=20)
    rng, rows = np.random.default_rng(0), []
    for folder in asked.runs:
        drives = kept_missions(Path(folder)).drives
        if len(drives) < LEAST:
            raise SystemExit(f"{folder} has {len(drives)} finished missions by meetings, too few")
        for name, (held, of) in covered(drives, asked.missions, asked.studies, rng).items():
            share = interval_text(wilson_interval(held, of), 3)
            rows.append((folder, str(len(drives)), name, str(of), share))
    print(table(["run", "missions there are", "of", "intervals", "hold the truth"], rows))


if __name__ == "__main__":
    main()
