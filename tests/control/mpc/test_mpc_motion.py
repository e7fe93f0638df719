"""The parts of the jerk-limited MPC: stops, progress, models, distance field, tracks.

Each against another way.
"""

import math

import casadi as ca
import numpy as np
import pytest
from numpy.random import default_rng
from pytest import approx
from ruckig import ControlInterface, InputParameter, Ruckig, Trajectory
from scipy.integrate import solve_ivp
from scipy.ndimage import distance_transform_edt
from shapely import LineString, Point

from navstack.control.mpc import robot_model
from navstack.control.mpc import stage_layout as at
from navstack.control.mpc.distance_field import (
    cell_distance,
    distance_and_gradient,
    distance_at,
)
from navstack.control.mpc.motion import advance, rollout, shifted
from navstack.control.mpc.path_line import PathLine, at_distance, make_line, project
from navstack.control.mpc.people import nearest_people, predicted
from navstack.control.mpc.stage_layout import Sizes
from navstack.control.mpc.stages import (
    Wishes,
    fill_obstacles,
    fill_people,
    fill_stages,
    is_far,
)
from navstack.control.mpc.stop_profile import (
    highest_jerk,
    progress_jerk,
    stop_after,
    stop_distance,
    stop_time,
)
from navstack.geometry import cover
from navstack.types import Pose2D, Track

from ..given import DELIVERY_ROBOT
from .given import (
    DECELERATION,
    JERK,
    KEEP,
    LIMITS,
    PERIOD,
    TABLE,
    field_on,
    horizon_times,
    inflated_field,
    least_time,
)


def fastest_stop(v, a):
    """Duration and distance of the fastest stop, by Ruckig's velocity interface."""
    given = InputParameter(1)
    trajectory = Trajectory(1)
    given.control_interface = ControlInterface.Velocity
    given.current_velocity = [v]
    given.current_acceleration = [a]
    given.target_velocity = [0.0]
    given.max_acceleration = [DECELERATION]
    given.max_jerk = [JERK]
    Ruckig(1).calculate(given, trajectory)
    return trajectory.duration, trajectory.at_time(trajectory.duration)[0][0]


def test_the_stop_is_the_fastest_there_is():
    rng = default_rng(1)
    for v, a in zip(
        rng.uniform(-2.0, 2.0, 300), rng.uniform(-DECELERATION, DECELERATION, 300), strict=True
    ):
        duration, distance = fastest_stop(v, a)
        assert stop_time(v, a, DECELERATION, JERK) == approx(duration, abs=1e-6)
        assert stop_distance(v, a, DECELERATION, JERK) == approx(distance, abs=1e-6)


def test_a_stops_tail_is_the_stop_from_there():
    rng = default_rng(2)
    for v, a in zip(rng.uniform(0.0, 2.0, 100), rng.uniform(-0.5, 1.5, 100), strict=True):
        early = 0.4
        late = 0.9
        _, v_early, a_early = stop_after(v, a, DECELERATION, JERK, early)
        expected = stop_after(v, a, DECELERATION, JERK, late)[1:]
        assert stop_after(v_early, a_early, DECELERATION, JERK, late - early)[1:] == approx(
            expected, abs=1e-9
        )


def test_no_rate_limit_is_passed_by_the_highest_jerk():
    rng = default_rng(3)
    v = a = most = 0.0
    for _ in range(3000):
        j = min(rng.uniform(-JERK, 3.0 * JERK), highest_jerk(v, a, 2.0, 1.5, JERK, PERIOD))
        v = v + PERIOD * (a + 0.5 * PERIOD * j)
        a = a + PERIOD * j
        if a < -1.0:
            v = rng.uniform(0.0, 1.5)
            a = 0.0
        most = max(most, v)
        assert v <= 2.0 + 1e-12
        assert a <= 1.5 + 1e-12
        assert abs(j) <= JERK
    assert most > 1.99


@pytest.mark.parametrize("length", [0.1, 0.5, 2.0, 7.0, 20.0])
def test_greedy_progress_is_time_optimal(length):
    least = least_time(length)
    s = v = a = 0.0
    cycles = 0
    while length - s > 1e-3 or v > 1e-3:
        j = progress_jerk(v, a, length - s, 2.0, 1.5, DECELERATION, JERK, PERIOD)
        s += PERIOD * (v + PERIOD * (a / 2.0 + PERIOD * j / 6.0))
        v = v + PERIOD * (a + 0.5 * PERIOD * j)
        a = a + PERIOD * j
        cycles += 1
        assert s <= length + 1e-3  # jerk changes at the ends of periods only
    assert least - PERIOD <= cycles * PERIOD <= least + 2.0 * PERIOD


def test_the_model_is_the_unicycles():
    def rate(t, state, j, ja):
        _, _, yaw, v, omega, a, alpha = state
        return [v * math.cos(yaw), v * math.sin(yaw), omega, a, alpha, j, ja]

    state = np.array((1.0, -2.0, 0.7, 1.8, -0.9, 1.0, 2.0))
    (j, ja) = (-4.0, 8.0)
    dt = 0.1
    expected = solve_ivp(rate, (0.0, dt), state, args=(j, ja), rtol=1e-11, atol=1e-12).y[:, -1]
    after = np.empty(7)
    advance(state, j, ja, dt, after)
    assert after == approx(expected, abs=1e-6)
    symbols = ca.SX.sym("x", 7), ca.SX.sym("u", 2)
    model = ca.Function("model", symbols, [robot_model.step(*symbols, dt)])
    assert np.array(model(state, (j, ja))).ravel() == approx(after, abs=1e-14)


def test_shifting_keeps_the_rates_gained():
    rng = default_rng(4)
    times = horizon_times(30)
    jerks = rng.normal(size=(30, 2))
    moved = shifted(jerks, times, PERIOD)
    assert moved[1:-1] == approx(jerks[1:-1] * (1.0 - PERIOD / 0.1) + jerks[2:] * (PERIOD / 0.1))
    assert (moved * times[:, None]).sum(axis=0) == approx((jerks * times[:, None])[1:].sum(axis=0))
    start = np.zeros(7)
    late = rollout(start, jerks, times)[-1, 5] - PERIOD * jerks[0, 0]
    assert rollout(start, moved, times)[-1, 5] == approx(late)


def test_the_distance_field_is_that_of_the_obstacles():
    rng = default_rng(5)
    cells = rng.integers(20, 180, size=(12, 2))
    field = inflated_field(*cells)
    centres = np.array((-5.0, 3.0)) + 0.05 * (cells + 0.5)
    compared = 0
    for point in rng.uniform((-4.0, 4.0), (4.0, 12.0), size=(400, 2)):
        away = np.hypot(*(centres - point).T)
        nearest, second = np.sort(away)[:2]
        if nearest > 1.2:
            continue
        distance, gx, gy = distance_and_gradient(field, *point, 1.3)
        assert distance == approx(nearest, abs=0.03)
        # in the flat part and on ridges gradients are rough
        if nearest > 0.35 and second - nearest > 0.2:
            compared += 1
            assert (gx, gy) == approx(tuple((point - centres[away.argmin()]) / nearest), abs=0.12)
    assert compared > 30


def test_gradients_beside_a_ridge_are_those_over_two_cells_to_either_side():
    """Between two obstacles 1 m apart, 0.05 m off the middle: (0.35 m - 0.45 m) / 0.2 m."""
    field = inflated_field((90, 100), (110, 100))
    distance, gx, gy = distance_and_gradient(field, -5.0 + 0.05 * 101.5, 3.0 + 0.05 * 100.5, 1.3)
    assert (distance, gx, gy) == approx((0.45, -0.5, 0.0), abs=0.03)


def test_below_the_inscribed_radius_the_nearest_lethal_cell_is_as_far_as_it_is():
    rng = default_rng(16)
    for _ in range(5):
        costs = np.where(rng.random((14, 17)) < 0.03, 254, 253).astype(np.uint8)
        costs[6, 8] = 254
        field = field_on(costs)
        found = [[cell_distance(field, x, y) for x in range(17)] for y in range(14)]
        np.testing.assert_allclose(
            found, np.minimum(0.05 * distance_transform_edt(costs != 254), 0.19)
        )


def test_each_circle_keeps_behind_a_line_at_the_nearest_obstacle_that_is_no_persons():
    """At the circle's middle the half-plane asks for what the distance lacks of the clearance."""
    field = inflated_field((90, 100), (120, 128))  # at (-0.475, 8.025) and (1.025, 9.425) m
    people = np.array(((-0.4, 8.2, 1.0, 0.0, 0.3, 0.0, 0.0, 0.0),))
    rng = default_rng(17)
    circles = np.array((-0.5, 0.1))
    clear = 0.33 + 0.25 + 0.025
    states = np.zeros((301, 7))
    states[:, :3] = rng.uniform((-2.5, 6.5, -3.0), (2.5, 11.0, 3.0), (301, 3))
    stages = np.full((300, Sizes(300, 2, 1).stage), 7.0)
    found = [0, 0, 0]
    shared = np.concatenate((np.zeros(at.CIRCLES), circles))
    fill_obstacles(at.Horizon(stages, np.full(300, 0.1), shared), states, field, people, KEEP)
    for stage, (x, y, yaw) in zip(stages, states[1:, :3], strict=True):
        for i, along in enumerate(circles):
            middle = np.array((x + along * math.cos(yaw), y + along * math.sin(yaw)))
            distance, *away = distance_and_gradient(field, *middle, 9.0)
            *normal, offset = stage[at.BASE + 3 * i : at.BASE + 3 * i + 3]
            foot = middle - distance * np.array(away)
            kind = (
                0 if distance >= 2.0 * clear else 1 if math.dist(foot, people[0, :2]) < 0.7 else 2
            )
            found[kind] += 1
            if kind < 2:
                assert (*normal, offset) == (0.0, 0.0, -1.0)
            else:
                assert normal == approx(away)
                assert offset - np.dot(normal, middle) == approx(clear - distance)
        assert (stage[: at.BASE] == 7.0).all()
        assert (stage[at.BASE + 6 :] == 7.0).all()
    assert min(found) > 40


@pytest.mark.parametrize("cell", [(-1, 3), (3, -1), (8, 3), (3, 5)])
def test_beyond_the_grid_there_is_no_obstacle(cell):
    # what lies behind it in memory reads as an obstacle, too
    costs = np.full((7, 8), 254, dtype=np.uint8)[:5]
    field = field_on(costs)
    assert cell_distance(field, *cell) == TABLE[0]
    assert cell_distance(field, 7, 4) == cell_distance(field, 0, 0) == 0.0


def test_circles_cover_the_footprint():
    centres, radius = cover(DELIVERY_ROBOT, 3)
    x, y = np.meshgrid(np.linspace(-0.657, 0.19, 60), np.linspace(-0.3, 0.3, 40))
    distances = np.hypot(x[..., None] - centres, y[..., None])
    assert distances.min(axis=-1).max() <= radius + 1e-9
    assert radius < 0.34  # little more than half the width


def test_people_are_predicted_with_growing_uncertainty():
    covariance = np.diag((0.04, 0.04, 0.09, 0.09))
    far = Track(1, 10.0, 9.0, 0.0, -1.0, 0.0, 0.3, covariance)
    near = Track(2, 10.0, 2.0, 1.0, 0.0, 1.5, 0.25, covariance)
    rows = nearest_people((far, near), Pose2D(), 10.5, 1)
    assert len(rows) == 1
    assert rows[0, :5] == approx((2.0, 1.75, 0.0, 1.5, 0.25))
    x, y, deviation = predicted(rows[0], 2.0)
    assert (x, y) == approx((2.0, 4.75))
    assert deviation == approx(math.sqrt(0.04 + 0.09 * 2.5**2))
    assert nearest_people((), Pose2D(), 0.0, 8).shape == (0, 8)


def test_places_get_less_sure_as_the_tracks_covariance_says():
    """Over the time since the track's estimate and from now on.

    That of the place in F P F^T, the mean of both axes.
    """
    root = default_rng(18).normal(size=(4, 4))
    track = Track(1, 10.0, 2.0, 1.0, 0.3, 1.5, 0.25, root @ root.T)
    step = np.eye(4)
    (row,) = nearest_people((track,), Pose2D(), 10.4, 1)
    for time in (0.0, 0.7, 2.0):
        step[0, 2] = step[1, 3] = 0.4 + time
        moved = step @ track.covariance @ step.T
        x, y, deviation = predicted(row, time)
        assert (x, y) == approx((2.0 + 0.3 * (0.4 + time), 1.0 + 1.5 * (0.4 + time)))
        assert deviation == approx(math.sqrt(0.5 * (moved[0, 0] + moved[1, 1])))


def test_people_cost_where_they_will_be_beside_the_line():
    """Who crosses is thought to be farther on the way across, so that one passes behind.

    All others farther left.
    """
    rng = default_rng(12)
    times = np.array((PERIOD, 0.1, 0.1))
    sides = set()
    for _ in range(50):
        people = np.column_stack((rng.uniform(-3.0, 3.0, (2, 4)), rng.uniform(0.0, 0.1, (2, 4))))
        stages = np.zeros((3, Sizes(3, 2, 3).stage))
        directions = rng.uniform(-math.pi, math.pi, 3)
        stages[:, at.TANGENT_X] = np.cos(directions)
        stages[:, at.TANGENT_Y] = np.sin(directions)
        fill_people(at.Horizon(stages, times, np.zeros(at.CIRCLES + 2)), people, KEEP)
        for stage, time, direction in zip(stages, times.cumsum(), directions, strict=True):
            left = np.array((-math.sin(direction), math.cos(direction)))
            for j, person in enumerate(people):
                crossing = person[2:4] @ left  # [m/s] to the left
                side = -1.0 if crossing < -0.3 else 1.0
                sides.add((side, bool(crossing > 0.3)))
                expected = person[:2] + time * person[2:4] + side * 0.1 * left
                deviation = math.sqrt(person[5] + time * person[6] + time**2 * person[7])
                distance = 0.33 + person[4] + 0.3 + min(0.4, 1.5 * deviation)
                place = at.BASE + 3 * 2 + 3 * j
                assert stage[place : place + 3] == approx((*expected, distance), abs=1e-12)
            assert stage[at.BASE + 3 * 2 + 3 * 2 :].tolist() == [0.0, 0.0, -1.0]  # nobody
    assert sides == {(-1.0, False), (1.0, False), (1.0, True)}


def test_who_is_far_is_out_of_reach_however_the_robot_is_turned():
    rng = default_rng(7)
    place = 5
    shared = np.concatenate((np.zeros(at.CIRCLES), (-0.516, -0.2335, 0.049)))
    found = {True: 0, False: 0}
    for _ in range(400):
        state = rng.uniform(-2.0, 2.0, 7)
        stage = rng.uniform(-2.0, 2.0, 12)
        stage[place + 2] = rng.uniform(-0.2, 2.0)
        away = math.hypot(state[0] - stage[place], state[1] - stage[place + 1])
        expected = stage[place + 2] <= 0.0 or away - 0.516 > stage[place + 2]
        assert is_far(state, stage, place, shared) == expected
        found[bool(expected)] += 1
    assert min(found.values()) > 50


def test_the_line_follows_the_plan_and_slows_in_curves():
    turn = np.linspace(0.0, math.pi / 2.0, 80)
    arc = np.column_stack((np.sin(turn), 1.0 - np.cos(turn), turn))
    straight = np.column_stack((np.linspace(-3.0, -0.02, 150), np.zeros(150), np.zeros(150)))
    line = make_line(np.vstack((straight, arc)), LIMITS)
    assert line.s[-1] == approx(3.0 + math.pi / 2.0, abs=0.03)
    assert line.speed[0] == 2.0
    assert line.speed.min() == approx(min(math.sqrt(0.8 * 1.3), 0.8 * 1.2), rel=0.1)
    assert line.x[[0, -1]] == approx((-3.0, 1.0))
    assert line.y[[0, -1]] == approx((0.0, 1.0))
    segment, share = project(line, -1.95, 0.4, 0, len(line.x))
    assert line.x[segment] + share * (line.x[segment + 1] - line.x[segment]) == approx(-1.95)
    alone = make_line(np.array(((1.0, 2.0, 0.5),)), LIMITS)
    assert alone.x[-1] == 1.0
    assert alone.y[-1] == 2.0
    assert alone.heading[-1] == 0.5


def test_the_nearest_point_of_some_of_a_lines_segments_is_shapelys():
    rng = default_rng(15)
    for _ in range(100):
        points = np.cumsum(rng.normal(0.3, 0.8, (9, 2)), axis=0) + (2.0, -3.0)
        line = PathLine(*points.T.copy(), *np.zeros((3, 9)))
        first, last = sorted(int(each) for each in rng.integers(0, 8, 2))
        place = points[int(rng.integers(9))] + rng.normal(0.0, 1.0, 2)
        # beyond the end is no more
        segment, share = project(line, *place, first, last + int(last == 7))
        part = LineString(points[first : last + 2])
        found = points[segment] + share * (points[segment + 1] - points[segment])
        assert first <= segment <= last
        assert 0.0 <= share <= 1.0
        assert found == approx(
            np.array(part.interpolate(part.project(Point(place))).coords[0]), abs=1e-9
        )


@pytest.mark.parametrize(
    ("s", "segment", "share"),
    [
        (-1.0, 0, 0.0),
        (0.0, 0, 0.0),
        (0.5, 0, 0.5),
        (1.0, 1, 0.0),
        (2.5, 1, 0.75),
        (3.5, 2, 0.5),
        (4.0, 3, 0.0),
    ]
    + [(4.5, 3, 0.5), (5.0, 3, 1.0), (9.0, 3, 1.0)],
)
def test_places_along_the_line_are_found_by_their_distance(s, segment, share):
    line = PathLine(*np.zeros((2, 5)), np.array((0.0, 1.0, 3.0, 4.0, 5.0)), *np.zeros((2, 5)))
    assert at_distance(line, s) == (segment, share)


def test_a_distance_between_four_cells_is_their_weighted_mean():
    costs = default_rng(8).integers(0, 253, (9, 8)).astype(np.uint8)
    field = field_on(costs)
    metres = field.table[costs]
    expected = 0.75 * (0.6 * metres[5, 3] + 0.4 * metres[5, 4]) + 0.25 * (
        0.6 * metres[6, 3] + 0.4 * metres[6, 4]
    )
    assert distance_at.py_func(field, 3.4, 5.25) == approx(expected)


def test_stages_want_the_fastest_progress_that_can_stop_at_the_lines_end():
    times = horizon_times(30)
    line = make_line(np.column_stack((np.linspace(0.0, 3.0, 61), np.zeros((61, 2)))), LIMITS)
    states = rollout(np.array((0.2, 0.1, 0.0, 1.0, 0.0, 0.5, 0.0)), np.zeros((30, 2)), times)
    for heading in (math.nan, 0.4):
        stages = np.zeros((30, Sizes(30, 1, 1).stage))
        fill_stages.py_func(
            at.Horizon(stages, times, np.zeros(1)),
            states,
            line,
            2,
            Wishes(1.4, heading, 0.3),
            LIMITS,
        )
        wanted = np.array((0.2, 0.0, 0.0, 1.0, 0.0, 0.5, 0.0))  # along the line
        for stage, state, dt in zip(stages, states[1:], times, strict=True):
            jerk = progress_jerk(
                wanted[3],
                wanted[5],
                3.0 - wanted[0],
                1.4,
                1.5,
                DECELERATION,
                JERK,
                dt,
            )
            after = np.empty(7)
            advance(wanted, jerk, 0.0, dt, after)
            wanted = after
            foot = min(state[0], 3.0)
            assert stage[[at.FOOT_X, at.FOOT_Y, at.TANGENT_X, at.TANGENT_Y]] == approx(
                (foot, 0.0, 1.0, 0.0)
            )
            assert stage[at.LEAD] == approx(min(0.3, max(-0.3, wanted[0] - foot)), abs=1e-9)
            assert stage[[at.SPEED, at.JERK]] == approx((wanted[3], jerk), abs=1e-9)
            assert stage[at.HEADING] == (0.0 if math.isnan(heading) else heading)
            assert stage[at.CONTOUR] == (1.0 if math.isnan(heading) else 0.0)
        assert wanted[[0, 3]] == approx((3.0, 0.0), abs=5e-3)
