"""A meeting: people appear around a delivery that was alone, and it drives on."""

import math
from dataclasses import dataclass, replace

import numpy as np

from harness.economics.prices import Prices
from harness.economics.valuation import margins
from harness.episode.episode import RunningDelivery
from harness.episode.factory import Parts
from harness.meetings.crowd import STEP, Record, StagedPeople, StagedWalkers
from harness.meetings.draw import Meeting
from harness.metrics.columns import Row
from harness.task.study import EpisodeTask
from harness.world.pybullet_world import PyBulletWorld
from harness.world.truth import Contact, CountedContact, Partner, Truth
from navstack.errors import InputError
from navstack.types import FloatArray

LEAD = 6.0  # [s] before a meeting, at least, at which people appear
APART = 6.0  # [m] from the robot, at least, at which they do: it has to see them come
PAST = 2.5  # [m] from the robot, and more every tick: a meeting is over
SOONEST = 1.0  # [s] before the moment of the meeting, from which on it can be over
PATIENCE = 20.0  # [s] after it, when what is not over is driven to the delivery's end
# who has not come so far [m] in so long [s] is taken to stand there until the timeout
HELD_WAY, HELD_TIME = 1.0, 60.0


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
    """Results of one meeting."""

    margin: float | None  # [USD] of the delivery; None: as without people
    people_hit: int  # the person, and others who came because of him
    contacts: int  # counted ones with them


NOTHING = Met(None, 0, 0)


def stage_of(task: EpisodeTask) -> Stage:
    """A world without people for the deliveries of a task's stack; the caller closes it."""
    parts = Parts(task)
    kind = StagedPeople
    if parts.params.people.model == "social_force":
        kind = StagedWalkers
    people = kind(parts.params.people.count)
    return Stage(parts.new_world(people), people)


def margin_of(row: Row, prices: Prices) -> float:
    """What a delivery earned [USD].

    Raises:
        InputError: its cargo is not modelled.
    """
    margin = margins([row], prices)
    if margin is None:
        raise InputError("this world does not model the cargo, so that no delivery has a margin")
    return float(margin[0])


def meet(delivery: RunningDelivery, stage: Stage, record: Record, job: Job) -> Met:
    """Let people appear, and drive until the person is past.

    Other people nearer than :data:`APART` are hidden: a robot cannot avoid people who appear next
    to it. If the robot touches another person first, the touch counts in that person's meeting.
    A meeting has consequences after a touch, a loss of cargo, or a delay of :data:`PATIENCE`. The
    other people then stay, since they may come because the robot stands there. They leave once it
    has left the place, since people met later have meetings of their own. The delivery is driven to
    its end, so that its margin contains the cost of the meeting.

    Args:
        delivery: under way, among nobody.
        stage: where.
        record: of the crowd.
        job: the meeting.
    """
    person = job.meeting.person
    beginning = record.beginning(job.meeting.moment)
    while _moment(delivery, job) < beginning and delivery.verdict is None:
        delivery.drive_tick()  # the copy is older than the record
    moment = _moment(delivery, job)
    distances = _distances(delivery.truth, record.states[int(moment)])
    apart = APART
    if delivery.truth.stamp == 0.0:
        apart = delivery.parts.params.people.start_clearance  # as every delivery begins
        if distances[person] < apart:
            return NOTHING  # nobody begins there
    hidden = distances < apart
    hidden[person] = False
    stage.people.show(record, moment, hidden)
    before, held = _Before(delivery.truth), _Held(delivery.truth)
    aftermath = _Aftermath(delivery.truth)
    distance = math.inf
    while delivery.verdict is None:
        delivery.drive_tick()
        truth = delivery.truth
        late = truth.stamp - job.stamp
        if late <= PATIENCE and before.first_person(truth) not in (None, person):
            return NOTHING
        held.look(truth)
        if held.is_for_good:
            delivery.parts.rules = replace(delivery.parts.rules, timeout=HELD_TIME)
        is_open = late <= PATIENCE and not before.has_consequences(truth)
        aftermath.look(truth, is_open)
        if not is_open:
            if aftermath.is_over:
                stage.people.leave()
            continue
        past, distance = distance, float(_distances(truth, truth.pedestrians)[person])
        if late > -SOONEST and distance > PAST and distance > past:
            return NOTHING
    row = delivery.finish().row
    hits = [each for each in delivery.truth.counted_contacts if each.partner is Partner.PEDESTRIAN]
    people_hit = len({each.partner_id for each in hits})
    return Met(margin_of(row, delivery.parts.prices), people_hit, len(hits))


def _moment(delivery: RunningDelivery, job: Job) -> float:
    """Of the record that is now, in steps from its beginning."""
    return job.meeting.moment + (delivery.truth.stamp - job.stamp) / STEP


class _Before:
    """What had happened to a delivery before people appeared."""

    def __init__(self, truth: Truth) -> None:
        self._happened = self._contacts, self._counted, _ = _happened(truth)
        self._first: int | None = None

    def first_person(self, truth: Truth) -> int | None:
        """The number of the person of whom a touch was known first since; None: nobody was touched.

        A soft touch is known when it is over, and must not make another one the first afterwards.
        """
        if self._first is None:
            self._first = self._touched_first(truth)
        return self._first

    def _touched_first(self, truth: Truth) -> int | None:
        contacts: list[Contact | CountedContact] = [
            *truth.counted_contacts[self._counted :],
            *truth.contacts[self._contacts :],
        ]
        touched = [
            (each.stamp, each.partner_id) for each in contacts if each.partner is Partner.PEDESTRIAN
        ]
        if not touched:
            return None
        return min(touched)[1]

    def has_consequences(self, truth: Truth) -> bool:
        """Whether something was touched or lost since, so that the end may be another one."""
        return _happened(truth) != self._happened


class _Aftermath:
    """Where the robot was when something last happened, and whether it is away from there."""

    def __init__(self, truth: Truth) -> None:
        self._seen, self._place, self._since = _happened(truth), truth.pose, truth.stamp
        self.is_over = False

    def look(self, truth: Truth, is_open: bool) -> None:
        """Look at the robot after a tick; while the meeting is open, something happens."""
        if is_open or _happened(truth) != self._seen:
            self._seen, self._place, self._since = _happened(truth), truth.pose, truth.stamp
        way = math.hypot(truth.pose.x - self._place.x, truth.pose.y - self._place.y)
        self.is_over = way > APART and truth.stamp - self._since > LEAD


class _Held:
    """Where a robot stands, and since when."""

    def __init__(self, truth: Truth) -> None:
        self._pose, self._since, self._now = truth.pose, truth.stamp, truth.stamp

    def look(self, truth: Truth) -> None:
        """Look at the robot after a tick."""
        self._now = truth.stamp
        if math.hypot(truth.pose.x - self._pose.x, truth.pose.y - self._pose.y) > HELD_WAY:
            self._pose, self._since = truth.pose, truth.stamp

    @property
    def is_for_good(self) -> bool:
        """Whether it has stood there for so long that it hardly comes away."""
        return self._now - self._since > HELD_TIME


def _happened(truth: Truth) -> tuple[int, int, int]:
    """Contacts, counted ones and pieces of the cargo lost so far."""
    return len(truth.contacts), len(truth.counted_contacts), _lost(truth)


def _lost(truth: Truth) -> int:
    """Pieces of the cargo."""
    if truth.cargo is None:
        return 0
    return truth.cargo.pieces_outside


def _distances(truth: Truth, people: FloatArray) -> FloatArray:
    """From the robot to people (n, 4), in [m], shape (n,)."""
    found: FloatArray = np.hypot(people[:, 0] - truth.pose.x, people[:, 1] - truth.pose.y)
    return found
