"""A meeting: people appear around a delivery that was alone, and it drives on."""

import math
from dataclasses import dataclass

import numpy as np

from harness.economics.valuation import margins
from harness.episode.episode import RunningDelivery
from harness.episode.factory import Parts
from harness.meetings.crowd import STEP, Record, StagedPeople
from harness.meetings.draw import Meeting
from harness.metrics.columns import Row
from harness.task.study import EpisodeTask
from harness.world.pybullet_world import PyBulletWorld
from harness.world.truth import CountedContact, Partner, Truth
from navstack.errors import InputError
from navstack.types import FloatArray

NOT_AT_ONCE = 2.0  # [m] from the robot within which nobody but the person appears
PAST = 2.5  # [m] from the robot, and more every tick: a meeting is over
SOONEST = 1.0  # [s] before the moment of the meeting, from which on it can be over
PATIENCE = 20.0  # [s] after it, when what is not over is driven to the delivery's end


@dataclass(frozen=True, slots=True)
class Stage:
    """Where the deliveries of an arm are driven."""

    world: PyBulletWorld
    people: StagedPeople


@dataclass(frozen=True, slots=True)
class Job:
    """A meeting of one arm."""

    number: int
    meeting: Meeting
    stamp: float  # [s] at which this arm passes the place, if it is alone


@dataclass(frozen=True, slots=True)
class Met:
    """What came of a meeting."""

    margin: float | None  # [USD] of the delivery; None: as it is among nobody
    is_hit: bool  # whether the person was hit
    contacts: int  # counted ones with people, until the delivery's end


NOTHING = Met(None, False, 0)


def stage_of(task: EpisodeTask) -> Stage:
    """A world without people for the deliveries of a task's stack; the caller closes it."""
    parts = Parts(task)
    people = StagedPeople(parts.params.people.count)
    return Stage(parts.new_world(people), people)


def margin_of(row: Row, parts: Parts) -> float:
    """What a delivery earned [USD].

    Raises:
        InputError: its cargo is not modelled.
    """
    margin = margins([row], parts.prices)
    if margin is None:
        raise InputError("this world does not model the cargo, so that no delivery has a margin")
    return float(margin[0])


def meet(delivery: RunningDelivery, stage: Stage, record: Record, job: Job) -> Met:
    """Let people appear, and drive until the person is past.

    Who is hit, touched, or has cost cargo is followed to the end of the delivery: what that costs
    is then in its margin. A delivery that hits somebody else first counts in that one's meeting.

    Args:
        delivery: under way, among nobody.
        stage: where.
        record: of the crowd.
        job: the meeting.
    """
    person = job.meeting.person
    moment = job.meeting.moment + (delivery.truth.stamp - job.stamp) / STEP
    distances = _distances(delivery.truth, record.states[int(moment)])
    if (
        delivery.truth.stamp == 0.0
        and distances[person] < delivery.parts.params.people.start_clearance
    ):
        return NOTHING  # nobody begins there
    hidden = distances < NOT_AT_ONCE
    hidden[person] = False
    stage.people.show(record, moment, hidden)
    before = _Before(delivery.truth)
    distance = math.inf
    while delivery.verdict is None:
        delivery.drive_tick()
        truth = delivery.truth
        first = before.first_hit(truth)
        if first is not None and first.partner is Partner.PEDESTRIAN:
            if first.partner_id != person:
                return NOTHING
        if before.has_consequences(truth):
            continue
        past, distance = distance, float(_distances(truth, truth.pedestrians)[person])
        late = truth.stamp - job.stamp
        if late > PATIENCE:
            continue
        if late > -SOONEST and distance > PAST and distance > past:
            return NOTHING
    row = delivery.finish().row
    hits = [each for each in delivery.truth.counted_contacts if each.partner is Partner.PEDESTRIAN]
    is_hit = any(each.partner_id == person for each in hits)
    return Met(margin_of(row, delivery.parts), is_hit, len(hits))


class _Before:
    """What had happened to a delivery before people appeared."""

    def __init__(self, truth: Truth) -> None:
        self._counted, self._contacts = len(truth.counted_contacts), len(truth.contacts)
        self._lost = _lost(truth)

    def first_hit(self, truth: Truth) -> CountedContact | None:
        """The first counted contact since."""
        if len(truth.counted_contacts) == self._counted:
            return None
        return truth.counted_contacts[self._counted]

    def has_consequences(self, truth: Truth) -> bool:
        """Whether something was touched or lost since, so that the end may be another one."""
        return (
            self.first_hit(truth) is not None
            or len(truth.contacts) > self._contacts
            or _lost(truth) > self._lost
        )


def _lost(truth: Truth) -> int:
    """Pieces of the cargo."""
    if truth.cargo is None:
        return 0
    return truth.cargo.pieces_outside


def _distances(truth: Truth, people: FloatArray) -> FloatArray:
    """From the robot to people (n, 4), in [m], shape (n,)."""
    found: FloatArray = np.hypot(people[:, 0] - truth.pose.x, people[:, 1] - truth.pose.y)
    return found
