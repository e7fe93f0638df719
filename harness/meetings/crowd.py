"""A crowd without a robot, recorded, and people who do again what they did in the record."""

from dataclasses import dataclass

import numpy as np

from harness.world.people.pedestrians import ABSENT, FAR_AWAY, PedestrianModel
from harness.world.physics.body_state import BodyState
from navstack.types import BoolArray, FloatArray, Pose2D

STEP = 0.1  # [s] of a record
LONG = 600.0  # [s]
# [s] after which people who make way begin anew: some wedge each other, more and more of them
YOUNG = 120.0
KEPT_EVERY = 20  # steps between the moments from which such people can go on


@dataclass(frozen=True, slots=True, eq=False)
class Record:
    """What a crowd did, every :data:`STEP`."""

    states: FloatArray  # (moments, people, 4): x, y [m], vx, vy [m/s], map frame
    # of those who make way for a robot, every KEPT_EVERY; empty: nobody does
    walkers: tuple[PedestrianModel, ...] = ()
    anew: int = 0  # moments after which they begin anew; 0: they do not

    @property
    def people(self) -> int:
        """How many there are."""
        return int(self.states.shape[1])

    @property
    def span(self) -> int:
        """Moments from one beginning to the next, or to the record's end."""
        return self.anew or len(self.states)

    def beginning(self, moment: int) -> int:
        """The moment at which those of a moment began."""
        return moment // self.span * self.span

    def walkers_at(self, moment: float) -> PedestrianModel:
        """People who go on by themselves from a moment, in steps from the beginning."""
        number = int(moment)
        walkers = self.walkers[number // KEPT_EVERY].twin()
        walkers.steps(STEP, number % KEPT_EVERY)
        walkers.step((moment - number) * STEP)
        return walkers


def recorded(people: PedestrianModel, rng: np.random.Generator, robot: Pose2D) -> Record:
    """What people do in :data:`LONG`; those who make way begin anew after :data:`YOUNG`.

    Args:
        people: who begin anew, and see no robot.
        rng: of all their chance.
        robot: where they do not begin.
    """
    anew = count = round(LONG / STEP)
    if people.errands is not None:
        anew = round(YOUNG / STEP)
    moments, walkers = [], []
    for number in range(count):
        if number % anew == 0:
            people.reset(rng, robot)
            people.see_robot(FAR_AWAY)
        if people.errands is not None and number % KEPT_EVERY == 0:
            walkers.append(people.twin())
        moments.append(people.states)
        people.step(STEP)
    return Record(np.array(moments), tuple(walkers), anew)


class StagedPeople(PedestrianModel):
    """Nobody is there, until a moment of a record begins."""

    def __init__(self, count: int) -> None:
        """Stage so many people."""
        self._count = count
        self._clear()

    def _clear(self) -> None:
        self._record: Record | None = None
        self._moment = 0.0  # of the record
        self._is_shown: BoolArray = np.zeros(self._count, dtype=np.bool_)
        self._states = np.array([ABSENT] * self._count).reshape(-1, 4)

    @property
    def states(self) -> FloatArray:
        """See :class:`PedestrianModel`."""
        return self._states

    def reset(self, rng: np.random.Generator, robot: Pose2D) -> None:
        """See :class:`PedestrianModel`; nobody is there."""
        self._clear()

    def show(self, record: Record, moment: float, hidden: BoolArray) -> None:
        """Let people appear and walk on as recorded; when the record ends, they are gone.

        Args:
            record: of as many people.
            moment: of it that is now, in steps from its beginning.
            hidden: who stays away, shape (people,).
        """
        self._record, self._moment, self._is_shown = record, moment, ~hidden
        self._put()

    def leave(self) -> None:
        """Let nobody be there any more."""
        self._clear()

    def step(self, dt: float) -> None:
        """See :class:`PedestrianModel`."""
        self.steps(dt, 1)

    def steps(self, dt: float, times: int) -> None:
        """See :class:`PedestrianModel`."""
        if self._record is not None:
            self._moment += dt * times / STEP
            self._put()

    def _put(self) -> None:
        record, shown = self._record, self._is_shown
        if record is None:
            return
        self._states = np.array([ABSENT] * self._count)
        before = int(self._moment)
        if before + 1 < len(record.states):
            now, then = record.states[before][shown], record.states[before + 1][shown]
            part = self._moment - before
            now[:, :2] += part * (then[:, :2] - now[:, :2])
            self._states[shown] = now


class StagedWalkers(StagedPeople):
    """Nobody is there, until people go on from a moment of a record, and make way for the robot.

    Who stays away walks about unseen: the others make way for him, too.
    """

    takes_pushes = True

    def _clear(self) -> None:
        super()._clear()
        self._walkers: PedestrianModel | None = None

    def show(self, record: Record, moment: float, hidden: BoolArray) -> None:
        """See :class:`StagedPeople`; they go on after the record's end."""
        self._walkers, self._is_shown = record.walkers_at(moment), ~hidden
        self._put()

    def see_robot(self, robot: BodyState) -> None:
        """See :class:`PedestrianModel`."""
        if self._walkers is not None:
            self._walkers.see_robot(robot)

    def displaced(self, person: int, x: float, y: float, vx: float, vy: float) -> None:
        """See :class:`PedestrianModel`."""
        if self._walkers is not None:
            self._walkers.displaced(person, x, y, vx, vy)
            self._put()

    def steps(self, dt: float, times: int) -> None:
        """See :class:`PedestrianModel`."""
        if self._walkers is not None:
            self._walkers.steps(dt, times)
            self._put()

    def _put(self) -> None:
        if self._walkers is not None:
            self._states = np.where(self._is_shown[:, None], self._walkers.states, ABSENT)
