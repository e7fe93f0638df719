"""People do again what they did."""

import math

import numpy as np
import pytest

from harness.meetings import crowd
from harness.meetings.crowd import STEP, Record, StagedPeople, StagedWalkers, recorded
from harness.storage.shipped import shipped
from harness.world.people.params import PedestrianParams
from harness.world.people.social_force import SocialForcePedestrians
from harness.world.physics.body_state import BodyState
from harness.world.physics.robot import RobotParams
from navstack.costmap.occupancy_grid import FREE, OccupancyGrid
from navstack.params.strict import load_dataclass
from navstack.types import Pose2D

PLAZA = OccupancyGrid(np.full((80, 80), FREE, dtype=np.int8), 0.5, Pose2D())
PARAMS = PedestrianParams(model="social_force", count=12, beginning="stationary")
ROBOT = load_dataclass(RobotParams, shipped("params") / "robots" / "segway_e1.yaml")
ALL = np.zeros(12, dtype=np.bool_)  # hidden: nobody


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


@pytest.fixture(scope="module")
def walkers() -> Record:
    """Half a minute of people who make way, on a plaza of 40 m."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(crowd, "LONG", 30.0)
        people = SocialForcePedestrians(PARAMS, PLAZA, ROBOT)
        return recorded(people, np.random.default_rng(3), Pose2D(20.0, 20.0))


def shown(record: Record, moment: float, robot: Pose2D) -> StagedWalkers:
    """People who have walked for five seconds from a moment on, beside a robot that stands."""
    people = StagedWalkers(12)
    people.reset(np.random.default_rng(0), Pose2D())
    people.show(record, moment, ALL)
    for _ in range(50):
        people.see_robot(BodyState(robot.x, robot.y, robot.yaw))
        people.step(STEP)
    return people


@pytest.mark.parametrize("moment", [0, 37, 120])
def test_who_makes_way_goes_on_as_recorded_where_no_robot_is(walkers: Record, moment: int) -> None:
    assert len(walkers.states) == 300
    np.testing.assert_array_equal(walkers.walkers_at(moment).states, walkers.states[moment])
    alone = shown(walkers, moment, Pose2D(1e6, 1e6))
    np.testing.assert_array_equal(alone.states, walkers.states[moment + 50])
    again = shown(walkers, moment, Pose2D(1e6, 1e6))
    np.testing.assert_array_equal(again.states, alone.states)


def test_between_two_moments_they_are_on_their_way(walkers: Record) -> None:
    places = [walkers.walkers_at(moment).states[:, :2] for moment in (40, 40.5, 41)]
    np.testing.assert_allclose(places[1], (places[0] + places[2]) / 2.0, atol=0.01)


def test_they_make_way_for_a_robot_in_their_way(walkers: Record) -> None:
    moment = 100
    speeds = np.hypot(*walkers.states[moment, :, 2:].T)
    person = int(speeds.argmax())
    ahead = walkers.states[moment + 25, person, :2]
    met = shown(walkers, moment, Pose2D(*ahead.tolist(), 0.0)).states[:, :2]
    moved = np.hypot(*(met - walkers.states[moment + 50, :, :2]).T)
    assert moved[person] > 0.1
    assert np.median(moved) < 0.01


def test_who_makes_way_can_be_pushed_hidden_and_sent_away(walkers: Record) -> None:
    people = StagedWalkers(12)
    people.reset(np.random.default_rng(0), Pose2D())
    people.displaced(0, 1.0, 2.0, 0.0, 0.0)
    assert np.isinf(people.states[:, :2]).all(), "nobody is there to be pushed"
    people.show(walkers, 10.0, np.arange(12) == 4)
    people.displaced(0, 1.0, 2.0, 0.0, 0.0)
    assert people.states[0].tolist() == [1.0, 2.0, 0.0, 0.0]
    assert math.isinf(people.states[4, 0]) and np.isfinite(np.delete(people.states, 4, 0)).all()
    people.leave()
    people.step(STEP)
    assert np.isinf(people.states[:, :2]).all()


def test_people_who_make_way_begin_anew_before_they_wedge_each_other(walkers: Record) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(crowd, "LONG", 8.0)
        patch.setattr(crowd, "YOUNG", 4.0)
        people = SocialForcePedestrians(PARAMS, PLAZA, ROBOT)
        record = recorded(people, np.random.default_rng(3), Pose2D(20.0, 20.0))
    assert (record.span, record.beginning(39), record.beginning(41)) == (40, 0, 40)
    np.testing.assert_array_equal(record.states[:40], walkers.states[:40])
    assert (record.states[40, :, 2:] == 0.0).all() and (record.states[39, :, 2:] != 0.0).any()
    np.testing.assert_array_equal(record.walkers_at(57).states, record.states[57])
