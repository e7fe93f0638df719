"""Whether as many people are hit in meetings as in whole deliveries.

Usage: python -m tools.check_meetings [--run FOLDER:STACK] [--missions N] [--drawn N] [--kept FILE]

The whole deliveries are a finished run's. Its missions are driven among nobody, and then

- its own people are met: whoever is passed, at the moment and among the people of the delivery. So
  it shows whether a meeting ends as the delivery does.
- people are met as ``navbench check --estimator meetings`` draws them: --drawn on average in the
  default world; 0: nobody.
- the people whom it passes are counted, and compared with how many Palm's law says it would pass.

Missions in which somebody was hit are few, and drive in turns with twice as many others; what is
printed is weighted to all missions of the run. Each finished mission is a line of FILE; the same
command goes on after them.
"""

import dataclasses
import itertools
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from harness.economics.accountings import COUNTED, PERSON
from harness.episode.episode import RunningDelivery
from harness.episode.factory import Parts
from harness.meetings.crowd import STEP, Record
from harness.meetings.draw import Meeting, Pool
from harness.meetings.drive import drive_arm
from harness.meetings.mission import MissionTask, crowd_along, drive_mission, kept_stage
from harness.meetings.passing import Passings, passings_of
from harness.meetings.strata import MISSES, PRIOR, PRIOR_SUM, STRATA, strata_of
from harness.meetings.way import Way
from harness.report.markdown import table
from harness.report.numbers import interval_text
from harness.statistics.interval import Interval, Z
from harness.study.manifest import load_study
from harness.study.stored_run import StoredRun, load_run
from harness.task.study import EpisodeTask
from navstack.types import BoolArray, FloatArray
from tools.options import parsed

OTHERS = 2  # missions in which nobody was hit, for each in which somebody was
WITHIN = (0.5, MISSES[-1])  # [m] from the way, of people who are counted


@dataclass(frozen=True, slots=True)
class Counted:
    """People hit on a mission."""

    episode: int
    whole: int  # by the delivery
    own: float  # in meetings with its own people
    drawn: float | None  # in meetings as they are drawn, expected; None: none were
    passed: tuple[float, ...]  # people, by the ends of :data:`WITHIN`
    expected: tuple[float, ...]  # by Palm's law, likewise


def met_on_the_way(record: Record, way: Way, passings: Passings) -> list[Meeting]:
    """Whom a drive passes among people who set out with it, and where; each stands for itself.

    Args:
        record: of the people, from the drive's beginning.
        way: planned.
        passings: of the drive.
    """
    moments = range(min(int(passings.stamps[-1] / STEP), len(record.states)))
    robot = np.interp(STEP * np.array(moments), passings.stamps, passings.points)
    found = []
    for person in range(record.people):
        states = record.states[moments.start : moments.stop, person]
        points, misses = way.nearest(states[:, :2])
        is_near, is_ahead = np.isfinite(misses), points > robot
        is_passed = is_near[1:] & is_near[:-1] & (is_ahead[1:] != is_ahead[:-1])
        is_passed[record.span - 1 :: record.span] = False  # they begin anew elsewhere
        for moment in (np.flatnonzero(is_passed) + 1).tolist():
            point = int(points[moment])
            along = float(states[moment, 2:] @ way.directions[point])
            stratum = int(strata_of(misses[moment : moment + 1], np.array([along]))[0])
            at = passings.at(point, along)
            if at is None:
                continue
            rate, stamp = at
            found.append(Meeting(round(stamp / STEP), person, point, along, stratum, 1.0 / rate))
    return found


def counted(task: EpisodeTask, whole: int, number: int) -> Counted:
    """Count who is hit on a mission.

    Args:
        task: its delivery.
        whole: people whom the delivery hit.
        number: of meetings to draw, on average in the default world.
    """
    parts = Parts(task)
    way, record, pool = crowd_along(task, task.generators()["pedestrians"])
    passings = alone(task, way)
    meetings = met_on_the_way(record, way, passings)
    own, drawn = 0.0, None
    if meetings:
        own = drive_arm(task, kept_stage(task), way, record, meetings).expected_hits
    if number:
        mission = drive_mission(MissionTask((task,), tuple(PRIOR.tolist()), PRIOR_SUM / number))
        drawn = mission.arms[0].expected_hits
    last = way.point_before_end(parts.rules.arrival_radius)
    seen = passed(record, way, passings, last)
    return Counted(task.episode, whole, own, drawn, seen, expected(pool, passings))


def passed(record: Record, way: Way, passings: Passings, last: int) -> tuple[float, ...]:
    """How many a drive passes, by the ends of :data:`WITHIN`.

    The mean of drives that set out whenever people begin anew and are over before the record is.

    Args:
        record: of the people, from the drive's beginning.
        way: planned.
        passings: of the drive.
        last: point of the way from which on nobody is drawn.
    """
    steps = int(passings.stamps[-1] / STEP)
    beginnings = range(0, max(len(record.states) - steps, 1), record.span)
    misses = [
        STRATA[each.stratum][0]
        for beginning in beginnings
        for each in met_on_the_way(_since(beginning, record), way, passings)
        if 0 < each.point < last
    ]
    return tuple(sum(miss <= end for miss in misses) / len(beginnings) for end in WITHIN)


def _since(beginning: int, record: Record) -> Record:
    """What people did from a beginning on."""
    return Record(record.states[beginning:], anew=record.anew)


def expected(pool: Pool, passings: Passings) -> tuple[float, ...]:
    """How many are passed by Palm's law, by the ends of :data:`WITHIN`."""
    sums = np.zeros(len(STRATA))
    places = zip(pool.points.tolist(), pool.along.tolist(), pool.strata.tolist(), strict=True)
    for point, along, stratum in places:
        at = passings.at(point, along)
        if at is not None:
            sums[stratum] += at[0] / pool.looked_at
    ends = np.array([miss for miss, _ in STRATA])
    return tuple(float(sums[ends <= end].sum()) for end in WITHIN)


def alone(task: EpisodeTask, way: Way) -> Passings:
    """A delivery among nobody, along its way."""
    delivery = RunningDelivery(task, world=kept_stage(task).world)
    while delivery.verdict is None:
        delivery.drive_tick()
    series = delivery.log.series()
    delivery.finish()
    return passings_of(series["stamp"], np.column_stack((series["x"], series["y"])), way)


def in_turns(whole: dict[int, int]) -> Iterator[int]:
    """The missions of a run, those in which somebody was hit with others between.

    Args:
        whole: people hit, by mission.
    """
    shuffled = np.random.default_rng(0).permutation(sorted(whole)).tolist()
    hit = [each for each in shuffled if whole[each]]
    others = iter([each for each in shuffled if not whole[each]])
    for each in hit:
        yield each
        yield from itertools.islice(others, OTHERS)
    yield from others


def weighted(values: FloatArray, is_hit: BoolArray, shares: FloatArray) -> tuple[float, float]:
    """The mean over all missions and its variance, from two strata (Cochran 1977, 5.3).

    Args:
        values: of the missions driven, shape (n,).
        is_hit: whether somebody was hit in the whole delivery, shape (n,).
        shares: of the other missions and of those among all, shape (2,).
    """
    mean = variance = 0.0
    for share, chosen in zip(shares.tolist(), (~is_hit, is_hit), strict=True):
        of_stratum = values[chosen]
        mean += share * float(of_stratum.mean())
        variance += share**2 * float(of_stratum.var(ddof=1)) / len(of_stratum)
    return mean, variance


def printed(found: Sequence[Counted], whole: dict[int, int]) -> str:
    """The table of what was counted, weighted to all missions of the run."""
    is_hit = np.array([each.whole > 0 for each in found])
    if min(is_hit.sum(), (~is_hit).sum()) < 2:
        return "too few missions to tell"
    all_hits = np.array(list(whole.values()))
    of_all, n = float(all_hits.mean()), len(found)
    spread = float(all_hits.var(ddof=1)) / len(all_hits)
    shares = np.array([(all_hits == 0).mean(), (all_hits > 0).mean()])
    rows = [("whole deliveries", str(len(all_hits)), text_of(of_all, spread, len(all_hits)), "")]
    drawn = np.array([each.drawn for each in found], dtype=np.float64)
    kinds = {
        "own people, in meetings": (np.array([each.own for each in found]), 0.0),
        "drawn people, in meetings": (drawn, spread),
    }
    for name, (values, more) in kinds.items():
        if np.isnan(values).any():
            continue
        mean, variance = weighted(values, is_hit, shares)
        # the same people make no difference by chance; those who are drawn are others
        ratio = (variance + more * (mean / of_all) ** 2) / of_all**2
        rows.append((name, str(n), text_of(mean, variance, n), text_of(mean / of_all, ratio, n)))
    again = sum(each.own > 0.0 for each in found if each.whole)
    more_hits = sum(each.own > 0.0 for each in found if not each.whole)
    return "\n".join(
        [
            table(["people hit", "n", "a delivery", "to whole deliveries"], rows),
            f"own people: hit again in {again} of {is_hit.sum()} missions, hit in meetings alone "
            f"in {more_hits} of {(~is_hit).sum()}",
            *passed_texts(found, is_hit, shares),
        ]
    )


def passed_texts(found: Sequence[Counted], is_hit: BoolArray, shares: FloatArray) -> list[str]:
    """How many people are passed and by Palm's law would be, a line for each of :data:`WITHIN`."""
    lines = []
    for number, end in enumerate(WITHIN):
        passed = np.array([float(each.passed[number]) for each in found])
        by_law = np.array([each.expected[number] for each in found])
        mean, _ = weighted(passed, is_hit, shares)
        if mean == 0.0:
            continue
        ratio = weighted(by_law, is_hit, shares)[0] / mean
        # of a ratio of means, by its residuals (Cochran 1977, 6.4)
        _, variance = weighted(by_law - ratio * passed, is_hit, shares)
        lines.append(
            f"passed within {end:g} m of the way: {mean:.3f} people a delivery, by Palm's law "
            f"{text_of(ratio, variance / mean**2, len(found))} times as many"
        )
    return lines


def text_of(mean: float, variance: float, n: int) -> str:
    """A mean with its normal interval."""
    half = Z * variance**0.5
    return interval_text(Interval(mean, max(mean - half, 0.0), mean + half, n), 3)


def read(file: Path) -> list[Counted]:
    """The missions that are finished."""
    if not file.exists():
        return []
    return [Counted(**json.loads(line)) for line in file.read_text("utf-8").splitlines()]


def main() -> None:
    asked = parsed(
        __doc__,
        run="results/baseline/published_3/sidewalk:nav2-gps-ekf",
        missions=60,
        drawn=6,
        kept="results/check_meetings.jsonl",
    )
    folder, _, name = asked.run.rpartition(":")
    run, study, file = load_run(asked.run), load_study(Path(folder), 1), Path(asked.kept)
    number = [stack.name for stack in study.stacks].index(name)
    whole = {row["episode"]: 0 for row in run.stacks[0].rows}
    for episode, _ in people_hit(run, name):
        whole[episode] += 1
    found = read(file)
    known = {each.episode for each in found}
    left = [each for each in in_turns(whole) if each not in known]
    with file.open("a", encoding="utf-8") as lines:
        for episode in left[: max(asked.missions - len(found), 0)]:
            found.append(counted(study.task(number, episode), whole[episode], asked.drawn))
            lines.write(json.dumps(dataclasses.asdict(found[-1])) + "\n")
            lines.flush()
    print(printed(found, whole))


def people_hit(run: StoredRun, stack: str) -> set[tuple[int, int]]:
    """Mission and number of everybody whom a stack's deliveries hit."""
    return {
        (each["episode"], each["partner_id"])
        for each in run.events
        if each["stack"] == stack and each["type"] == COUNTED and each["partner"] == PERSON
    }


if __name__ == "__main__":
    main()
