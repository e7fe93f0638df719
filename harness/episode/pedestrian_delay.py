"""How long the robot holds people up, against a twin crowd that never meets it."""

import numpy as np

from harness.world.people.errands import Errands
from harness.world.people.pedestrians import FAR_AWAY, PedestrianModel
from harness.world.truth import Truth
from navstack.types import FloatArray, IntArray

NEAR = 15.0  # [m] from the robot beyond which nobody feels it


class PedestrianDelay:
    """Watches one delivery.

    Errands do not depend on the robot, so both crowds do the same ones, at different times. Both
    walk alike until the robot first comes near a person: only then is the twin crowd made.
    """

    def __init__(self, people: PedestrianModel, truth: Truth, steps: int, dt: float) -> None:
        """Start a delivery.

        Args:
            people: of the world.
            truth: how the delivery begins.
            steps: that it takes per tick.
            dt: [s] of a step.
        """
        self._people = people
        self._steps, self._dt = steps, dt
        self._twin: PedestrianModel | None = None
        self._books: list[ErrandBook] = []  # of the people, and of their twin
        self._set_out(truth)

    def record(self, truth: Truth) -> None:
        """Let the twin walk through the tick that led to ``truth``."""
        if self._people.errands is None:
            return
        if self._twin is None:
            self._set_out(truth)
            return
        for _ in range(self._steps):
            self._twin.step(self._dt)
        for book in self._books:
            book.look(truth.stamp)

    def _set_out(self, truth: Truth) -> None:
        if self._people.errands is None:
            return
        dx, dy = truth.pedestrians[:, 0] - truth.pose.x, truth.pedestrians[:, 1] - truth.pose.y
        if not (np.hypot(dx, dy) < NEAR).any():
            return
        self._twin = self._people.twin()
        self._twin.see_robot(FAR_AWAY)
        self._books = [
            ErrandBook(each.errands)
            for each in (self._people, self._twin)
            if each.errands is not None
        ]

    def total(self, truth: Truth) -> float | None:
        """Sum over everybody in [s]; None: nobody makes way for the robot, or nobody is there."""
        if self._people.errands is None or len(truth.pedestrians) == 0:
            return None
        if self._twin is None:
            return 0.0
        held_up, free = self._books
        return total_delay(
            held_up.finishing_times(truth.stamp, self._people.states[:, :2]),
            free.finishing_times(truth.stamp, self._twin.states[:, :2]),
        )


class ErrandBook:
    """When each of n people finished each errand, from the beginning of the book on."""

    def __init__(self, errands: Errands) -> None:
        self._errands = errands
        self._finished: IntArray = errands.finished.copy()
        self._stamps: list[list[float]] = [[] for _ in errands.finished]  # [s] by person and errand

    def look(self, stamp: float) -> None:
        """Note who has finished an errand since the last look."""
        new = self._errands.finished - self._finished
        if new.any():
            for person in np.flatnonzero(new):
                self._stamps[person] += [stamp] * int(new[person])
            self._finished = self._errands.finished.copy()

    def finishing_times(self, stamp: float, positions: FloatArray) -> list[list[float]]:
        """When each errand was finished, and when the present one will be without hindrance.

        ``positions`` (n, 2) [m] says where people are at ``stamp`` [s].
        """
        left = self._errands.time_left(positions).tolist()
        return [[*stamps, stamp + time] for stamps, time in zip(self._stamps, left, strict=True)]


def total_delay(held_up: list[list[float]], free: list[list[float]]) -> float:
    """Sum over people of the delay [s] of the last errand that both crowds have a time of."""
    delays = []
    for own, other in zip(held_up, free, strict=True):
        last = min(len(own), len(other)) - 1
        delays.append(own[last] - other[last])
    return sum(delays)
