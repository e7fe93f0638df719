"""The parts of the expected-cost controller, each by its numbers."""

import math

import numpy as np
import pytest
from numpy.random import default_rng
from numpy.testing import assert_allclose, assert_array_equal

from navstack.control.controller import Surroundings
from navstack.control.decision import RUNNER_UP, SLOWER
from navstack.control.expected_cost import motions as library
from navstack.control.expected_cost.clearance import Clearance, _around, clearance_at
from navstack.control.expected_cost.decision_report import Cycle, alternatives, name_of, options
from navstack.control.expected_cost.expected_cost_controller import ExpectedCostController
from navstack.control.expected_cost.field import within
from navstack.control.expected_cost.motion_cost import TERMS, price_one
from navstack.control.expected_cost.people import corner_ahead
from navstack.control.expected_cost.rollout import turned, wrapped
from navstack.costmap.costmap import Costmap
from navstack.planning.cost_to_go import _free_cell, cost_to_go
from navstack.types import Path, Pose2D, RobotState, Track, Twist2D

from .expected_cost_twin import FOOTPRINT, GOAL, PARAMS, prediction, scene_of, street


@pytest.mark.parametrize("x", [20.03, 21.95, 22.1])
def test_who_reaches_the_edge_stays_before_it_and_gets_less_sure_from_shortly_before(x):
    """The wall is at 22.5 m, the edge 0.35 m before it.

    From x = 22.1 m the first step leads beyond.
    """
    t = PARAMS.step * np.arange(1, PARAMS.steps + 1)
    found = prediction((x, 12.0, 1.0, 0.0, 0.3, 0.0, 0.0))
    count = int((x + t < 22.15).sum())
    places = np.append(x, x + t)[np.minimum(np.arange(1, len(t) + 1), count)]
    assert_allclose(found.motion[0, :, 0], places)
    assert_array_equal(
        found.motion[0, :, 1:], [(12.0, float(n < count), 0.0) for n in range(len(t))]
    )
    hidden = np.maximum(t - max(t[count] - 0.3, 0.0), 0.0)
    assert found.std[0] == pytest.approx(0.05 + 0.06 * t + 0.6 * hidden)


@pytest.mark.parametrize("steps", [9, 20, 30, 31, 60])
def test_a_corner_is_the_first_place_nearer_to_an_edge_than_both_neighbours(steps):
    """Within the first 22 steps and not within the last eight, on random ground.

    The edge is downhill of the place.
    """
    rng = default_rng(steps)
    found = []
    for _ in range(40):
        metres = rng.uniform(0.72, 2.9, (40, 60)).astype(np.float32)
        metres.flags.writeable = False
        clearance = Clearance(
            metres, (-1.0, 2.0, 0.1), np.zeros((0, 0), dtype=np.float32), (0.0, 0.0, 0.1)
        )
        velocity = rng.uniform(-0.6, 0.6, 2)
        place = rng.uniform((1.0, 3.0), (3.0, 5.0))
        ways = place + 0.12 * np.arange(steps + 1)[:, None] * velocity
        near = [clearance_at(clearance, *each) for each in ways]
        lows = [
            k
            for k in range(min(steps - 8, 22))
            if min(near[max(k - 1, 0)], near[k + 1], 0.85) >= near[k] != 0.85
        ]
        motion = np.column_stack((ways[1:], np.tile(velocity, (steps, 1))))
        expected = (-1, 0.0)
        if lows:
            x, y = ways[lows[0]]
            uphill = [
                clearance_at(clearance, x + a, y + b) - clearance_at(clearance, x - a, y - b)
                for a, b in ((0.3, 0.0), (0.0, 0.3))
            ]
            is_left = np.dot(uphill, (-velocity[1], velocity[0])) < 0.0
            expected = lows[0], 1.0 if is_left else -1.0
        walker = np.array((*place, *velocity, 0.3, 0.0, 0.0))
        assert corner_ahead.py_func(walker, motion, clearance) == expected
        found.append(expected)
    assert {side for _, side in found} == {-1.0, 0.0, 1.0}


@pytest.mark.parametrize(
    ("middle", "cells"),
    [(20.0, (28, 52)), (2.0, (0, 16)), (47.9, (83, 100)), (-10.0, (0, 0)), (60.0, (100, 100))],
)
def test_what_is_looked_at_ends_six_metres_off_and_with_the_grid(middle, cells):
    assert _around(middle, 0.5, 100) == cells


def test_a_corridor_ends_with_the_map():
    costs = np.arange(30, dtype=np.uint8).reshape(5, 6)
    # in the first cell, and in row 3 of column 4
    plan = Path(np.array(((1.5, 2.5, 0.0), (5.2, 5.9, 0.0))))
    walled = within(Costmap(costs, 1.0, 1.0, 2.0), plan, 1.0).data
    expected = np.full_like(costs, 254)
    expected[:2, :2] = costs[:2, :2]
    expected[2:, 3:] = costs[2:, 3:]
    assert_array_equal(walled, expected)


@pytest.mark.parametrize(
    ("x", "y", "cell"), [(1.5, 1.5, 24), (5.5, 2.5, 11), (0.5, 4.5, 24), (-3.0, 9.0, 24)]
)
def test_a_goal_in_an_obstacle_is_that_of_the_nearest_free_cell(x, y, cell):
    costs = np.full((5, 6), 254, dtype=np.uint8)
    costs[1, 5] = costs[4, 0] = 0
    assert _free_cell(Costmap(costs, 1.0, 0.0, 0.0), Pose2D(x, y)) == cell
    assert _free_cell(Costmap(np.full_like(costs, 254), 1.0, 0.0, 0.0), Pose2D(1.5, 1.5)) == 7


@pytest.mark.parametrize(
    ("angle", "expected"), [(4.0, 4.0 - 2.0 * math.pi), (-4.0, 2.0 * math.pi - 4.0), (3.0, 3.0)]
)
def test_angles_are_wrapped_once(angle, expected):
    assert wrapped.py_func(angle) == expected


@pytest.mark.parametrize("angle", [-0.1, 0.02, 0.1])
def test_small_turns_are_those_of_sine_and_cosine(angle):
    found = turned.py_func(math.cos(0.7), math.sin(0.7), angle)
    assert found == pytest.approx((math.cos(0.7 + angle), math.sin(0.7 + angle)), abs=3e-9)


def test_swerves_come_back_for_half_as_long():
    motions = library.many(2.0, 1.0, 1.8)
    back = motions[motions[:, library.TURN_2] != 0.0]
    times = [(time, angle) for angle in (8, 18, 32, 50, 75) for time in (0.8, 1.6, 2.6)]
    expected = sorted(
        (
            v,
            sign * math.radians(angle),
            0.6 * time,
            v,
            -0.6 * sign * math.radians(angle),
            0.5 * time,
            v,
        )
        for v in (0.0, 0.35, 0.7, 1.0, 1.3, 1.6, 2.0)
        for sign in (-1.0, 1.0)
        for time, angle in times
    )
    assert_allclose(sorted(back[:, [1, 2, 3, 5, 6, 7, 8]].tolist()), expected)
    assert not back[:, [library.KIND, library.KIND_2]].any()


def test_variations_are_normal_and_within_the_speeds():
    motions = np.array(
        (
            (0.0, 1.9, 0.1, 0.1, 0.0, -0.4, 0.0, 9.0, 2.0),
            (1.0, 0.5, 0.9, 1.0, 0.0, 2.0, 0.2, 9.0, 2.0),
        )
    )
    found = library.varied(motions, 50, 2.0, 0.5, default_rng(3))
    draws = default_rng(3).standard_normal((100, 9))
    expected = np.repeat(motions, 50, axis=0) + draws * (
        0.0,
        0.25,
        0.2,
        0.25,
        0.0,
        0.25,
        0.15,
        0.0,
        0.0,
    )
    expected[:, [1, 5]] = expected[:, [1, 5]].clip(-0.5, 2.0)
    expected[:, 3] = np.maximum(expected[:, 3], 0.0)
    assert_allclose(found, expected)


def decided(*stamps):
    """A controller that has decided at some times, with somebody ahead."""
    controller = ExpectedCostController(PARAMS, FOOTPRINT, 15.0, 0.5, street(), cost_to_go)
    controller.seed(default_rng(1))
    plan = Path(np.array(((15.0, 5.0, math.pi / 2), (GOAL.x, GOAL.y, GOAL.yaw))))
    pose = Pose2D(15.0, 10.0, math.pi / 2)
    for stamp in stamps:
        person = Track(0, stamp, 15.0, 13.0, 0.0, -1.0, 0.3, np.diag((0.0025, 0.0025, 0.01, 0.01)))
        controller.compute_velocity(
            RobotState(pose, Twist2D(1.5), stamp, pose), plan, Surroundings(street(), (person,))
        )
    return controller


def test_the_chosen_motions_way_is_the_first_option():
    controller = decided(0.0)
    cycle = controller._cycle
    options = controller.options
    states = np.empty((PARAMS.steps, 7))
    total = price_one(cycle.chosen, cycle.scene, np.empty(len(TERMS)), states)
    assert options[0].total == total
    assert_array_equal(options[0].path, [(15.0, 10.0), *states[::3, :2].tolist()])
    costs: dict[str, float] = {}
    for motion in cycle.motions:
        usd = price_one(motion, cycle.scene, np.empty(len(TERMS)), states)
        costs[name_of(motion)] = min(usd, costs.get(name_of(motion), math.inf))
    del costs[name_of(cycle.chosen)]
    assert [option.total for option in options[1:]] == sorted(costs.values())[:3]


@pytest.mark.parametrize(("later", "is_kept"), [(0.49, True), (0.51, False)])
def test_what_was_chosen_half_a_second_ago_is_of_no_use(later, is_kept):
    controller = decided(0.0)
    last = controller._last
    controller = decided(0.0, later)
    expected = library.later(last, later) if is_kept else controller._search._few[0]
    assert_array_equal(controller._cycle.motions[0], expected)


@pytest.mark.parametrize("seed", range(3))
def test_what_is_told_of_other_motions_is_the_best_of_all_that_were_compared(seed):
    scene = scene_of(default_rng(seed), 4)
    motions = library.many(2.0, 2.0, 1.8)
    terms, states = np.empty(len(TERMS)), np.empty((PARAMS.steps, 7))
    totals, speeds = [], []
    for motion in motions:
        totals.append(price_one(motion, scene, terms, states))
        speeds.append(abs(states[0, 3]))
    chosen = int(np.argmin(totals))
    cycle = Cycle(0.0, scene, motions, motions[chosen], Twist2D())
    kinds = [name_of(motion) for motion in motions]
    others = [k for k, kind in enumerate(kinds) if kind != kinds[chosen]]
    slower = [k for k, speed in enumerate(speeds) if speed <= 0.5 * speeds[chosen]]
    expected = {
        kind: min(totals[k] for k in each)
        for kind, each in ((RUNNER_UP, others), (SLOWER, slower))
        if each
    }
    assert {each.kind: each.total for each in alternatives(cycle)} == expected
    drawn = [each.total for each in options(cycle)]
    assert drawn[0] == totals[chosen] and drawn[1] == min(totals[k] for k in others)
    assert len(drawn) == min(4, len(set(kinds)))
