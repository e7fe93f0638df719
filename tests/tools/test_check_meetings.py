"""The proof of the estimator by meetings: whom a drive passes, and how missions are weighted."""

import numpy as np
import pytest

from harness.meetings.crowd import STEP, Record
from harness.meetings.draw import pool_of
from harness.meetings.passing import passings_of
from harness.meetings.way import resampled
from harness.world.people.pedestrians import ABSENT
from tools.check_meetings.__main__ import (
    WITHIN,
    Counted,
    expected,
    in_turns,
    met_on_the_way,
    passed,
    printed,
    weighted,
)

LONG = 60.0  # [m] of a straight way
SPEED = 2.0  # [m/s] of the robot
# x [m] where each begins, speed [m/s] along the way, y [m] beside it
WALKERS = (
    (30.0, -1.0, 0.1),
    (15.0, 1.0, 0.4),
    (10.0, 3.0, 0.0),
    (-5.0, 1.0, 0.0),
    (50.0, 0.0, 5.0),
)


def record() -> Record:
    """Who comes, who is overtaken, who is faster, who stays behind, who stands too far away."""
    times = STEP * np.arange(300)
    states = np.zeros((len(times), len(WALKERS) + 1, 4))
    for number, (begin, speed, beside) in enumerate(WALKERS):
        states[:, number, 0] = begin + speed * times
        states[:, number, 1] = beside
        states[:, number, 2] = speed
    states[:, -1] = ABSENT
    return Record(states)


def test_who_comes_and_who_is_overtaken_are_met_where_the_robot_passes_them() -> None:
    way = resampled(np.array([[0.0, 0.0], [LONG, 0.0]]))
    stamps = np.arange(0.0, LONG / SPEED, 1.0 / 30.0)
    drive = passings_of(stamps, np.column_stack((SPEED * stamps, np.zeros_like(stamps))), way)
    head_on, overtaken = met_on_the_way(record(), way, drive)
    assert (head_on.person, overtaken.person) == (0, 1)
    assert head_on.moment * STEP == pytest.approx(10.0, abs=0.2)
    assert overtaken.moment * STEP == pytest.approx(15.0, abs=0.2)
    assert head_on.along == -1.0 and overtaken.along == 1.0
    for meeting in (head_on, overtaken):
        at = drive.at(meeting.point, meeting.along)
        assert at is not None and at[0] * meeting.weight == pytest.approx(1.0)


def test_drives_set_out_whenever_people_begin_anew() -> None:
    """Whoever stands ahead after one beginning and behind after the next is not passed by that."""
    way = resampled(np.array([[0.0, 0.0], [LONG, 0.0]]))
    stamps = np.arange(0.0, 15.0, 1.0 / 30.0)
    drive = passings_of(stamps, np.column_stack((SPEED * stamps, np.zeros_like(stamps))), way)
    places = np.zeros((400, 2, 4))
    places[:100, 0, 0], places[100:, 0, 0] = 50.0, 5.0
    places[:100, 1, 0], places[100:, 1, 0] = 10.0, 55.0
    people = Record(places, anew=100)
    assert [each.person for each in met_on_the_way(people, way, drive)] == [1]
    assert passed(people, way, drive, len(way.points)) == (1.0, 1.0)


def test_missions_with_a_hit_come_in_turns_with_others() -> None:
    whole = {episode: int(episode % 5 == 0) for episode in range(20)}
    order = list(in_turns(whole))
    assert sorted(order) == list(range(20))
    assert [whole[each] for each in order[:12]] == [1, 0, 0] * 4


def test_strata_are_weighted_by_their_shares_of_all_missions() -> None:
    values = np.array([1.0, 0.0, 0.0, 0.2])
    mean, variance = weighted(values, np.array([True, True, False, False]), np.array([0.9, 0.1]))
    assert mean == pytest.approx(0.9 * 0.1 + 0.1 * 0.5)
    assert variance == pytest.approx(0.81 * 0.02 / 2 + 0.01 * 0.5 / 2)


def test_the_table_tells_both_kinds_of_meetings_and_their_ratio() -> None:
    whole = {episode: int(episode < 10) for episode in range(100)}
    found = [
        Counted(0, 1, 1.0, 0.1, (2, 4), (1.0, 5.0)),
        Counted(1, 1, 0.0, 0.3, (0, 2), (1.0, 1.0)),
        Counted(50, 0, 0.0, 0.0, (0, 1), (0.0, 1.0)),
    ]
    assert printed(found, whole) == "too few missions to tell"
    last = Counted(51, 0, 0.0, 0.1, (1, 1), (0.5, 1.0))
    lines = printed([*found, last], whole).splitlines()
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[2:5]]
    assert rows[0] == ["whole deliveries", "100", "0.100 [0.041, 0.159]", ""]
    assert rows[1][2:] == ["0.050 [0.000, 0.148]", "0.500 [0.000, 1.480]"]
    assert rows[2][2].startswith("0.065 [") and rows[2][3].startswith("0.650 [")
    assert lines[-3].endswith("again in 1 of 2 missions, hit in meetings alone in 0 of 2")
    # 0.1 x 1.0 + 0.9 x 0.5 people, of whom Palm's law gives 0.1 x 1.0 + 0.9 x 0.25
    assert lines[-2].startswith(
        "passed within 0.5 m of the way: 0.550 people a delivery, by Palm's"
    )
    assert "law 0.591 [" in lines[-2]
    assert "within 4 m of the way: 1.200 people a delivery" in lines[-1] and "1.000" in lines[-1]


def test_people_are_counted_where_they_are_drawn() -> None:
    """As many as Palm's law says, of people who come at all times."""
    way = resampled(np.array([[0.0, 0.0], [LONG, 0.0]]))
    stamps = np.arange(0.0, LONG / SPEED, 1.0 / 30.0)
    drive = passings_of(stamps, np.column_stack((SPEED * stamps, np.zeros_like(stamps))), way)
    times = STEP * np.arange(3000)
    crowd = np.zeros((len(times), 80, 4))
    begins = np.random.default_rng(0).uniform(0.0, 200.0, 80)
    crowd[:, :, 0] = (begins - times[:, None]) % 200.0 - 50.0
    crowd[:, :, 1] = np.where(np.arange(80) < 40, 0.2, 3.0)
    crowd[:, :, 2] = -1.0
    near, every = expected(pool_of(Record(crowd), way, 2.0), drive)
    # 80 in 200 m, 1.5 of whom a metre are passed on the 58 m on which people are drawn
    assert every == pytest.approx(80.0 / 200.0 * 1.5 * 58.0, rel=0.02)
    assert near == pytest.approx(0.5 * every, rel=0.02)
    assert WITHIN == (0.5, 4.0)
