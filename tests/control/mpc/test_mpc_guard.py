"""The command guard of the jerk-limited MPC: the robot can always stop, whatever the plan wants."""

import math

import numpy as np
import pytest
from numpy.random import default_rng
from pytest import approx
from shapely import Polygon, affinity, box, union_all

from navstack.control.mpc import command_guard
from navstack.control.mpc import stage_layout as at
from navstack.control.mpc.command_guard import (
    KEEP_CURVE,
    STRAIGHTEN,
    RobotOutline,
    _duration,
    _reach,
    guarded,
    stop_is_safe,
    stopped,
)
from navstack.control.mpc.people import FIELDS
from navstack.control.mpc.stop_profile import stop_distance, stop_time
from navstack.costmap.costmap import LETHAL_OBSTACLE, NO_INFORMATION

from ..given import DELIVERY_ROBOT
from .given import LIMITS, PERIOD, field_on

CIRCLES = np.array((-0.516, -0.2335, 0.049))
RADIUS = 0.332
BODY = RobotOutline(DELIVERY_ROBOT, CIRCLES, RADIUS)
NOBODY = np.empty((0, FIELDS))


def field_of(*boxes):
    """A map of 20 x 20 m about the origin with lethal boxes (x0, y0, x1, y1)."""
    costs = np.zeros((400, 400), dtype=np.uint8)
    for x0, y0, x1, y1 in boxes:
        left, low, right, high = (math.floor((value + 10.0) / 0.05) for value in (x0, y0, x1, y1))
        costs[low : high + 1, left : right + 1] = 254
    return field_on(costs, (-10.0, -10.0))


FREE = field_of()


def is_stop_safe(state, kind=STRAIGHTEN, field=FREE, people=NOBODY):
    return stop_is_safe(state, kind, PERIOD, LIMITS, field, BODY, people)


def guard(state, j, ja, kind=STRAIGHTEN, field=FREE, people=NOBODY):
    return guarded(state, j, ja, PERIOD, LIMITS, kind, field, BODY, people)


def driving(v, omega=0.0, x=0.0, y=0.0, yaw=0.0):
    """A state (7,) without acceleration."""
    return np.array((x, y, yaw, v, omega, 0.0, 0.0))


def walker(x, y, vx, vy):
    """People (1, FIELDS), who are where they seem to be."""
    return np.array([(x, y, vx, vy, 0.3, 0.0, 0.0, 0.0)])


def move(state, motion):
    """Carry the pose of a state (7,) to the end of a control period."""
    way = 0.5 * PERIOD * (state[3] + motion[0])
    turn = 0.5 * PERIOD * (state[4] + motion[1])
    state[0] += way * math.cos(state[2] + 0.5 * turn)
    state[1] += way * math.sin(state[2] + 0.5 * turn)
    state[2] += turn
    state[3:] = motion


def body(state):
    turned = affinity.rotate(Polygon(DELIVERY_ROBOT), state[2], (0, 0), use_radians=True)
    return affinity.translate(turned, state[0], state[1])


@pytest.mark.parametrize("seed", range(5))
def test_a_stop_along_the_curve_keeps_the_yaw_limits(seed):
    """Its duration is that of the speed.

    None where the yaw would have to be pushed or jerked too hard on the way.
    """
    rng = default_rng(seed)
    found = {True: 0, False: 0}
    for _ in range(100):
        state = driving(*rng.uniform((0.2, -1.3), (2.0, 1.3)))
        state[6] = rng.uniform(-2.5, 2.5)
        whole = stop_time(state[3], state[5], LIMITS[at.MAX_DECELERATION], LIMITS[at.MAX_JERK])
        times = np.linspace(0.0, whole, 401)
        paths = [stopped(*state[3:], KEEP_CURVE, LIMITS, float(time)) for time in times]
        pushes = np.array([path[3] for path in paths])
        jerks = np.diff([path[3] for path in paths]) / np.diff(times)
        pushed = abs(pushes[1:-1]).max() / LIMITS[at.MAX_YAW_ACCELERATION]
        jerked = abs(jerks).max() / LIMITS[at.MAX_YAW_JERK]
        if not 0.97 < max(pushed, jerked) < 1.03:  # too close to call by looking
            is_kept = max(pushed, jerked) < 1.0
            assert math.isnan(_duration(state, KEEP_CURVE, LIMITS)) != is_kept
            found[is_kept] += 1
    assert min(found.values()) >= 10


def test_a_blind_driver_touches_nothing():
    """Jerks drawn at random, mostly forwards.

    The outline never enters an obstacle by more than a cell.
    """
    rng = default_rng(21)
    stops = 0
    for _ in range(25):
        corners = rng.uniform(-7.0, 6.5, size=(14, 2))
        corners = corners[np.hypot(*(corners + 0.25).T) > 1.6]
        boxes = [(x, y, x + 0.5, y + 0.5) for x, y in corners.tolist()]
        field = field_of(*boxes)
        walls = union_all([box(*each) for each in boxes])
        state = np.zeros(7)
        kind = STRAIGHTEN
        state[2] = rng.uniform(-3.0, 3.0)
        for cycle in range(150):
            if cycle % 15 == 0:
                j = rng.uniform(-1.0, 5.0)
                ja = rng.normal(scale=5.0)
            motion, kind, share = guard(state, j, ja, kind, field)
            stops += share == 1.0
            move(state, motion)
            if np.abs(state[:2]).max() > 8.0:
                break
            assert body(state).intersection(walls).area < 0.05 * 0.3
            assert abs(state[3] * state[4]) <= LIMITS[at.MAX_LATERAL] + 1e-9
    assert stops > 20  # it was put to the test


@pytest.mark.parametrize("kind", [STRAIGHTEN, KEEP_CURVE])
def test_a_stop_that_is_called_safe_keeps_the_limits(kind):
    rng = default_rng(22)
    checked = 0
    for _ in range(300):
        state = np.zeros(7)
        state[3:] = rng.uniform((0.0, -1.2, -2.5, -2.5), (2.0, 1.2, 1.5, 2.5))
        if state[5] < 0.0 and state[3] < state[5] ** 2 / 10.0:  # it could not help rolling back
            continue
        if not is_stop_safe(state, kind):
            continue
        checked += 1
        times = np.arange(0, 90) * PERIOD
        motions = np.array([stopped(*state[3:], kind, LIMITS, time) for time in times])
        assert motions[-1] == approx(0.0, abs=1e-9)
        assert motions[:, 0].min() >= -1e-9
        assert np.abs(motions[:, 1]).max() <= 1.2 + 1e-9
        assert np.abs(motions[:, 0] * motions[:, 1]).max() <= 1.3 + 1e-9
        assert np.abs(motions[:, 2]).max() <= 2.5 + 1e-9
        assert np.abs(motions[:, 3]).max() <= 2.5 + 1e-9
        changes = np.abs(np.diff(motions[:, 2:], axis=0)) / PERIOD
        assert changes[:, 0].max() <= 5.0 + 1e-6
        assert changes[:, 1].max() <= 10.0 + 1e-6
    assert checked > 50


def test_the_least_share_of_the_stop_is_mixed_in_from_which_a_stop_is_safe():
    rng = default_rng(23)
    found = set()
    for _ in range(400):
        corners = rng.uniform((-1.0, -0.9), (1.8, 0.9), (3, 2))
        aside = corners[np.abs(corners[:, 1]) > 0.35].tolist()
        field = field_of(*((x, y, x + 0.1, y + 0.1) for x, y in aside))
        yaw, v, omega = rng.uniform((-0.1, 0.0, -0.8), (0.1, 1.5, 0.8))
        state = driving(v, omega, yaw=yaw)
        jerks = rng.uniform((-5.0, -10.0), (5.0, 10.0))
        wanted, _, free = guard(state, *jerks)
        assert free == 0.0
        braked = stopped(*state[3:], STRAIGHTEN, LIMITS, PERIOD)
        expected = None
        for share in (0.0, 0.25, 0.5, 0.75):
            motion = wanted + share * (braked - wanted)
            after = state.copy()
            move(after, motion)
            safe = [kind for kind in (KEEP_CURVE, STRAIGHTEN) if is_stop_safe(after, kind, field)]
            if safe and expected is None:
                expected = share, safe[0]
        motion, kind, share = guard(state, *jerks, field=field)
        assert (share, kind) == (expected or (1.0, STRAIGHTEN))
        assert motion == approx(wanted + share * (braked - wanted), abs=1e-12)
        found.add((share, kind))
    assert found >= {(0.0, KEEP_CURVE), (0.0, STRAIGHTEN), (0.25, STRAIGHTEN), (1.0, STRAIGHTEN)}


@pytest.mark.parametrize(("v", "omega"), [(1.7, 0.0), (0.0, 1.2)])
def test_between_looks_no_point_moves_more_than_a_cell_and_none_is_looked_at_needlessly(
    monkeypatch,
    v,
    omega,
):
    looks = []
    monkeypatch.setattr(command_guard, "_touches", lambda *place: looks.append(place[:3]))
    state = driving(v, omega, 0.3, -0.2, 0.4)
    assert stop_is_safe.py_func(state, STRAIGHTEN, PERIOD, LIMITS, FREE, BODY, NOBODY)
    steps = np.abs(np.diff(looks, axis=0))
    moved = np.hypot(steps[:, 0], steps[:, 1]) + math.hypot(0.657, 0.3) * steps[:, 2]
    assert looks[0] == (0.3, -0.2, 0.4)
    assert moved.max() <= 0.05 + 1e-12
    assert (moved[:-2] + moved[1:-1]).min() > 0.05
    length = stop_distance(v, 0.0, 2.5, 5.0) + math.hypot(0.657, 0.3) * stop_distance(
        omega, 0.0, 2.5, 10.0
    )
    assert moved.sum() == approx(length, abs=1e-3)  # trapezia from period to period


@pytest.mark.parametrize("kind", [STRAIGHTEN, KEEP_CURVE])
@pytest.mark.parametrize("speed", [0.9, 1.55])
def test_a_stop_is_looked_at_to_its_last_micrometre(speed, kind):
    speeds = [stopped(speed, 0.0, 0.0, 0.0, kind, LIMITS, i * PERIOD)[0] for i in range(60)]
    # the last period's way counts
    assert PERIOD * min(each for each in speeds if each > 0.0) > 1e-5
    # it begins at 2 m
    way = PERIOD * (sum(speeds) - 0.5 * speed)
    wall = field_of((2.02, -0.2, 2.02, 0.2))
    for rest in (1e-6, -1e-6):
        state = driving(speed, x=2.0 - 0.19 - way - rest)
        assert is_stop_safe(state, kind, wall) == (rest > 0.0)


def test_keeping_the_curve_stops_beside_an_obstacle_that_a_straight_stop_would_meet():
    state = driving(1.8, 0.7)
    field = field_of((1.0, -1.2, 2.2, -0.15))  # ahead on the right of a left turn
    assert is_stop_safe(state, KEEP_CURVE, field)
    assert not is_stop_safe(state, field=field)


@pytest.mark.parametrize("speed", [1.0, 1.5, 2.0])
def test_a_stop_through_a_wall_one_cell_deep_is_not_safe(speed):
    state = driving(speed)
    length = stop_distance(speed, 0.0, LIMITS[at.MAX_DECELERATION], LIMITS[at.MAX_JERK])
    # cells ahead of the front edge
    near = math.ceil(0.19 / 0.05)
    far = math.floor((0.19 + length) / 0.05)
    for cell in range(near, far):
        x = (cell + 0.5) * 0.05
        assert not is_stop_safe(state, field=field_of((x, -0.15, x, 0.15)))
    x = (far + 1.5) * 0.05
    assert is_stop_safe(state, field=field_of((x, -0.15, x, 0.15)))


def test_a_stop_of_a_turn_whose_rear_sweeps_over_a_post_is_not_safe():
    state = driving(0.0, 1.2)
    turned = stop_distance(1.2, 0.0, LIMITS[at.MAX_YAW_ACCELERATION], LIMITS[at.MAX_YAW_JERK])
    for share in np.linspace(0.1, 0.9, 30):
        yaw = share * turned
        x = -0.62 * math.cos(yaw) + 0.3 * math.sin(yaw)
        y = -0.62 * math.sin(yaw) - 0.3 * math.cos(yaw)
        field = field_of((x - 0.05, y - 0.05, x + 0.05, y + 0.05))
        assert not is_stop_safe(state, field=field)


def test_an_unknown_cell_under_the_outline_hides_no_lethal_one():
    field = field_of((0.19, 0.0, 0.19, 0.0), (-0.657, 0.0, -0.657, 0.0))  # front and rear edge
    for x, y in ((0.19, -0.2), (-0.2, -0.3)):  # on the front edge and on the side after it
        field.costs[math.floor((y + 10.0) / 0.05), math.floor((x + 10.0) / 0.05)] = NO_INFORMATION
        assert not is_stop_safe(np.zeros(7), field=field)
    field.costs[field.costs == LETHAL_OBSTACLE] = 0
    assert is_stop_safe(np.zeros(7), field=field)


@pytest.mark.parametrize(("vx", "is_safe"), [(-1.2, False), (1.5, True)])
def test_a_person_who_comes_is_stopped_for_and_one_who_leaves_is_not(vx, is_safe):
    state = driving(1.8)
    person = walker(2.0, 0.0, vx, 0.0)
    assert is_stop_safe(state, people=person) is is_safe
    standing = np.zeros(7)
    assert is_stop_safe(standing, people=person)  # at rest nobody is run into


def test_who_walks_through_a_straight_stop_is_met_as_in_a_simulation_of_both():
    """Looked at every 0.1 s and at the end; the stop begins one control period from now."""
    rng = default_rng(8)
    met = 0
    for _ in range(2000):
        v = rng.uniform(0.3, 2.0)
        x, y, vx, vy = rng.uniform((-1.0, -1.5, -1.5, -1.5), (2.5, 1.5, 1.5, 1.5))
        speeds = [v]
        while speeds[-1] > 0.0:
            time = len(speeds) * PERIOD
            speeds.append(stopped(v, 0.0, 0.0, 0.0, STRAIGHTEN, LIMITS, time)[0])
        way = 0.0
        is_met = False
        for i, (speed, after) in enumerate(zip(speeds, [*speeds[1:], 0.0], strict=True)):
            if i % 3 == 0 and speed >= 1e-3:
                time = (i + 1) * PERIOD
                away = np.hypot(way + CIRCLES - (x + time * vx), y + time * vy)
                is_met |= bool(away.min() < RADIUS + 0.3)
            way += 0.5 * PERIOD * (speed + after)
        person = walker(x, y, vx, vy)
        state = driving(v)
        assert is_stop_safe(state, people=person) is not is_met
        met += is_met
    assert 500 < met < 1500


@pytest.mark.parametrize("v", [0.0, 0.1])
def test_a_turning_robot_does_not_sweep_over_a_person(v):
    state = driving(v, 0.8)
    # walks to where the rear turns
    person = walker(-0.6, -1.05, 0.0, 1.2)
    assert not is_stop_safe(state, people=person)
    assert is_stop_safe(state)
    assert guard(state, 0.0, 0.0, people=person)[2] > 0.0


def test_the_reach_of_a_footprint_is_that_of_its_farthest_corner():
    corners = np.array(((0.2, 0.3), (0.2, -0.3), (-0.4, -0.3), (-0.3, 0.7)))
    assert _reach(corners) == approx(math.hypot(0.3, 0.7))
    assert _reach(corners[::-1].copy()) == _reach(corners)
