"""One arm's drive among nobody, and its meetings, each from a copy some seconds before."""

import contextlib
import gc
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from harness.episode.episode import RunningDelivery
from harness.execution.copies import PausedCopy
from harness.meetings.crowd import STEP, Record
from harness.meetings.draw import Meeting
from harness.meetings.meet import APART, LEAD, Job, Met, Stage, margin_of, meet
from harness.meetings.passing import Passings, passings_of
from harness.meetings.way import SPACING, Progress, Way
from harness.metrics.columns import Row
from harness.task.study import EpisodeTask

COPY_EVERY = 2.0  # [s] between copies
# [m] along the way for each :data:`LEAD`; a copy is made at the start, and where somebody is met
# there
AHEAD = (10.0, 15.0)


@dataclass(frozen=True, slots=True)
class Weighed:
    """Results of one meeting, and its weight in a delivery."""

    weight: float  # meetings a delivery; 0: this arm is not met there
    loss: float  # [USD] margin lost to the meeting
    people_hit: int  # the person, and others who came because of him
    contacts: int  # counted ones with them


NOT_MET = Weighed(0.0, 0.0, 0, 0)


@dataclass(frozen=True, slots=True)
class ArmDrive:
    """What one arm did on a mission."""

    row: Row  # of the delivery among nobody
    margin: float  # [USD] of it
    farthest_off: float  # [m] from the planned way
    met: tuple[Weighed, ...]  # in the order of the meetings

    @property
    def expected_margin(self) -> float:
        """Of a delivery among people [USD]."""
        return self.margin - sum(each.weight * each.loss for each in self.met)

    @property
    def expected_hits(self) -> float:
        """People who are hit by a delivery."""
        return sum(each.weight * each.people_hit for each in self.met)


@dataclass(slots=True)
class _Mark:
    """A copy of the delivery, and what is to be driven from it."""

    stamp: float  # [s]
    x: float  # [m] of the robot
    y: float  # [m]
    copy: PausedCopy[Job, Met]
    jobs: list[Job] = field(default_factory=list)


def drive_arm(
    task: EpisodeTask,
    stage: Stage,
    way: Way,
    record: Record,
    meetings: Sequence[Meeting],
    lead: float = LEAD,
) -> ArmDrive:
    """Drive a mission among nobody, and then its meetings.

    Args:
        task: the delivery.
        stage: of its stack.
        way: planned.
        record: of the crowd.
        meetings: with people of it.
        lead: [s] before a meeting, at least, at which people appear.

    Raises:
        NavstackError: the task cannot be set up.
        CopyError: a meeting failed.
    """
    delivery = RunningDelivery(task, world=stage.world)
    progress = Progress(way)
    with _still_memory(), contextlib.ExitStack() as copies:
        marks: list[_Mark] = []
        work = partial(meet, delivery, stage, record)
        for place in _drive_alone(delivery, progress, meetings, lead):
            copy = PausedCopy(work, [each.copy for each in marks])
            copies.callback(copy.close)
            marks.append(_Mark(*place, copy))
        series = delivery.log.series()
        row = delivery.finish().row
        margin = margin_of(row, delivery.parts.prices)
        passings = passings_of(series["stamp"], np.column_stack((series["x"], series["y"])), way)
        weights = _hand_out(meetings, passings, record, marks, lead)
        met = [NOT_MET] * len(meetings)
        for mark in marks:
            for job, found in zip(mark.jobs, mark.copy.ask(mark.jobs), strict=True):
                loss = 0.0
                if found.margin is not None:
                    loss = margin - found.margin
                met[job.number] = Weighed(
                    weights[job.number], loss, found.people_hit, found.contacts
                )
    return ArmDrive(row, margin, progress.farthest_off, tuple(met))


def _drive_alone(
    delivery: RunningDelivery, progress: Progress, meetings: Sequence[Meeting], lead: float
) -> Iterator[tuple[float, float, float]]:
    """Drive to the end; yields the stamp [s] and the robot's place [m] where to copy it."""
    points = np.array([each.point for each in meetings])
    nearest, farthest = (round(lead / LEAD * each / SPACING) for each in AHEAD)
    due, copied_at = 0.0, -1  # [s], point of the way
    while delivery.verdict is None:
        truth = delivery.truth
        point = progress.advance(truth.pose.x, truth.pose.y)
        is_wanted = ((points >= point + nearest) & (points <= point + farthest)).any()
        if copied_at < 0 or (is_wanted and truth.stamp >= due and point > copied_at):
            yield truth.stamp, truth.pose.x, truth.pose.y
            due, copied_at = truth.stamp + COPY_EVERY, point
        delivery.drive_tick()


def _hand_out(
    meetings: Sequence[Meeting],
    passings: Passings,
    record: Record,
    marks: Sequence[_Mark],
    lead: float,
) -> list[float]:
    """Give each meeting to the latest copy that is early enough; returns their weights."""
    weights = [0.0] * len(meetings)
    for number, meeting in enumerate(meetings):
        passing = passings.at(meeting.point, meeting.along)
        if passing is None:
            continue
        rate, stamp = passing
        weights[number] = meeting.weight * rate
        chosen = marks[0]
        for mark in marks:
            if mark.stamp <= stamp - lead and _is_apart(mark, meeting, stamp, record):
                chosen = mark
        chosen.jobs.append(Job(number, meeting, stamp))
    return weights


def _is_apart(mark: _Mark, meeting: Meeting, stamp: float, record: Record) -> bool:
    """Whether the person is not yet near the robot at a mark, if they meet at ``stamp`` [s]."""
    moment = int(meeting.moment + (mark.stamp - stamp) / STEP)
    earliest = record.beginning(meeting.moment)
    x, y, _, _ = record.states[max(moment, earliest), meeting.person].tolist()
    return math.hypot(x - mark.x, y - mark.y) >= APART


@contextlib.contextmanager
def _still_memory() -> Iterator[None]:
    """Let no collector touch the pages that copies share."""
    gc.collect()
    gc.freeze()
    gc.disable()
    try:
        yield
    finally:
        gc.enable()
        gc.unfreeze()
