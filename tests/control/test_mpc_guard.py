"""The command guard of the jerk-limited MPC: the robot can always stop, whatever the plan wants."""

import math

import numpy as np
import pytest
from shapely import Polygon, affinity, box, union_all

from navstack.control.mpc import command_guard
from navstack.control.mpc import stage_layout as at
from navstack.control.mpc.command_guard import (
    KEEP_CURVE,
    STRAIGHTEN,
    Body,
    _duration,
    _reach,
    guarded,
    stop_is_safe,
    stopped,
)
from navstack.control.mpc.distance_field import Field, distance_table
from navstack.control.mpc.people import FIELDS
from navstack.control.mpc.stop_profile import stop_distance, stop_time
from navstack.costmap.costmap import LETHAL_OBSTACLE, NO_INFORMATION
from navstack.types import FloatArray

FOOTPRINT = np.array(((0.19, 0.3), (0.19, -0.3), (-0.657, -0.3), (-0.657, 0.3)))
CIRCLES, RADIUS = np.array((-0.516, -0.2335, 0.049)), 0.332
BODY = Body(FOOTPRINT, CIRCLES, RADIUS)
PERIOD = 1.0 / 30.0
LIMITS = np.array((2.0, 1.5, 2.5, 5.0, 1.2, 2.5, 10.0, 1.3))
NOBODY = np.empty((0, FIELDS))
Boxes = list[tuple[float, float, float, float]]


def field_of(boxes: Boxes) -> Field:
    """A map of 20 x 20 m about the origin with lethal boxes (x0, y0, x1, y1)."""
    costs = np.zeros((400, 400), dtype=np.uint8)
    for x0, y0, x1, y1 in boxes:
        left, low, right, high = (math.floor((value + 10.0) / 0.05) for value in (x0, y0, x1, y1))
        costs[low : high + 1, left : right + 1] = 254
    return Field(costs, (-10.0, -10.0, 0.05), distance_table(0.19, 3.0), 0.19)


def move(state: FloatArray, motion: FloatArray) -> None:
    """Carry the pose of a state (7,) to the end of a control period."""
    way = 0.5 * PERIOD * (state[3] + motion[0])
    turn = 0.5 * PERIOD * (state[4] + motion[1])
    state[0] += way * math.cos(state[2] + 0.5 * turn)
    state[1] += way * math.sin(state[2] + 0.5 * turn)
    state[2] += turn
    state[3:] = motion


def body(state: FloatArray) -> Polygon:
    turned = affinity.rotate(Polygon(FOOTPRINT), state[2], (0, 0), use_radians=True)
    return affinity.translate(turned, state[0], state[1])


@pytest.mark.parametrize("seed", range(5))
def test_a_stop_along_the_curve_keeps_the_yaw_limits(seed: int) -> None:
    """Its duration is that of the speed.

    None where the yaw would have to be pushed or jerked too hard on the way.
    """
    rng, found = np.random.default_rng(seed), {True: 0, False: 0}
    for _ in range(100):
        state = np.array(
            (
                0.0,
                0.0,
                0.0,
                rng.uniform(0.2, 2.0),
                rng.uniform(-1.3, 1.3),
                0.0,
                rng.uniform(-2.5, 2.5),
            )
        )
        whole = stop_time(state[3], state[5], LIMITS[at.MAX_DECELERATION], LIMITS[at.MAX_JERK])
        times = np.linspace(0.0, whole, 401)
        paths = [stopped(*state[3:], KEEP_CURVE, LIMITS, float(time)) for time in times]
        pushes, jerks = (
            np.array([path[3] for path in paths]),
            np.diff([path[3] for path in paths]) / np.diff(times),
        )
        pushed = abs(pushes[1:-1]).max() / LIMITS[at.MAX_YAW_ACCELERATION]
        jerked = abs(jerks).max() / LIMITS[at.MAX_YAW_JERK]
        if not 0.97 < max(pushed, jerked) < 1.03:  # too close to call by looking
            is_kept = max(pushed, jerked) < 1.0
            assert math.isnan(_duration(state, KEEP_CURVE, LIMITS)) != is_kept
            found[is_kept] += 1
    assert min(found.values()) >= 10


def test_a_blind_driver_touches_nothing() -> None:
    """Jerks drawn at random, mostly forwards.

    The outline never enters an obstacle by more than a cell.
    """
    rng = np.random.default_rng(21)
    stops = 0
    for _ in range(25):
        corners = rng.uniform(-7.0, 6.5, size=(14, 2))
        corners = corners[np.hypot(*(corners + 0.25).T) > 1.6]
        boxes = [(x, y, x + 0.5, y + 0.5) for x, y in corners.tolist()]
        field, walls = field_of(boxes), union_all([box(*each) for each in boxes])
        state, kind = np.zeros(7), STRAIGHTEN
        state[2] = rng.uniform(-3.0, 3.0)
        for cycle in range(150):
            if cycle % 15 == 0:
                j, ja = rng.uniform(-1.0, 5.0), rng.normal(scale=5.0)
            motion, kind, share = guarded(state, j, ja, PERIOD, LIMITS, kind, field, BODY, NOBODY)
            stops += share == 1.0
            move(state, motion)
            if np.abs(state[:2]).max() > 8.0:
                break
            assert body(state).intersection(walls).area < 0.05 * 0.3
            assert abs(state[3] * state[4]) <= LIMITS[at.MAX_LATERAL] + 1e-9
    assert stops > 20  # it was put to the test


@pytest.mark.parametrize("kind", [STRAIGHTEN, KEEP_CURVE])
def test_a_stop_that_is_called_safe_keeps_the_limits(kind: int) -> None:
    rng = np.random.default_rng(22)
    field, checked = field_of([]), 0
    for _ in range(300):
        state = np.zeros(7)
        state[3:] = rng.uniform((0.0, -1.2, -2.5, -2.5), (2.0, 1.2, 1.5, 2.5))
        if state[5] < 0.0 and state[3] < state[5] ** 2 / 10.0:  # it could not help rolling back
            continue
        if not stop_is_safe(state, kind, PERIOD, LIMITS, field, BODY, NOBODY):
            continue
        checked += 1
        times = np.arange(0, 90) * PERIOD
        motions = np.array([stopped(*state[3:], kind, LIMITS, time) for time in times])
        assert motions[-1] == pytest.approx(0.0, abs=1e-9)
        assert motions[:, 0].min() >= -1e-9 and np.abs(motions[:, 1]).max() <= 1.2 + 1e-9
        assert np.abs(motions[:, 0] * motions[:, 1]).max() <= 1.3 + 1e-9
        assert (
            np.abs(motions[:, 2]).max() <= 2.5 + 1e-9 and np.abs(motions[:, 3]).max() <= 2.5 + 1e-9
        )
        changes = np.abs(np.diff(motions[:, 2:], axis=0)) / PERIOD
        assert changes[:, 0].max() <= 5.0 + 1e-6 and changes[:, 1].max() <= 10.0 + 1e-6
    assert checked > 50


def test_the_least_share_of_the_stop_is_mixed_in_from_which_a_stop_is_safe() -> None:
    rng, found = np.random.default_rng(23), set()
    for _ in range(400):
        corners = rng.uniform((-1.0, -0.9), (1.8, 0.9), (3, 2))
        field = field_of(
            [(x, y, x + 0.1, y + 0.1) for x, y in corners[np.abs(corners[:, 1]) > 0.35].tolist()]
        )
        state = np.array(
            (
                0.0,
                0.0,
                rng.uniform(-0.1, 0.1),
                rng.uniform(0.0, 1.5),
                rng.uniform(-0.8, 0.8),
                0.0,
                0.0,
            )
        )
        jerks, known = rng.uniform((-5.0, -10.0), (5.0, 10.0)), (PERIOD, LIMITS)
        wanted, _, free = guarded(state, *jerks, *known, STRAIGHTEN, field_of([]), BODY, NOBODY)
        assert free == 0.0
        braked, expected = stopped(*state[3:], STRAIGHTEN, LIMITS, PERIOD), None
        for share in (0.0, 0.25, 0.5, 0.75):
            motion, after = wanted + share * (braked - wanted), state.copy()
            move(after, motion)
            safe = [
                kind
                for kind in (KEEP_CURVE, STRAIGHTEN)
                if stop_is_safe(after, kind, *known, field, BODY, NOBODY)
            ]
            if safe and expected is None:
                expected = share, safe[0]
        motion, kind, share = guarded(state, *jerks, *known, STRAIGHTEN, field, BODY, NOBODY)
        assert (share, kind) == (expected or (1.0, STRAIGHTEN))
        assert motion == pytest.approx(wanted + share * (braked - wanted), abs=1e-12)
        found.add((share, kind))
    assert found >= {(0.0, KEEP_CURVE), (0.0, STRAIGHTEN), (0.25, STRAIGHTEN), (1.0, STRAIGHTEN)}


@pytest.mark.parametrize(("v", "omega"), [(1.7, 0.0), (0.0, 1.2)])
def test_between_looks_no_point_moves_more_than_a_cell_and_none_is_looked_at_needlessly(
    monkeypatch: pytest.MonkeyPatch, v: float, omega: float
) -> None:
    looks: list[tuple[float, float, float]] = []
    monkeypatch.setattr(command_guard, "_touches", lambda *place: looks.append(place[:3]))
    state = np.array((0.3, -0.2, 0.4, v, omega, 0.0, 0.0))
    assert stop_is_safe.py_func(state, STRAIGHTEN, PERIOD, LIMITS, field_of([]), BODY, NOBODY)
    steps = np.abs(np.diff(looks, axis=0))
    moved = np.hypot(steps[:, 0], steps[:, 1]) + math.hypot(0.657, 0.3) * steps[:, 2]
    assert looks[0] == (0.3, -0.2, 0.4) and moved.max() <= 0.05 + 1e-12
    assert (moved[:-2] + moved[1:-1]).min() > 0.05
    length = stop_distance(v, 0.0, 2.5, 5.0) + math.hypot(0.657, 0.3) * stop_distance(
        omega, 0.0, 2.5, 10.0
    )
    assert moved.sum() == pytest.approx(length, abs=1e-3)  # trapezia from period to period


@pytest.mark.parametrize("kind", [STRAIGHTEN, KEEP_CURVE])
@pytest.mark.parametrize("speed", [0.9, 1.55])
def test_a_stop_is_looked_at_to_its_last_micrometre(speed: float, kind: int) -> None:
    speeds = [stopped(speed, 0.0, 0.0, 0.0, kind, LIMITS, i * PERIOD)[0] for i in range(60)]
    # the last period's way counts
    assert PERIOD * min(each for each in speeds if each > 0.0) > 1e-5
    # it begins at 2 m
    way, wall = PERIOD * (sum(speeds) - 0.5 * speed), field_of([(2.02, -0.2, 2.02, 0.2)])
    for rest in (1e-6, -1e-6):
        state = np.array((2.0 - 0.19 - way - rest, 0.0, 0.0, speed, 0.0, 0.0, 0.0))
        assert stop_is_safe(state, kind, PERIOD, LIMITS, wall, BODY, NOBODY) == (rest > 0.0)


def test_keeping_the_curve_stops_beside_an_obstacle_that_a_straight_stop_would_meet() -> None:
    state = np.array((0.0, 0.0, 0.0, 1.8, 0.7, 0.0, 0.0))
    field = field_of([(1.0, -1.2, 2.2, -0.15)])  # ahead on the right of a left turn
    known = (PERIOD, LIMITS, field, BODY, NOBODY)
    assert stop_is_safe(state, KEEP_CURVE, *known)
    assert not stop_is_safe(state, STRAIGHTEN, *known)


@pytest.mark.parametrize("speed", [1.0, 1.5, 2.0])
def test_a_stop_through_a_wall_one_cell_deep_is_not_safe(speed: float) -> None:
    state = np.array((0.0, 0.0, 0.0, speed, 0.0, 0.0, 0.0))
    length = stop_distance(speed, 0.0, LIMITS[at.MAX_DECELERATION], LIMITS[at.MAX_JERK])
    # cells ahead of the front edge
    near, far = math.ceil(0.19 / 0.05), math.floor((0.19 + length) / 0.05)
    for cell in range(near, far):
        x = (cell + 0.5) * 0.05
        known = (PERIOD, LIMITS, field_of([(x, -0.15, x, 0.15)]), BODY, NOBODY)
        assert not stop_is_safe(state, STRAIGHTEN, *known)
    x = (far + 1.5) * 0.05
    assert stop_is_safe(
        state, STRAIGHTEN, PERIOD, LIMITS, field_of([(x, -0.15, x, 0.15)]), *known[3:]
    )


def test_a_stop_of_a_turn_whose_rear_sweeps_over_a_post_is_not_safe() -> None:
    state = np.array((0.0, 0.0, 0.0, 0.0, 1.2, 0.0, 0.0))
    turned = stop_distance(1.2, 0.0, LIMITS[at.MAX_YAW_ACCELERATION], LIMITS[at.MAX_YAW_JERK])
    for share in np.linspace(0.1, 0.9, 30):
        yaw = share * turned
        x, y = (
            -0.62 * math.cos(yaw) + 0.3 * math.sin(yaw),
            -0.62 * math.sin(yaw) - 0.3 * math.cos(yaw),
        )
        field = field_of([(x - 0.05, y - 0.05, x + 0.05, y + 0.05)])
        assert not stop_is_safe(state, STRAIGHTEN, PERIOD, LIMITS, field, BODY, NOBODY)


def test_an_unknown_cell_under_the_outline_hides_no_lethal_one() -> None:
    field = field_of([(0.19, 0.0, 0.19, 0.0), (-0.657, 0.0, -0.657, 0.0)])  # front and rear edge
    known = (PERIOD, LIMITS, field, BODY, NOBODY)
    for x, y in ((0.19, -0.2), (-0.2, -0.3)):  # on the front edge and on the side after it
        field.costs[math.floor((y + 10.0) / 0.05), math.floor((x + 10.0) / 0.05)] = NO_INFORMATION
        assert not stop_is_safe(np.zeros(7), STRAIGHTEN, *known)
    field.costs[field.costs == LETHAL_OBSTACLE] = 0
    assert stop_is_safe(np.zeros(7), STRAIGHTEN, *known)


@pytest.mark.parametrize(("vx", "is_safe"), [(-1.2, False), (1.5, True)])
def test_a_person_who_comes_is_stopped_for_and_one_who_leaves_is_not(
    vx: float, is_safe: bool
) -> None:
    state = np.array((0.0, 0.0, 0.0, 1.8, 0.0, 0.0, 0.0))
    person = np.array(((2.0, 0.0, vx, 0.0, 0.3, 0.0, 0.0, 0.0),))
    known = (PERIOD, LIMITS, field_of([]), BODY)
    assert stop_is_safe(state, STRAIGHTEN, *known, person) is is_safe
    standing = np.zeros(7)
    assert stop_is_safe(standing, STRAIGHTEN, *known, person)  # at rest nobody is run into


def test_who_walks_through_a_straight_stop_is_met_as_in_a_simulation_of_both() -> None:
    """Looked at every 0.1 s and at the end; the stop begins one control period from now."""
    rng, met = np.random.default_rng(8), 0
    known = (PERIOD, LIMITS, field_of([]), BODY)
    for _ in range(2000):
        v = rng.uniform(0.3, 2.0)
        x, y, vx, vy = rng.uniform((-1.0, -1.5, -1.5, -1.5), (2.5, 1.5, 1.5, 1.5))
        speeds = [v]
        while speeds[-1] > 0.0:
            time = len(speeds) * PERIOD
            speeds.append(stopped(v, 0.0, 0.0, 0.0, STRAIGHTEN, LIMITS, time)[0])
        way, is_met = 0.0, False
        for i, (speed, after) in enumerate(zip(speeds, [*speeds[1:], 0.0], strict=True)):
            if i % 3 == 0 and speed >= 1e-3:
                time = (i + 1) * PERIOD
                away = np.hypot(way + CIRCLES - (x + time * vx), y + time * vy)
                is_met |= bool(away.min() < RADIUS + 0.3)
            way += 0.5 * PERIOD * (speed + after)
        person = np.array(((x, y, vx, vy, 0.3, 0.0, 0.0, 0.0),))
        state = np.array((0.0, 0.0, 0.0, v, 0.0, 0.0, 0.0))
        assert stop_is_safe(state, STRAIGHTEN, *known, person) is not is_met
        met += is_met
    assert 500 < met < 1500


@pytest.mark.parametrize("v", [0.0, 0.1])
def test_a_turning_robot_does_not_sweep_over_a_person(v: float) -> None:
    state = np.array((0.0, 0.0, 0.0, v, 0.8, 0.0, 0.0))
    # walks to where the rear turns
    person = np.array(((-0.6, -1.05, 0.0, 1.2, 0.3, 0.0, 0.0, 0.0),))
    known = (PERIOD, LIMITS, field_of([]), BODY)
    assert not stop_is_safe(state, STRAIGHTEN, *known, person)
    assert stop_is_safe(state, STRAIGHTEN, *known, NOBODY)
    assert guarded(state, 0.0, 0.0, *known[:2], STRAIGHTEN, *known[2:], person)[2] > 0.0


def test_the_reach_of_a_footprint_is_that_of_its_farthest_corner() -> None:
    corners = np.array(((0.2, 0.3), (0.2, -0.3), (-0.4, -0.3), (-0.3, 0.7)))
    assert _reach(corners) == pytest.approx(math.hypot(0.3, 0.7))
    assert _reach(corners[::-1].copy()) == _reach(corners)
