"""People do again what they did."""

import math

import numpy as np

from harness.meetings.crowd import STEP, Record, StagedPeople
from navstack.types import Pose2D


def record() -> Record:
    """One walks east, the other north, for three moments."""
    states = np.zeros((3, 2, 4))
    states[:, 0, 0] = states[:, 1, 1] = (0.0, 0.1, 0.2)
    states[:, 0, 2] = states[:, 1, 3] = 1.0
    return Record(states)


def staged() -> StagedPeople:
    people = StagedPeople(2)
    people.reset(np.random.default_rng(0), Pose2D())
    return people


def test_nobody_is_there_at_first() -> None:
    people = staged()
    people.steps(STEP, 3)
    assert people.states.shape == (2, 4) and np.isinf(people.states[:, :2]).all()


def test_they_walk_between_moments_and_go_when_the_record_ends() -> None:
    people = staged()
    people.show(record(), 0.5, np.zeros(2, dtype=np.bool_))
    assert np.allclose(people.states, [[0.05, 0.0, 1.0, 0.0], [0.0, 0.05, 0.0, 1.0]])
    people.step(0.5 * STEP)
    assert np.allclose(people.states[:, :2], [[0.1, 0.0], [0.0, 0.1]])
    people.steps(STEP, 2)
    assert np.isinf(people.states[:, :2]).all()


def test_who_is_hidden_stays_away() -> None:
    people = staged()
    people.show(record(), 0.0, np.array([True, False]))
    assert people.states[0, 0] == math.inf and people.states[1, 1] == 0.0


def test_people_leave_at_once() -> None:
    people = staged()
    people.show(record(), 0.0, np.zeros(2, dtype=np.bool_))
    people.leave()
    people.step(STEP)
    assert np.isinf(people.states[:, :2]).all()


def test_a_new_delivery_is_alone_again() -> None:
    people = staged()
    people.show(record(), 0.0, np.zeros(2, dtype=np.bool_))
    people.reset(np.random.default_rng(0), Pose2D())
    assert np.isinf(people.states[:, :2]).all()
