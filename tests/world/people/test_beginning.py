"""People who are somewhere along their errands when a delivery begins, against renewal theory.

Goals taken in turn.
"""

import dataclasses

import numpy as np
import pytest

from harness.world.people.params import PedestrianParams
from harness.world.people.pedestrians import RandomWalkPedestrians
from harness.world.people.routes import WalkingNetwork
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.errors import ParameterError, UnknownNameError
from navstack.types import Pose2D

AWAY = Pose2D(1000.0, 1000.0)
PAUSES = 2.0, 5.0  # [s]
WALK = PedestrianParams(
    count=1500,
    goals=12,
    speed_std=0.0,
    goal_choice="in_turn",
    beginning="stationary",
    start_clearance=1.0,
)


def town():
    """Streets around four blocks, 20 m x 20 m."""
    free = np.ones((200, 200), dtype=np.bool_)
    for y, x in ((25, 25), (25, 112), (112, 25), (112, 112)):
        free[y : y + 62, x : x + 62] = False
    return OccupancyGrid(np.where(free, 0, 100).astype(np.int8), 0.1, Pose2D(-3.0, 2.0, 0.4))


@pytest.fixture(scope="module")
def crowd():
    people = RandomWalkPedestrians(WALK, town())
    people.reset(np.random.default_rng(3), AWAY)
    return people


def leg_lengths(crowd):
    """Length [m] of every errand between two different goals (N,), all pairs alike."""
    network, goals = crowd._errands.network, crowd._errands.goals
    pairs = [(a, b) for a in goals for b in goals if (a != b).any()]
    return np.array([np.hypot(*np.diff(network.route(a, b), axis=0).T).sum() for a, b in pairs])


def is_standing(crowd):
    return (crowd.states[:, 2:] == 0.0).all(axis=1)


def test_people_pause_for_their_share_of_the_time(crowd):
    """Standing share: E[pause] / (E[way] / speed + E[pause])."""
    share = np.mean(PAUSES) / (leg_lengths(crowd).mean() / WALK.speed + np.mean(PAUSES))
    deviation = np.sqrt(share * (1.0 - share) / WALK.count)
    assert 0.1 < share < 0.5
    assert abs(is_standing(crowd).mean() - share) < 3.0 * deviation


def test_long_errands_are_met_in_proportion_to_their_duration(crowd):
    """Mean of the errand that is going on: E[D^2] / E[D].

    Of what is left of it: half as much (inspection paradox).
    """
    ways, (low, high) = leg_lengths(crowd) / WALK.speed, PAUSES
    mean = ways.mean() + 0.5 * (low + high)
    square = (
        (ways**2).mean() + (low + high) * ways.mean() + (low * low + low * high + high * high) / 3.0
    )
    left = crowd._errands.time_left(crowd.states[:, :2])
    deviation = left.std() / np.sqrt(WALK.count)
    assert left.mean() == pytest.approx(0.5 * square / mean, abs=3.0 * deviation)
    assert abs(left.mean() - 0.5 * mean) > 5.0 * deviation  # which all errands alike would give


def test_goals_are_as_likely_as_their_errands_are_long(crowd):
    network, goals = crowd._errands.network, crowd._errands.goals
    durations = np.zeros(len(goals))
    for k, goal in enumerate(goals):
        for start in goals:
            if (start != goal).any():
                way = np.hypot(*np.diff(network.route(start, goal), axis=0).T).sum()
                durations[k] += way / WALK.speed + np.mean(PAUSES)
    shares = durations / durations.sum()
    heading = (crowd._errands._cells[:, None] == goals).all(axis=2).mean(axis=0)
    assert (np.abs(heading - shares) < 4.0 * np.sqrt(shares / WALK.count)).all()


def test_the_state_is_the_same_a_minute_later():
    """Of independent walkers (goals at random), to be told from those who all set out at once."""
    shares = {}
    for beginning in ("stationary", "setting_out"):
        who = dataclasses.replace(WALK, goal_choice="random", beginning=beginning)
        people = RandomWalkPedestrians(who, town())
        people.reset(np.random.default_rng(5), AWAY)
        shares[beginning] = [is_standing(people).mean()]
        for _ in range(6):
            people.steps(0.1, 100)
            shares[beginning].append(is_standing(people).mean())
    assert np.ptp(shares["stationary"]) < 6.0 * np.sqrt(0.25 / WALK.count)
    assert shares["setting_out"][0] == 0.0


def test_everybody_stands_or_walks_on_the_way(crowd):
    errands = crowd._errands
    for i, (x, y, vx, vy) in enumerate(crowd.states):
        if vx == vy == 0.0:
            assert (x, y) == pytest.approx(
                tuple(errands.network.positions(errands._cells[i : i + 1])[0])
            )
            assert 0.0 < errands.pauses[i] <= PAUSES[1]
        else:
            ahead = errands.points[i, errands.next_point[i]] - (x, y)
            assert np.cross(np.append(ahead, 0.0), (vx, vy, 0.0))[2] == pytest.approx(0.0, abs=1e-6)
            assert PAUSES[0] <= errands.pauses[i] <= PAUSES[1]


def test_nobody_begins_near_the_robot():
    people = RandomWalkPedestrians(dataclasses.replace(WALK, count=300), town())
    robot = Pose2D(2.0, 14.0)
    people.reset(np.random.default_rng(1), robot)
    assert np.hypot(*(people.states[:, :2] - (robot.x, robot.y)).T).min() >= 1.0


def test_goals_are_taken_in_turn_by_all():
    people = RandomWalkPedestrians(dataclasses.replace(WALK, count=5, goals=7), town())
    people.reset(np.random.default_rng(2), AWAY)
    errands, taken = people._errands, []
    before = errands._cells.copy()
    for _ in range(3000):
        people.step(0.1)
        for i in np.flatnonzero((errands._cells != before).any(axis=1)):
            taken.append(errands._cells[i].tolist())
        before = errands._cells.copy()
    listed = errands.goals.tolist()
    order = [listed.index(goal) for goal in taken]
    steps = np.diff(order) % 7
    assert len(order) > 30
    # 2: one who stood at the next goal took another
    assert (steps == 1).mean() > 0.7 and set(steps.tolist()) <= {1, 2}


def test_the_next_goal_is_taken_though_it_is_in_the_same_row_or_column():
    people = RandomWalkPedestrians(dataclasses.replace(WALK, count=1, goals=3), town())
    people.reset(np.random.default_rng(2), AWAY)
    errands = people._errands
    errands.goals, errands._turn = np.array(((5, 5), (5, 9), (8, 9))), 0
    taken, here = [], errands.goals[0]
    for _ in range(4):
        here = errands._next_goal(here)
        taken.append(here.tolist())
    assert taken == [[5, 9], [8, 9], [5, 5], [5, 9]]  # the first turn is that of who stands there


class Drawn:
    """A random generator that draws what a test says, and knows what it was asked for."""

    def __init__(self, *values):
        self._values, self.asked = list(values), []

    def uniform(self, low, high):
        self.asked.append((low, high))
        return self._values.pop(0)


def test_an_errand_is_accepted_in_proportion_to_what_it_lasts():
    """Goals in a row, 2 m and 4 m apart, walked at 0.5 m/s.

    The first draw is refused, the second one is not.
    """
    field = OccupancyGrid(np.zeros((60, 60), dtype=np.int8), 0.2, Pose2D())
    people = RandomWalkPedestrians(dataclasses.replace(WALK, count=1, agent_radius=0.0), field)
    errands, own = people._errands, Drawn(10.0, 3.0, 15.0, 9.9, 2.5, 6.4, 4.2)
    errands.goals, errands._rngs, errands.speeds[0] = (
        np.array(((10, 5), (10, 15), (10, 35))),
        [own],
        0.5,
    )
    pairs, bounds = np.array((1, 2, 3, 5, 6, 7)), np.array((10.0, 20.0, 10.0, 10.0, 20.0, 10.0))
    assert errands._draw_errand(0, pairs, bounds, np.cumsum(bounds)) == 4.2
    again = [(0.0, 80.0), PAUSES, (0.0, 10.0), (0.0, pytest.approx(4.0 + 2.5))]
    assert own.asked == [(0.0, 80.0), PAUSES, (0.0, 20.0), *again]
    assert errands._cells.tolist() == [[10, 15]] and errands.pauses[0] == 2.5


@pytest.mark.parametrize(
    ("time", "place", "corner", "pause"),
    [
        (0.0, (1.0, 1.0), 1, 4.0),
        (3.0, (2.5, 1.0), 1, 4.0),
        (9.0, (4.0, 2.5), 2, 4.0),
        (15.0, (4.0, 5.0), 3, 3.0),
    ],
)
def test_somebody_on_the_way_is_as_far_as_the_speed_says(time, place, corner, pause):
    """A path of 3 m and 4 m at 0.5 m/s, and the pause at its end."""
    field = OccupancyGrid(np.zeros((60, 60), dtype=np.int8), 0.2, Pose2D())
    errands = RandomWalkPedestrians(dataclasses.replace(WALK, count=1), field)._errands
    errands.points[0, :3] = ((1.0, 1.0), (4.0, 1.0), (4.0, 5.0))
    errands.counts[0], errands.speeds[0], errands.pauses[0] = 3, 0.5, 4.0
    assert errands._go_ahead(0, time).tolist() == pytest.approx(place)
    assert (errands.next_point[0], errands.pauses[0]) == (corner, pause)


def test_the_same_seed_begins_alike_whatever_was_before():
    one, other = (
        RandomWalkPedestrians(dataclasses.replace(WALK, count=20), town()) for _ in range(2)
    )
    other.reset(np.random.default_rng(9), AWAY)
    other.steps(0.1, 500)
    for people in (one, other):
        people.reset(np.random.default_rng(4), AWAY)
        people.steps(0.1, 300)
    assert np.array_equal(one.states, other.states)


def test_a_single_goal_and_a_single_cell_work():
    cell = np.full((9, 9), 100, dtype=np.int8)
    cell[4, 4] = 0
    people = RandomWalkPedestrians(
        dataclasses.replace(WALK, count=3), OccupancyGrid(cell, 1.0, Pose2D())
    )
    people.reset(np.random.default_rng(0), Pose2D(4.5, 4.5))
    people.steps(0.1, 200)
    assert (people.states == (4.5, 4.5, 0.0, 0.0)).all()


def test_lengths_are_bounds_of_the_routes(tmp_path, monkeypatch):
    monkeypatch.setenv("NAVSTACK_CACHE", str(tmp_path))
    network = WalkingNetwork(town(), 0.5)
    cells = network.cells[np.random.default_rng(0).integers(len(network.cells), size=12)]
    most = network.greatest_lengths(cells)
    for i, a in enumerate(cells):
        for j, b in enumerate(cells):
            way = np.hypot(*np.diff(network.route(a, b), axis=0).T).sum()
            assert way <= most[i, j] + 1e-6


@pytest.mark.parametrize(
    ("change", "error"),
    [
        ({"goal_choice": "nearest"}, UnknownNameError),
        ({"beginning": "asleep"}, UnknownNameError),
        ({"model": "social_force"}, ParameterError),  # with goals in turn
    ],
)
def test_impossible_beginnings_are_refused(change, error):
    with pytest.raises(error):
        dataclasses.replace(WALK, **change)
