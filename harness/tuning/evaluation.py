"""Candidates, and what drives them on missions.

A study has two streams of missions. Number n below :data:`FIRST_TEST` is delivery n of ``navbench
run --seed S``, where S is the study's seed: a training mission. Number ``FIRST_TEST + n`` is
delivery n of ``navbench run --seed T`` with T =
:func:`unseen_seed` (S): a test mission. Both seeds go through :class:`numpy.random.SeedSequence`
with the number of the delivery as spawn key, so that the streams share no generator, and whoever
has the tuned file can drive the test again with one line of ``navbench run``.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from harness.metrics.columns import Row
from harness.task.study import MAX_EPISODES

FIRST_TEST = MAX_EPISODES  # number of the first test mission; training missions are below
TEST_STREAM = 0x7E57  # tells the test seed's sequence from others of the same seed
# column that evaluators add to the rows: contribution margin [USD] of the delivery
MARGIN = "margin_usd"
# the same [USD], contacts with people paid for by the robot's share of the fault
SHARED_MARGIN = "shared_margin_usd"

Value = float | int | str | bool


class OutOfTimeError(Exception):
    """The budget ended before everything was driven; what was driven is kept."""


@dataclass(frozen=True, slots=True)
class Candidate:
    """A Nav2 file as changed by the tuner."""

    name: str  # "original", "trial-17", "incumbent", ...
    # ``node.parameter`` (as Nav2File.with_values names them) -> value; {}: the user's file
    values: Mapping[str, Value]

    @property
    def key(self) -> tuple[tuple[str, Value], ...]:
        """What tells candidates apart that drive differently."""
        return tuple(sorted(self.values.items()))


class Evaluator(Protocol):
    """Drives candidates."""

    def rows(self, candidate: Candidate, missions: Sequence[int]) -> list[Row]:
        """One episode row per mission number, in the order given.

        The columns are those of ``episodes.parquet``, :data:`MARGIN` and :data:`SHARED_MARGIN`
        (None where the cargo is not modelled) and :data:`harness.audit.pairs.EVENTS`; an episode
        that could not be run has its ``error``, as in a run, and nothing measured.

        Raises:
            InputError: the candidate's values cannot be had.
            OutOfTimeError: there was no time for all of them.
        """


def unseen_seed(seed: int) -> int:
    """The seed of a study's test missions.

    Another than its own, and the same for the same study.
    """
    derived = int(np.random.SeedSequence((seed, TEST_STREAM)).generate_state(1)[0])
    if derived != seed:
        return derived
    return derived + 1


def seed_and_episode(seed: int, mission: int) -> tuple[int, int]:
    """Which delivery of which ``navbench run`` a mission is, for the study's seed."""
    if mission < FIRST_TEST:
        return (seed, mission)
    return (unseen_seed(seed), mission - FIRST_TEST)


def unseen_missions(count: int) -> tuple[int, ...]:
    """The numbers of the first ``count`` test missions."""
    return tuple(range(FIRST_TEST, FIRST_TEST + count))
