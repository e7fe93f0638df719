"""How people lengthen ways, by numbers that can be worked out by hand."""

import dataclasses
import math

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from pytest import approx

from navstack.control.contact_risk import rows_of
from navstack.control.expected_cost import flow as flow_module
from navstack.control.expected_cost.clearance import map_clearance
from navstack.control.expected_cost.field import (
    cost_at,
    make_field,
    make_field_around,
    ways_of,
)
from navstack.control.expected_cost.flow import (
    PeopleFlow,
    cell_of,
    count_people,
    mark_seen,
    mean_rate,
    meeting_rate,
)
from navstack.control.expected_cost.goal_field import GoalField
from navstack.costmap.costmap import Costmap
from navstack.planning.cost_to_go import cost_to_go
from navstack.types import Path, Pose2D, RobotState, Track, Twist2D

from .expected_cost_twin import PARAMS

GOAL = Pose2D(20.0, 36.0, 0.0)
START = Pose2D(20.0, 4.0, 0.0)
CROWDED = dataclasses.replace(PARAMS, flow_weight=25.0, flow_memory=60.0)


def two_streets() -> Costmap:
    """A block of 12 m x 20 m in the middle of 40 m x 40 m; the way round is the same each side."""
    costs = np.zeros((800, 800), dtype=np.uint8)
    costs[:40] = costs[-40:] = 254
    costs[:, :40] = costs[:, -40:] = 254
    costs[200:600, 280:520] = 254
    return Costmap(costs, 0.05, 0.0, 0.0, costs.copy())


def person(x: float, y: float, vx: float = 0.0, vy: float = 0.0, stamp: float = 0.0) -> Track:
    return Track(id=1, stamp=stamp, x=x, y=y, vx=vx, vy=vy, radius=0.3, covariance=0.01 * np.eye(4))


def at(pose: Pose2D, stamp: float) -> RobotState:
    return RobotState(pose, Twist2D(), stamp, pose)


def plan() -> Path:
    return Path(np.array(((20.0, 4.0, 0.0), (10.0, 20.0, 0.0), (GOAL.x, GOAL.y, 0.0))))


@pytest.fixture(scope="module")
def world() -> Costmap:
    return two_streets()


@pytest.fixture
def flow(world: Costmap) -> PeopleFlow:
    return PeopleFlow(ways_of(world, 0.2), 60.0, 12.0, 2.0)


def test_who_comes_towards_the_robot_is_met_faster_than_who_walks_along(world: Costmap) -> None:
    """On the left street the way leads up, so that 1 m/s is half of the robot's speed."""
    field = make_field(ways_of(world, 0.2), Pose2D(10.0, 36.0, 0.0), cost_to_go)
    for velocity, expected in (((0.0, 2.0), 0.0), ((0.0, 0.0), 1.0), ((0.0, -1.0), 1.5)):
        assert meeting_rate(field, 10.0, 15.0, *velocity, 2.0) == approx(expected, abs=0.02)
    assert meeting_rate(field, 10.0, 15.0, 1.0, 0.0, 2.0) == approx(math.hypot(1.0, 0.5), abs=0.02)
    flat = field._replace(slope_x=0.0 * field.slope_x, slope_y=0.0 * field.slope_y)
    assert meeting_rate(flat, 10.0, 15.0, 0.0, -1.0, 2.0) == 1.0


def test_what_is_hidden_was_not_looked_at(world: Costmap, flow: PeopleFlow) -> None:
    """From before the block's corner: nothing behind it, and nothing beyond 12 m."""
    grid = flow._grid
    mark_seen(grid, map_clearance(world), 12.0, 8.0, 12.0)
    assert set(np.unique(grid.looks)) == {0.0, 1.0}
    for (x, y), is_seen in {
        (12.0, 8.0): True,
        (12.0, 19.0): True,
        (23.0, 8.5): True,
        (12.0, 21.5): False,  # too far
        (20.0, 15.0): False,  # in the block
        (23.0, 12.0): False,  # behind its edge
        (1.0, 8.0): False,  # in the wall
    }.items():
        assert (grid.looks[cell_of(grid, x, y)] == 1.0) == is_seen, (x, y)


def test_people_are_counted_where_they_are_and_where_they_walk_to(
    world: Costmap, flow: PeopleFlow
) -> None:
    """One walks up the left street, another into the block two metres before him."""
    grid = flow._grid
    field = make_field(ways_of(world, 0.2), GOAL, cost_to_go)
    people = rows_of([person(8.4, 8.4, 0.0, 1.6), person(11.6, 20.4, 1.6, 0.0)], 0.0)
    everywhere = np.ones(grid.looks.shape, dtype=np.bool_)
    count_people(grid, everywhere, map_clearance(world), field, people, 2.0)
    now = {cell_of(grid, 8.4, 8.4), cell_of(grid, 11.6, 20.4)}
    assert {tuple(each) for each in np.argwhere(grid.met > 0.0).tolist()} == now
    later = {cell_of(grid, 8.4, 8.4 + 1.6 * s) for s in range(1, 6)} | {cell_of(grid, 13.2, 20.4)}
    assert {tuple(each) for each in np.argwhere(grid.coming > 0.0).tolist()} == later


def test_who_is_not_looked_at_is_expected_but_not_counted_as_seen(
    world: Costmap, flow: PeopleFlow
) -> None:
    """One is 13 m away, one behind the block's corner, one in sight."""
    field = make_field(ways_of(world, 0.2), GOAL, cost_to_go)
    people = [person(7.0, 6.0), person(13.0, 14.0), person(19.0, 8.0)]
    flow.look(people, Pose2D(20.0, 6.0, 0.0), 0.0, map_clearance(world), field)
    grid = flow._grid
    places = [cell_of(grid, each.x, each.y) for each in people]
    assert [float(grid.looks[place]) for place in places] == [0.0, 0.0, 1.0]
    assert [float(grid.met[place]) for place in places] == approx([0.0, 0.0, 1.0])
    assert [float(grid.coming[place]) for place in places] == approx([5.0, 5.0, 5.0])


def test_nobody_lengthens_nothing(world: Costmap, flow: PeopleFlow) -> None:
    ways = ways_of(world, 0.2)
    field = make_field(ways, GOAL, cost_to_go)
    flow.look([], START, 0.0, map_clearance(world), field)
    assert_array_equal(flow.lengthen(ways, 1000.0).data, ways.data)


def test_a_person_who_stands_lengthens_ways_by_the_weight(world: Costmap, flow: PeopleFlow) -> None:
    """Summed over the ground: the mean of who was there and of who will be, which is one.

    Five looks of the average are added to the sixty that are remembered.
    """
    ways = ways_of(world, 0.2)
    field = make_field(ways, GOAL, cost_to_go)
    there = [person(8.4, 8.4)]
    for stamp in range(295):
        flow.look(there, Pose2D(10.0, 8.0, 0.0), float(stamp), map_clearance(world), field)
    looks = 1.0 / (1.0 - math.exp(-1.0 / 60.0))  # the rest has faded
    weight = 8.0
    dearer = (flow.lengthen(ways, weight).data.astype(float) - ways.data) / 62.5
    near = (np.s_[20:64], np.s_[20:64])
    was = looks / (looks + 5.0)
    assert dearer[near].sum() * 0.04 == approx(weight * 0.5 * (was + 1.0), rel=0.02)
    assert dearer[42, 42] == dearer.max() <= 252 / 62.5
    assert_allclose(mean_rate(flow._grid) * (flow._grid.looks > 0.0).sum(), 1.0, rtol=1e-6)


def test_what_was_seen_fades(world: Costmap, flow: PeopleFlow) -> None:
    field = make_field(ways_of(world, 0.2), GOAL, cost_to_go)
    clearance = map_clearance(world)
    flow.look([person(8.4, 8.4)], Pose2D(10.0, 8.0, 0.0), 3.0, clearance, field)
    cell = cell_of(flow._grid, 8.4, 8.4)
    before = flow._grid.met[cell]
    flow.look([], Pose2D(30.0, 30.0, 0.0), 33.0, clearance, field)
    assert flow._grid.met[cell] == approx(before * math.exp(-0.5))
    assert flow._grid.looks[cell] == approx(math.exp(-0.5))
    assert not flow._grid.coming.any()


@pytest.mark.parametrize("side", [10.0, 30.0])
def test_the_robot_goes_round_the_crowd(world: Costmap, side: float) -> None:
    """As the way on each side of the block is as long, the one without people is taken."""
    field = GoalField(CROWDED, world, cost_to_go)
    assert field.take(plan(), at(START, 0.0))
    before = field.way_left(START)
    crowd = [person(side + dx, 9.0 + dy, 0.0, -0.8) for dx in (-1.0, 0.0, 1.0) for dy in (0.0, 2.0)]
    field.look(crowd, at(START, 0.0), map_clearance(world))
    left, right = (cost_at(field.followed, x, 9.0) for x in (10.0, 30.0))
    assert (left > right + 1.0) == (side == 10.0)
    assert (right > left + 1.0) == (side == 30.0)
    assert field.way_left(START) == before, "patience and deadline go by the ways alone"
    assert field._flow is not None
    field.reset()
    assert field._flow is None


def test_people_are_looked_at_once_a_second_and_at_once_after_a_new_goal(world: Costmap) -> None:
    field = GoalField(CROWDED, world, cost_to_go)
    clearance = map_clearance(world)
    field.take(plan(), at(START, 0.0))
    made = [field.followed]
    for stamp in (0.0, 0.4, 0.99, 1.0, 1.5):
        field.look([], at(START, stamp), clearance)
        made.append(field.followed)
    is_new = [later is not earlier for earlier, later in zip(made, made[1:], strict=False)]
    assert is_new == [True, False, False, True, False]
    assert field.take(Path(np.array(((20.0, 4.0, 0.0), (20.0, 8.0, 0.0)))), at(START, 1.6))
    bare = field.followed
    field.look([], at(START, 1.6), clearance)
    assert field.followed is not bare


def test_without_a_weight_nobody_is_looked_at(world: Costmap) -> None:
    field = GoalField(PARAMS, world, cost_to_go)
    field.take(plan(), at(START, 0.0))
    bare = field.followed
    field.look([person(10.0, 9.0)], at(START, 0.0), map_clearance(world))
    assert field.followed is bare


def test_a_map_that_moves_along_begins_anew() -> None:
    """A rolling global costmap has other cells each time that the field is made."""
    world = two_streets()
    field = GoalField(CROWDED, world, cost_to_go)
    field.take(plan(), at(START, 0.0))
    field.look([person(10.0, 9.0)], at(START, 0.0), map_clearance(world))
    before = field._flow
    field.take(plan(), at(START, 1.0))
    field.look([], at(START, 1.0), map_clearance(world))
    assert field._flow is before
    world.origin_x += 1.0
    field.take(Path(np.array(((20.0, 4.0, 0.0), (20.0, 8.0, 0.0)))), at(START, 2.0))
    field.look([], at(START, 2.0), map_clearance(world))
    assert field._flow is not before


def test_a_cost_of_one_twenty_five_makes_a_metre_count_as_three(world: Costmap) -> None:
    """The scale of costs is that of NavFn's potential, of which the field is made."""
    ways = ways_of(world, 0.2)
    dear = Costmap(np.where(ways.data == 0, 125, ways.data).astype(np.uint8), 0.2, 0.0, 0.0)
    cheap = cost_at(make_field(ways, GOAL, cost_to_go), 20.0, 33.0)
    assert cost_at(make_field(dear, GOAL, cost_to_go), 20.0, 33.0) == approx(3.0 * cheap, rel=0.01)
    assert flow_module._COSTS == 125.0 / 2.0


@pytest.mark.parametrize("place", [(20.0, 8.0), (4.0, 30.0), (-50.0, 20.0), (41.0, 90.0)])
def test_around_a_pose_the_field_is_that_of_the_whole_map(
    world: Costmap, place: tuple[float, float]
) -> None:
    ways = ways_of(world, 0.2)
    whole = make_field(ways, GOAL, cost_to_go)
    part = make_field_around(ways, GOAL, cost_to_go, Pose2D(*place), 12.0)
    middle = np.clip(place, 0.0, 40.0)
    low = np.maximum(np.floor((middle - 6.0) / 0.2).astype(int), 0)
    near = np.s_[low[1] : low[1] + 45, low[0] : low[0] + 45]
    for one, other in zip(part[:3], whole[:3], strict=True):
        assert one[near].size
        assert_array_equal(one[near], other[near])
    assert np.isfinite(part.cost[near]).all()


def test_the_field_that_is_followed_is_the_crowds_as_far_as_motions_lead(world: Costmap) -> None:
    """The whole map's field of the same costs, 10 m around, where 8.6 m can be driven."""
    field = GoalField(CROWDED, world, cost_to_go)
    here = Pose2D(10.0, 14.0, 0.0)
    field.take(plan(), at(here, 0.0))
    field.look([person(10.0, 24.9, 0.0, -1.0)], at(here, 0.0), map_clearance(world))
    flow = field._flow
    assert flow is not None
    assert flow._grid.looks[cell_of(flow._grid, 10.0, 24.9)] == 1.0, "seen up to 12 m"
    assert (flow._memory, flow._reach, flow._speed) == (60.0, CROWDED.range, CROWDED.max_speed)
    ways = ways_of(world, 0.2)
    whole = make_field(flow.lengthen(ways, 25.0), GOAL, cost_to_go)
    near = np.s_[20:120, 10:100]
    is_open = ways.data[near] == 0
    for one, other in zip(field.followed[:3], whole[:3], strict=True):
        assert_array_equal(one[near][is_open], other[near][is_open])


def test_in_a_yard_without_a_way_out_the_field_leads_to_the_nearest_way() -> None:
    world = two_streets()
    world.data[210:590, 290:510] = 0  # the block is hollow
    ways = ways_of(world, 0.2)
    whole = make_field(ways, GOAL, cost_to_go)
    part = make_field_around(ways, GOAL, cost_to_go, Pose2D(20.0, 20.0), 3.0)
    assert_array_equal(part.slope_y, whole.slope_y)
    assert cost_at(part, 20.0, 20.0) == cost_at(whole, 20.0, 20.0) > 10.0
