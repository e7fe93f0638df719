"""The delay of people: against sums by hand, and a crowd that walks alone from the start."""

import math
from pathlib import Path

import numpy as np
import pytest

from harness.episode.pedestrian_delay import ErrandBook, PedestrianDelay, total_delay
from harness.storage.shipped import shipped
from harness.world.people.params import PedestrianParams
from harness.world.people.pedestrians import RandomWalkPedestrians
from harness.world.people.social_force import SocialForcePedestrians
from harness.world.physics.body_state import BodyState
from harness.world.physics.robot import RobotParams
from harness.world.truth import Truth
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.params.strict import load_dataclass
from navstack.types import Pose2D, Twist2D

DT, STEPS = 1.0 / 60.0, 2
CORRIDOR = OccupancyGrid(np.zeros((30, 300), dtype=np.int8), 0.1, Pose2D())  # 30 m long, 3 m wide
ROBOT = load_dataclass(RobotParams, Path(shipped("params")) / "robots" / "segway_e1.yaml")
SOCIAL = PedestrianParams(model="social_force", count=6, start_clearance=0.0)


def crowd(params: PedestrianParams = SOCIAL) -> SocialForcePedestrians:
    model = SocialForcePedestrians(params, CORRIDOR, ROBOT)
    model.reset(np.random.default_rng(5), Pose2D(1000.0, 0.0))
    return model


def truth(people: SocialForcePedestrians, stamp: float, x: float, y: float) -> Truth:
    return Truth(stamp, Pose2D(x, y), 0.0, Twist2D(), people.states, (), (), None)


def walk(people, seconds: float, x: float, y: float) -> PedestrianDelay:
    """People walk while a robot stands at (x, y) [m]."""
    delay = PedestrianDelay(people, truth(people, 0.0, x, y), STEPS, DT)
    for k in range(round(seconds / (STEPS * DT))):
        people.see_robot(BodyState(x, y, 0.5 * math.pi))
        for _ in range(STEPS):
            people.step(DT)
        delay.record(truth(people, (k + 1) * STEPS * DT, x, y))
    return delay


def test_the_delay_is_taken_at_the_first_errand_that_somebody_has_not_finished() -> None:
    held_up = [[10.0, 30.0], [12.0, 20.0, 50.0], [9.0]]
    free = [[8.0, 27.0], [11.0, 21.0], [10.0, 40.0]]
    assert total_delay(held_up, free) == (30.0 - 27.0) + (20.0 - 21.0) + (9.0 - 10.0)


def test_an_errand_takes_its_way_and_its_pause() -> None:
    errands = crowd().errands
    errands.points[0, :3] = ((0.0, 1.0), (3.0, 1.0), (3.0, 5.0))
    errands.counts[0], errands.next_point[0], errands.pauses[0], errands.speeds[0] = 3, 1, 2.5, 0.5
    positions = np.zeros((6, 2))
    positions[0] = (1.0, 1.0)
    assert errands.time_left(positions)[0] == pytest.approx((2.0 + 4.0) / 0.5 + 2.5)
    errands.next_point[0] = 3  # stands at the goal
    assert errands.time_left(np.array([(3.0, 5.0)] * 6))[0] == pytest.approx(2.5)


def test_the_book_keeps_when_errands_were_finished() -> None:
    errands = crowd().errands
    book = ErrandBook(errands)
    for stamp in (1.0, 2.0, 3.0):
        if stamp == 2.0:
            errands.set_out(4)
        book.look(stamp)
    times = book.finishing_times(3.0, np.zeros((6, 2)))
    assert times[4][0] == 2.0 and times[4][1] > 3.0
    assert [len(each) for each in times] == [1, 1, 1, 1, 2, 1]


def test_a_robot_far_away_delays_nobody() -> None:
    people = crowd()
    delay = walk(people, 20.0, 500.0, 0.0)
    assert delay.total(truth(people, 20.0, 500.0, 0.0)) == 0.0


def test_a_robot_across_the_way_delays_and_its_twin_is_a_crowd_that_walks_alone() -> None:
    people, alone = crowd(), crowd()
    delay = walk(people, 40.0, 15.0, 1.5)
    for _ in range(round(40.0 / DT)):
        alone.step(DT)
    assert np.array_equal(delay._twin.states, alone.states)
    assert np.array_equal(delay._twin.errands.finished, alone.errands.finished)
    assert alone.errands.finished.sum() > 0
    total = delay.total(truth(people, 40.0, 15.0, 1.5))
    assert 0.5 < total < 40.0


def test_people_who_do_not_make_way_have_no_delay() -> None:
    people = RandomWalkPedestrians(PedestrianParams(count=3, start_clearance=0.0), CORRIDOR)
    people.reset(np.random.default_rng(5), Pose2D(1000.0, 0.0))
    assert walk(people, 1.0, 15.0, 1.5).total(truth(people, 1.0, 15.0, 1.5)) is None
    nobody = crowd(PedestrianParams(model="social_force", count=0))
    begin = truth(nobody, 0.0, 0.0, 0.0)
    assert PedestrianDelay(nobody, begin, STEPS, DT).total(begin) is None
