"""Meetings are drawn as often as a robot would have them."""

import dataclasses

import numpy as np
import pytest

from harness.meetings.crowd import STEP, Record, StagedPeople
from harness.meetings.draw import AFTER, BEFORE, drawn, pool_of
from harness.meetings.passing import Passings, passings_of
from harness.meetings.strata import DIRECTIONS, MISSES, STRATA, strata_of
from harness.meetings.way import SPACING, Way, resampled

RING = 120.0  # [m] a street on which people walk round and round
LONG = 90.0  # [m] of the way
SPREADS = np.linspace(5.0, 20.0, len(STRATA))


def crowd_on_a_ring(seed: int = 0) -> Record:
    """Sixty people beside a straight way, who walk to and fro at several speeds, or stand."""
    rng = np.random.default_rng(seed)
    speeds = rng.choice([-1.2, -0.8, 0.0, 0.9, 1.3], 60)
    begin, beside = rng.uniform(0.0, RING, 60), rng.uniform(-3.5, 3.5, 60)
    times = STEP * np.arange(6000)[:, None]
    x = (begin + speeds * times) % RING - 0.5 * (RING - LONG)
    still = np.zeros_like(x)
    return Record(np.stack([x, still + beside, still + speeds, still], axis=2))


def straight_way() -> Way:
    return resampled(np.array([[0.0, 0.0], [LONG, 0.0]]))


def drive(speed: float, waits: float = 0.0) -> Passings:
    """Along the straight way, after standing for ``waits`` [s]."""
    stamps = np.arange(0.0, waits + LONG / speed, 1.0 / 30.0)
    x = np.maximum(stamps - waits, 0.0) * speed
    return passings_of(stamps, np.column_stack((x, np.zeros_like(x))), straight_way())


def counted_passings(record: Record, speed: float, begin: float, end: float) -> float:
    """Passings a delivery between two places [m], of robots that set out at many moments."""
    number, drives = 0, range(200, 4000, 7)
    times = np.arange(0.0, end / speed, STEP)
    for first in drives:
        robot = speed * times
        people = record.states[first : first + len(times), :, 0]
        ahead = people - robot[:, None]
        # not who jumps from one end of the ring to the other
        is_passing = (np.sign(ahead[1:]) != np.sign(ahead[:-1])) & (np.abs(ahead[1:]) < 1.0)
        is_passing &= np.abs(ahead[:-1]) < 1.0
        number += int(is_passing[robot[1:] >= begin].sum())
    return number / len(drives)


@pytest.mark.parametrize("speed", [1.0, 1.9, 2.5])
def test_passings_are_as_many_as_robots_have(speed: float) -> None:
    record = crowd_on_a_ring()
    pool, passings = pool_of(record, straight_way(), 2.0), drive(speed)
    expected = 0.0
    for point, along in zip(pool.points.tolist(), pool.along.tolist(), strict=True):
        at = passings.at(point, along)
        if at is not None and point * SPACING >= 5.0:
            expected += at[0] / pool.looked_at
    assert expected == pytest.approx(counted_passings(record, speed, 5.0, LONG - 2.0), rel=0.04)


def test_drawn_meetings_stand_for_all() -> None:
    pool = pool_of(crowd_on_a_ring(), straight_way(), 2.0)
    rng, sums = np.random.default_rng(1), []
    for _ in range(300):
        meetings = drawn(pool, SPREADS, 20.0, rng)
        stood_for = np.zeros(len(STRATA))
        for each in meetings:
            rate = max(abs(1.0 - each.along / 1.9), 0.25)
            stood_for[each.stratum] += each.weight * rate
        sums.append(stood_for)
    mean, error = np.mean(sums, axis=0), np.std(sums, axis=0) / np.sqrt(len(sums))
    assert (np.abs(mean - pool.usual_by_stratum) <= 4.0 * error + 1e-9).all()
    assert len(meetings) == pytest.approx(pool.usual_by_stratum @ SPREADS / 20.0, abs=1.0)


def test_nobody_near_gives_no_meeting() -> None:
    far = crowd_on_a_ring()
    far.states[:, :, 1] += 50.0
    pool = pool_of(far, straight_way(), 2.0)
    assert pool.looked_at > 0
    assert drawn(pool, SPREADS, 1.0, np.random.default_rng(0)) == []


def test_every_beginning_has_meetings_once_it_is_old_enough() -> None:
    crowd = crowd_on_a_ring()
    count = len(crowd.states)
    again = dataclasses.replace(crowd, walkers=(StagedPeople(60),), anew=count // 3)
    moments = pool_of(again, straight_way(), 2.0).moments
    assert np.unique(moments // again.span).tolist() == [0, 1, 2]
    assert (moments % again.span).min() >= BEFORE / STEP
    assert (moments % again.span).max() > again.span - 20, "who makes way goes on without a record"
    once = pool_of(crowd, straight_way(), 2.0).moments
    assert count - AFTER / STEP - 20 < once.max() < count - AFTER / STEP


def test_a_standing_robot_is_passed_by_those_who_walk() -> None:
    steady, waiting = drive(2.0), drive(2.0, waits=10.0)
    rate, stamp = _at(steady, 305, -1.0)
    assert rate == pytest.approx(1.5, rel=0.15) and stamp == pytest.approx(15.25, abs=0.1)
    assert _at(waiting, 5, -1.0)[0] == pytest.approx(1.5 + 10.0, rel=0.1)
    assert _at(waiting, 5, 0.0)[0] == pytest.approx(1.0, rel=0.15)
    assert _at(waiting, 5, -1.0)[1] < 10.0


def test_a_place_that_the_robot_never_reaches_has_no_passing() -> None:
    cut = drive(2.0)
    cut = Passings(cut.stamps[:300], cut.points[:300], cut.speeds[:299])
    assert cut.at(800, -1.0) is None


def test_strata_are_told_by_miss_and_direction() -> None:
    numbers = strata_of(np.array([0.1, 0.3, 3.9]), np.array([-1.0, 0.2, 1.0]))
    assert [STRATA[number] for number in numbers] == [
        (MISSES[0], DIRECTIONS[0]),
        (MISSES[1], DIRECTIONS[1]),
        (MISSES[4], DIRECTIONS[2]),
    ]


def _at(passings: Passings, point: int, along: float) -> tuple[float, float]:
    found = passings.at(point, along)
    assert found is not None
    return found
