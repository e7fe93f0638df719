"""Metrics against values worked out by hand, and against slow twins."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import savgol_filter

from harness.metrics.delivery_log import DeliveryLog, localization_errors
from harness.metrics.encounters import (
    BLOCK,
    Body,
    Encounters,
    surface_distances,
    times_to_collision,
)
from harness.metrics.formulas import path_irregularity
from harness.metrics.ground import ground_driven
from harness.metrics.metric import Better, Metric
from harness.metrics.motion import (
    jerk,
    lateral_acceleration,
    smoothed,
    success_weighted_path_length,
)
from harness.metrics.summary import summarize_more
from harness.world.map.scene import Obstacle, Scene, Zone
from harness.world.truth import Truth
from navstack.costmap.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from navstack.types import Belief, Pose2D, Twist2D

BODY = Body((0.0, 0.0), (0.5, 0.25), 0.3)  # discs of 0.25 m at x = -0.25, 0 and 0.25 m
STANDING = np.zeros((1, 3))


def square(left, right):
    return np.array([(left, -9.0), (right, -9.0), (right, 9.0), (left, 9.0)])


# 20 m wide: free up to x = 1, a crosswalk over the road from 1 to 3 of which the map says nothing
CELLS = np.where(np.arange(-10, 10) < 1, FREE, OCCUPIED).astype(np.int8)[np.newaxis, :]
GROUND = OccupancyGrid(np.repeat(CELLS, 20, axis=0), 1.0, Pose2D(-10.0, -10.0))
STREET = (
    Zone("road", square(0.0, 8.0)),
    Zone("crosswalk", square(2.0, 3.0)),
    Zone("lawn", square(5.0, 6.0)),
)
MAILBOX = Obstacle("mailbox", square(-9.0, -8.0), 1.0)
SCENE = Scene("street", (MAILBOX,), STREET, GROUND, GROUND)


@pytest.mark.parametrize(
    ("arrived", "shortest", "driven", "spl"),
    [
        (True, 30.0, 40.0, 0.75),
        (True, 30.0, 28.0, 1.0),
        (False, 30.0, 30.0, 0.0),
        (True, 0.0, 0.0, 1.0),
    ],
)
def test_spl_of_one_delivery(arrived, shortest, driven, spl):
    assert success_weighted_path_length(arrived, shortest, driven) == spl


def test_the_irregularity_of_an_arc_is_its_curvature():
    angle = np.linspace(0.75 * math.pi, 1.5 * math.pi, 2001)  # the yaw passes pi on the way
    yaw = (angle + math.pi) % (2.0 * math.pi) - math.pi
    x, y = 4.0 * np.sin(angle), -4.0 * np.cos(angle)
    assert path_irregularity({"x": x, "y": y, "yaw": yaw}) == pytest.approx(1.0 / 4.0, rel=1e-6)


def test_turning_back_and_forth_adds_up():
    yaw = np.array((0.0, 0.5, 0.0, -0.5, 0.0))
    assert path_irregularity({"x": np.arange(5.0), "y": np.zeros(5), "yaw": yaw}) == pytest.approx(
        2.0 / 4.0
    )


def test_irregularity_of_a_robot_that_stands_is_undefined():
    assert (
        path_irregularity({"x": np.linspace(0.0, 0.9, 10), "y": np.zeros(10), "yaw": np.zeros(10)})
        is None
    )


def test_jerk_of_a_parabola_is_its_second_derivative():
    time = np.arange(60) / 30.0
    found = jerk(0.3 + 0.2 * time + 0.5 * 6.0 * time**2, 1.0 / 30.0)
    assert len(found) == 60 - 16  # windows of 17 samples
    assert found == pytest.approx(6.0, abs=1e-9)


def test_lateral_acceleration_is_speed_times_yaw_rate():
    assert lateral_acceleration(np.full(40, 1.5), np.full(40, -0.8), 0.05) == pytest.approx(-1.2)


@pytest.mark.parametrize("derivative", [0, 2])
def test_smoothing_is_savitzky_and_golays(derivative):
    values = np.random.default_rng(1).normal(size=200)
    theirs = savgol_filter(values, 31, 3, deriv=derivative, delta=1.0 / 60.0)
    assert smoothed(values, 1.0 / 60.0, derivative) == pytest.approx(
        theirs[15:-15], rel=1e-9, abs=1e-9
    )


def test_too_short_a_drive_has_no_jerk():
    assert len(jerk(np.ones(16), 1.0 / 30.0)) == 0


@pytest.mark.parametrize(
    ("person", "distance"),
    [
        ((2.0, 0.1), 2.0 - 0.5 - 0.3),
        ((-0.2, -1.0), 1.0 - 0.25 - 0.3),
        ((0.5 + 0.6, 0.25 + 0.8), 1.0 - 0.3),  # off a corner
        ((0.7, 0.0), 0.0),
        ((0.0, 0.0), 0.0),
    ],
)
def test_distances_are_between_the_surfaces(person, distance):
    assert surface_distances(np.array([[*person, 0.0, 0.0]]), BODY)[0] == pytest.approx(distance)


@pytest.mark.parametrize(
    ("motion", "person", "time"),
    [
        ((1.0, 0.0, 0.0), (3.0, 0.0, 0.0, 0.0), 3.0 - 0.25 - 0.55),
        ((1.0, 0.0, 0.0), (3.0, 0.0, -1.0, 0.0), (3.0 - 0.25 - 0.55) / 2.0),
        ((1.0, 0.0, 0.0), (3.0, 0.33, 0.0, 0.0), 2.75 - 0.44),  # 0.33, 0.44, 0.55: a right triangle
        ((1.0, 0.0, 0.0), (3.0, 0.56, 0.0, 0.0), math.inf),  # passes beside
        ((1.0, 0.0, 0.0), (3.0, 0.0, 1.5, 0.0), math.inf),  # is faster
        ((-1.0, 0.0, 0.0), (3.0, 0.0, 0.0, 0.0), math.inf),
        # walks into the standing robot
        ((0.0, 0.0, 0.0), (0.0, 2.0, 0.0, -0.5), (2.0 - 0.55) / 0.5),
        # is swept by the front of a turning one
        ((0.0, 0.0, 1.0), (0.25, 1.05, 0.0, 0.0), 0.5 / 0.25),
        ((1.0, 0.0, 0.0), (0.7, 0.0, 5.0, 0.0), 0.0),  # touches already
    ],
)
def test_time_to_collision(motion, person, time):
    assert times_to_collision(np.array([motion]), np.array([person]), BODY)[0] == pytest.approx(
        time
    )


def test_discs_lie_along_the_longer_side():
    assert BODY.discs.tolist() == [[-0.25, 0.0], [0.0, 0.0], [0.25, 0.0]]
    assert Body((-0.2, 0.0), (0.2, 0.4), 0.3).discs.tolist() == [
        [-0.2, -0.2],
        [-0.2, 0.0],
        [-0.2, 0.2],
    ]
    assert Body((0.0, 0.0), (0.3, 0.3), 0.3).discs.tolist() == [[0.0, 0.0]]


def test_encounters_of_a_pass():
    """Somebody passes a standing robot that looks north.

    That takes 40 ticks of 0.1 s, from y = -2 m at 1 m/s, at x = 1 m.
    """
    met = Encounters(BODY)
    for k in range(40):
        person = (1.0, -2.0 + 0.1 * (k + 0.5), 0.0, 1.0)
        met.add(
            (0.1, 0.0, 0.0, math.pi / 2.0, 0.0, 0.0, 0.0),
            np.array([person, (math.inf, math.inf, 0.0, 0.0)]),
        )
    met.finish()
    # beside it: from the left or right side
    assert met.min_distance == pytest.approx(1.0 - 0.25 - 0.3)
    # Nearer than 1.2 m: the disc's centre within 1.5 m of the rectangle, 0.75 m beside it.
    ahead = math.sqrt(1.5**2 - 0.75**2)  # [m] beyond front and rear
    assert met.personal_time == pytest.approx(2.0 * (0.5 + ahead), abs=0.1)
    assert met.intimate_time == pytest.approx(0.0)  # 0.45 m is the least
    assert math.isinf(met.min_time_to_collision)


def slowly(ticks, people):
    """Least distance and time to collision, intimate and personal time.

    Person by person, tick by tick.
    """
    least, soonest, intimate, personal = math.inf, math.inf, 0.0, 0.0
    for (dt, x, y, yaw, vx, vy, yaw_rate), crowd in zip(ticks, people, strict=True):
        closest = math.inf
        for px, py, pvx, pvy in crowd:
            if math.hypot(px - x, py - y) >= 20.0:
                continue
            c, s = math.cos(yaw), math.sin(yaw)
            qx, qy = c * (px - x) + s * (py - y), c * (py - y) - s * (px - x)
            wx, wy = c * pvx + s * pvy, c * pvy - s * pvx
            out = math.hypot(max(abs(qx) - 0.5, 0.0), max(abs(qy) - 0.25, 0.0))
            closest = min(closest, max(out - 0.3, 0.0))
            for disc in (-0.25, 0.0, 0.25):
                gx, gy, ux, uy = qx - disc, qy, wx - vx, wy - (vy + yaw_rate * disc)
                roots = np.roots(
                    (ux * ux + uy * uy, 2 * (gx * ux + gy * uy), gx * gx + gy * gy - 0.55**2)
                )
                if math.hypot(gx, gy) <= 0.55:
                    soonest = 0.0
                elif np.isreal(roots).all() and roots.real.min() > 0.0:
                    soonest = min(soonest, float(roots.real.min()))
        least = min(least, closest)
        intimate += dt * (closest < 0.45)
        personal += dt * (closest < 1.2)
    return least, soonest, intimate, personal


@pytest.mark.parametrize("seed", [0, 1])
def test_blocks_of_ticks_give_what_single_ticks_give(seed):
    rng = np.random.default_rng(seed)
    count = BLOCK + 40
    ticks = np.column_stack(
        (np.full(count, 0.05), rng.normal(0.0, 3.0, (count, 3)), rng.normal(0.0, 1.0, (count, 3)))
    )
    people = np.concatenate(
        (rng.normal(0.0, 9.0, (count, 3, 2)), rng.normal(0.0, 1.0, (count, 3, 2))), axis=2
    )
    # no touch
    keep = (np.hypot(*(people[..., :2] - ticks[:, None, 1:3]).transpose(2, 0, 1)) > 1.0).all(axis=1)
    met = Encounters(BODY)
    for tick, crowd in zip(ticks[keep].tolist(), people[keep], strict=True):
        met.add(tuple(tick), crowd)
    met.finish()
    found = (met.min_distance, met.min_time_to_collision, met.intimate_time, met.personal_time)
    assert found == pytest.approx(slowly(ticks[keep], people[keep]))
    assert 0.0 < found[1] < math.inf and found[3] > 0.0


def test_localization_errors():
    true = np.array(((0.0, 0.0, 3.1), (1.0, 1.0, 0.0), (2.0, 2.0, 0.0), (0.0, 0.0, 0.0)))
    believed = np.array(
        ((0.3, 0.4, -3.1), (1.0, 1.0, 0.1), (2.0, 3.0, 0.0), (math.nan, math.nan, math.nan))
    )
    position, heading = localization_errors(true, believed)
    assert position == pytest.approx([0.5, 0.0, 1.0])
    # 3.1 to -3.1 is 0.083 across pi
    assert heading == pytest.approx([2.0 * math.pi - 6.2, 0.1, 0.0])


@pytest.mark.parametrize(
    ("statistic", "expected"),
    [("min", 0.0), ("mean", 0.5), ("median", 0.5), ("p95", 0.95), ("max", 1.0)],
)
def test_a_metric_may_be_a_statistic_of_a_series(statistic, expected):
    metric = Metric(
        "error_m",
        "Error",
        Better.LOWER,
        "An error.",
        "ours",
        series="e",
        statistic=statistic,
    )
    assert metric.measured({"e": np.array((0.5, 0.0, 1.0))}) == pytest.approx(expected)
    assert metric.measured({"e": np.empty(0)}) is None


def truth(stamp, x, speed, people):
    crowd = np.array(people).reshape(-1, 4)
    return Truth(
        stamp,
        Pose2D(x, 0.0, 0.0),
        0.01 * x,
        Twist2D(speed),
        crowd,
        (),
        (),
        None,
        3.6e5 * x,
    )


def drive(people, belief):
    """Two seconds at 1 m/s along x in ticks of 0.1 s."""
    log = DeliveryLog(truth(0.0, 0.0, 1.0, people), SCENE, BODY)
    for k in range(1, 21):
        log.record(truth(0.1 * k, 0.1 * k, 1.0, people), belief)
    return log.measurements(truth(2.0, 2.0, 1.0, people))


def test_a_straight_drive_past_somebody():
    row = drive([(2.0, 1.0, 0.0, 0.0)], Belief(Pose2D(0.0, 0.0, 0.0)))
    assert row["distance_m"] == pytest.approx(2.0)
    assert row["average_speed_mps"] == pytest.approx(1.0)
    assert row["path_irregularity_radpm"] == 0.0
    assert row["jerk_p95_mps3"] == pytest.approx(0.0, abs=1e-9)
    assert row["lateral_acceleration_p95_mps2"] == 0.0
    assert row["max_tilt_rad"] == pytest.approx(0.02)
    assert row["motion_energy_kwh"] == pytest.approx(0.2)
    assert row["min_pedestrian_distance_m"] == pytest.approx(1.0 - 0.25 - 0.3)
    assert row["min_time_to_collision_s"] is None  # a metre beside the way
    # from x = 2 - 0.5 - 1.299 = 0.201 on: 0.3 to 2.0
    assert row["personal_intrusion_s"] == pytest.approx(1.8)
    assert row["personal_intrusion_percent"] == pytest.approx(90.0)
    assert row["intimate_intrusion_s"] == 0.0
    # it is compared with where the brain was asked
    assert row["localization_error_max_m"] == pytest.approx(1.9)
    assert row["localization_error_mean_m"] == pytest.approx(0.95)
    assert row["mailbox_contacts"] == 0 and row["fence_contacts"] is None


def test_what_is_undefined_is_null():
    row = drive([], None)
    for key in (
        "min_pedestrian_distance_m",
        "min_time_to_collision_s",
        "personal_intrusion_s",
        "pieces_lost",
    ):
        assert row[key] is None
    assert row["intimate_intrusion_percent"] is None
    assert row["localization_error_p95_m"] is None and row["heading_error_mean_rad"] is None


def test_means_are_over_the_deliveries_where_they_are_defined():
    rows = [{"min_time_to_collision_s": value} for value in (1.0, None, 4.0)]
    means = summarize_more(rows)
    assert means["avg_min_time_to_collision_s"] == pytest.approx(2.5)
    assert means["avg_spl"] is None


@pytest.mark.parametrize(
    ("x", "road", "off"),
    [
        ((-2.5, -1.5, 0.5), (0.0, 0.0), (0.0, 0.0)),  # the free part of a road is a crossing
        ((0.5, 1.5, 4.5), (4.0, 0.75), (4.0, 0.75)),
        ((1.5, 2.5, 4.5), (2.0, 0.5), (3.0, 0.75)),  # a crosswalk that the map has not drawn
        ((4.5, 5.5, 5.5), (0.0, 0.0), (1.0, 0.75)),  # a lawn, and standing on it
        ((9.5, 11.5, 12.5), (0.0, 0.0), (3.0, 0.75)),  # beyond the map
    ],
)
def test_ground_is_road_lawn_or_walkable(x, road, off):
    stamp = np.array((0.0, 0.25, 0.75))
    row = ground_driven(stamp, np.array(x), np.zeros(3), SCENE)
    assert (row["road_distance_m"], row["road_time_s"]) == road
    assert (row["off_walkable_distance_m"], row["off_walkable_time_s"]) == off
    bare = ground_driven(stamp, np.array(x), np.zeros(3), replace(SCENE, zones=STREET[1:]))
    assert bare == {**row, "road_distance_m": None, "road_time_s": None}
