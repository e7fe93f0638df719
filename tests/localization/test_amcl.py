"""The localizer: it follows, corrects, waits, recovers, and says how it fares."""

import math
from collections import deque
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from navstack.build import build_localizer
from navstack.costmap.distances import squared_distances
from navstack.costmap.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from navstack.geometry import compose, relative_to
from navstack.localization.amcl import (
    DEGRADED_ABOVE,
    DEGRADED_BELOW,
    DEGRADED_UNDER,
    INITIAL_VARIANCES,
    LOST_ABOVE,
    LOST_BELOW,
    LOST_UNDER,
    AmclLocalizer,
    pose_at,
)
from navstack.localization.amcl_kernels import cast_rays
from navstack.params.amcl import AmclParams
from navstack.types import Belief, Health, LaserScan, Observation, Odometry, Pose2D, Twist2D

RESOLUTION = 0.05  # [m]
BEAMS, RANGE = 180, 15.0  # of the scanner, [m]
START = Pose2D(3.0, 4.0, 0.5)
PARAMS = AmclParams(alpha1=0.03, alpha2=0.03, alpha3=0.05, alpha4=0.05)


@pytest.fixture(scope="module")
def room():
    """A room of 12 m x 8 m with a few things in it, no two sides alike."""
    cells = np.full((160, 240), FREE, dtype=np.int8)
    cells[0], cells[-1], cells[:, 0], cells[:, -1] = (OCCUPIED,) * 4
    cells[40:60, 100] = cells[40, 100:120] = cells[120, 30:90] = cells[24, 180:] = cells[
        100:, 200
    ] = OCCUPIED
    return OccupancyGrid(cells, RESOLUTION, Pose2D())


@pytest.fixture(scope="module")
def see(room):
    """Makes what a scanner at the base sees from a pose."""
    clear = np.ceil(
        np.sqrt(
            squared_distances(np.pad(room.data != FREE, 1, constant_values=True), 100_000) / 2.0
        )
    )
    bearings = np.linspace(-math.pi, math.pi, BEAMS, endpoint=False)

    def _see(pose, stamp):
        # as AMCL takes cells
        sensor = np.array([[pose.x / RESOLUTION + 1.5, pose.y / RESOLUTION + 1.5, pose.yaw]])
        ranges = (
            cast_rays(clear.astype(np.uint8), sensor, bearings, RANGE / RESOLUTION)[0] * RESOLUTION
        )
        return LaserScan(stamp, ranges, -math.pi, 2.0 * math.pi / BEAMS, 0.05, RANGE)

    return _see


@pytest.fixture
def drive(see):
    """Drives a circle with odometry that is 2 % short and starts elsewhere.

    Gives beliefs and truths per tick.
    """

    def _drive(localizer, seconds=12.0, start=START, noise=None):
        odom, truth, rows = Pose2D(7.0, -3.0, 2.0), start, []
        for tick in range(round(seconds * 30)):
            stamp = tick / 30.0
            odometry = Odometry(stamp, odom, Twist2D(0.6, 0.0, 0.3))
            observation = Observation(
                stamp, odometry, scan=see(truth, stamp) if tick % 3 == 0 else None
            )
            rows.append((localizer.update(observation), truth))
            step = 0.6 / 30.0
            truth = compose(truth, Pose2D(step, 0.0, 0.3 / 30.0))
            odom = compose(odom, Pose2D(0.98 * step, 0.0, 0.3 / 30.0))
        return rows

    return _drive


def started(grid, seed=0, belief=None, **params):
    localizer = AmclLocalizer(replace(PARAMS, **params), grid)
    localizer.reset(belief or Belief(START), np.random.default_rng(seed))
    return localizer


def errors(rows):
    return np.array(
        [math.hypot(belief.pose.x - truth.x, belief.pose.y - truth.y) for belief, truth in rows]
    )


@pytest.mark.parametrize("model", ["likelihood_field", "likelihood_field_prob", "beam"])
def test_it_knows_where_it_is_while_it_drives(room, drive, model):
    rows = drive(started(room, laser_model_type=model, max_beams=90, do_beamskip=True))
    wrong = errors(rows)[60:]
    assert np.median(wrong) < 0.12
    assert wrong.max() < 0.25
    assert all(abs(relative_to(truth, belief.pose).yaw) < 0.1 for belief, truth in rows[100:])
    assert rows[-1][0].health is Health.TRACKING
    assert [belief.stamp for belief, _ in rows[:3]] == [0.0, 1 / 30.0, 2 / 30.0]


def test_the_covariance_shrinks_from_the_given_one(room, drive):
    without = started(room).update(Observation(0.0)).covariance
    np.testing.assert_array_equal(without, np.diag(INITIAL_VARIANCES))
    given = np.diag((0.01, 0.02, 0.001))
    narrow = started(room, belief=Belief(START, given))
    np.testing.assert_array_equal(narrow.update(Observation(0.0)).covariance, given)
    np.testing.assert_allclose(np.cov(narrow.particles.poses.T), given, atol=2e-3)
    rows = drive(started(room))
    assert np.trace(rows[-1][0].covariance) < 0.3 * np.trace(rows[5][0].covariance)


def test_between_scans_it_moves_with_the_odometry(room):
    localizer = started(room)
    first = localizer.update(Observation(0.0, Odometry(0.0, Pose2D(1.0, 1.0, 0.0), Twist2D())))
    assert first.pose == START
    later = localizer.update(Observation(0.1, Odometry(0.1, Pose2D(2.0, 1.0, 0.3), Twist2D())))
    expected = compose(START, Pose2D(1.0, 0.0, 0.3))
    assert (later.pose.x, later.pose.y, later.pose.yaw) == pytest.approx(
        (expected.x, expected.y, expected.yaw)
    )


def test_it_does_not_look_while_it_stands(room, see):
    localizer = started(room, resample_interval=1)
    for tick in range(12):
        localizer.update(
            Observation(
                tick / 10, Odometry(tick / 10, Pose2D(), Twist2D()), scan=see(START, tick / 10)
            )
        )
        if tick == 0:
            poses = localizer.particles.poses.copy()
    np.testing.assert_array_equal(localizer.particles.poses, poses)
    turned = Odometry(1.3, Pose2D(0.0, 0.0, 0.21), Twist2D())
    localizer.update(Observation(1.3, turned, scan=see(START, 1.3)))
    assert len(localizer.particles.poses) != len(poses) or not np.array_equal(
        localizer.particles.poses, poses
    )


@pytest.mark.parametrize(
    ("x", "y", "yaw", "counts"),
    [
        (4.25, -2.0, 3.0, False),  # no more than the least distance
        (4.2500001, -2.0, 3.0, True),
        (4.0, -2.2500001, 3.0, True),
        (4.2, -1.8, 3.0, False),  # along each axis
        (4.0, -2.0, 3.125, False),
        (4.0, -2.0, 2.87, True),
        (4.0, -2.0, 3.1251 - 2.0 * math.pi, True),
    ],
)
def test_a_scan_counts_after_a_least_distance_along_an_axis_or_a_least_turn(
    room,
    x,
    y,
    yaw,
    counts,
):
    localizer = started(room, update_min_d=0.25, update_min_a=0.125)
    assert localizer._has_moved(Pose2D(4.0, -2.0, 3.0), Pose2D(x, y, yaw)) == counts


@pytest.mark.parametrize(("returns", "health"), [(9, Health.TRACKING), (10, Health.LOST)])
def test_ten_returns_tell_whether_they_are_explained(room, returns, health):
    localizer = started(room, belief=Belief(Pose2D(3.0, 4.0, 0.0), np.diag((1e-6, 1e-6, 1e-8))))
    scan = LaserScan(0.0, np.full(returns, 3.0), 0.0, 1e-9, 0.05, RANGE)  # where nothing stands
    assert (
        localizer.update(Observation(0.0, Odometry(0.0, Pose2D(), Twist2D()), scan=scan)).health
        is health
    )


def test_a_scan_waits_for_the_odometry_of_its_time(room, see):
    localizer = started(room, resample_interval=1)
    before = localizer.particles.poses.copy()
    localizer.update(Observation(0.1, Odometry(0.0, Pose2D(), Twist2D()), scan=see(START, 0.1)))
    np.testing.assert_array_equal(localizer.particles.poses, before)
    localizer.update(Observation(0.2, Odometry(0.2, Pose2D(), Twist2D())))
    assert not np.array_equal(
        localizer.particles.poses[: len(before)], before[: len(localizer.particles.poses)]
    )


def test_odometry_is_interpolated():
    messages = deque(Odometry(t, Pose2D(10.0 * t, 0.0, t), Twist2D()) for t in (1.0, 2.0, 4.0))
    assert pose_at(messages, 2.0) == Pose2D(20.0, 0.0, 2.0)
    assert pose_at(messages, 4.0).x == pytest.approx(40.0)
    assert pose_at(messages, 3.0).x == pytest.approx(30.0)
    assert pose_at(messages, 3.0).yaw == pytest.approx(3.0)
    assert pose_at(messages, 0.0) == Pose2D(10.0, 0.0, 1.0)


def test_chance_comes_from_the_given_generator_or_the_seed(room, drive):
    def final(seed, **params):
        return drive(started(room, seed, **params), seconds=3.0)[-1][0].pose

    assert final(1) == final(1)
    assert final(1) != final(2)
    assert final(1, random_seed=5) == final(2, random_seed=5)
    localizer = started(room, 3)
    first = drive(localizer, seconds=3.0)[-1][0].pose
    localizer.reset(Belief(START), np.random.default_rng(3))
    # nothing of the earlier drive is left
    assert drive(localizer, seconds=3.0)[-1][0].pose == first


def test_global_localization(room, drive):
    localizer = started(room, max_particles=8000, resample_interval=1)
    localizer.localize_globally()
    rows = drive(localizer)
    assert rows[0][0].health is Health.LOST
    assert errors(rows)[-1] < 0.2
    assert rows[-1][0].health is Health.TRACKING


def test_a_scan_that_states_no_range_is_passed_over(room, see):
    localizer = started(room)
    for stamp in (0.0, 0.1):
        scan = replace(see(START, stamp), range_max=0.0)
        belief = localizer.update(
            Observation(stamp, Odometry(stamp, Pose2D(), Twist2D()), scan=scan)
        )
    assert belief.pose == START
    assert localizer._last_pose is None, "no scan has counted"


def test_lost_it_looks_again_where_it_stands(room, see):
    for candidates, finds in ((0, False), (5000, True)):
        localizer = started(
            room,
            max_particles=8000,
            resample_interval=1,
            recovery_candidates=candidates,
        )
        localizer.localize_globally()
        for tick in range(600):
            stamp = tick / 30.0
            scan = see(START, stamp) if tick % 3 == 0 else None
            belief = localizer.update(
                Observation(stamp, Odometry(stamp, Pose2D(), Twist2D()), scan=scan)
            )
        assert (errors([(belief, START)])[0] < 0.2) == finds
        assert (belief.health is not Health.LOST) == finds


def test_carried_away_it_says_so_and_finds_itself_again(room, drive):
    recovery = {
        "recovery_alpha_slow": 0.001,
        "recovery_alpha_fast": 0.1,
        "recovery_candidates": 5000,
    }
    for params, finds in (({}, False), (recovery, True)):
        localizer = started(room, **params)
        drive(localizer, seconds=8.0)
        elsewhere = Pose2D(8.5, 6.0, -2.0)
        localizer._odometry.clear()  # the wheels' count starts anew with the next drive
        localizer._last_pose = localizer._map_to_odom = None
        rows = drive(localizer, seconds=15.0, start=elsewhere)
        health = [belief.health for belief, _ in rows]
        assert Health.LOST in health or Health.DEGRADED in health
        assert (errors(rows)[-1] < 0.3) == finds
        assert (health[-1] is Health.TRACKING) == finds


def test_a_scan_that_shows_nothing_changes_nothing_of_the_health(room):
    localizer = started(room, resample_interval=1)
    nothing = LaserScan(0.0, np.full(BEAMS, np.inf), -math.pi, 2.0 * math.pi / BEAMS, 0.05, RANGE)
    belief = localizer.update(Observation(0.0, Odometry(0.0, Pose2D(), Twist2D()), scan=nothing))
    assert belief.health is not Health.LOST
    assert np.isfinite(belief.covariance).all()


@pytest.mark.parametrize(
    ("explained", "health"),
    [(3, Health.LOST), (4, Health.DEGRADED), (7, Health.DEGRADED), (8, Health.TRACKING)],
)
def test_of_sixteen_returns_so_many_must_be_explained(room, explained, health):
    """The wall is 8.95 m ahead, and nothing stands 3 m ahead."""
    localizer = started(room, belief=Belief(Pose2D(3.0, 4.0, 0.0), np.diag((1e-6, 1e-6, 1e-8))))
    scan = LaserScan(
        0.0,
        np.repeat((8.9, 3.0), (explained, 16 - explained)),
        0.0,
        1e-9,
        0.05,
        RANGE,
    )
    assert (
        localizer.update(Observation(0.0, Odometry(0.0, Pose2D(), Twist2D()), scan=scan)).health
        is health
    )


@pytest.mark.parametrize(
    ("elsewhere", "health"),
    [(513, Health.LOST), (512, Health.DEGRADED), (103, Health.DEGRADED), (102, Health.TRACKING)],
)
def test_half_of_the_weight_must_be_in_one_place(room, elsewhere, health):
    # the first belief is of the particles as they were spread
    localizer = started(room, resample_interval=2)
    poses = np.tile((3.0, 4.0, 0.0), (1024, 1))
    poses[:elsewhere, 0] = np.where(np.arange(elsewhere) % 2, 5.0, 7.0)
    localizer.particles.poses, localizer.particles.weights = poses, np.full(1024, 1.0 / 1024.0)
    scan = LaserScan(0.0, np.full(16, 8.9), 0.0, 1e-9, 0.05, RANGE)
    assert (
        localizer.update(Observation(0.0, Odometry(0.0, Pose2D(), Twist2D()), scan=scan)).health
        is health
    )


def test_it_is_built_from_a_nav2_file_by_name(room, tmp_path):
    from navstack.params.nav2_file.file import load_nav2

    file = tmp_path / "robot.yaml"
    file.write_text(
        "amcl: {ros__parameters: {max_particles: 700, robot_model_type: omnidirectional}}\n"
    )
    localizer = build_localizer("amcl", load_nav2(file, False), room)
    assert len(localizer.particles.poses) == 700


@pytest.mark.parametrize(
    ("deviation", "weight", "explained", "health"),
    [
        (DEGRADED_ABOVE, DEGRADED_UNDER, DEGRADED_BELOW, Health.TRACKING),
        (0.51, 1.0, 1.0, Health.DEGRADED),
        (0.0, 0.89, 1.0, Health.DEGRADED),
        (0.0, 1.0, 0.49, Health.DEGRADED),
        (LOST_ABOVE, LOST_UNDER, LOST_BELOW, Health.DEGRADED),
        (2.01, 1.0, 1.0, Health.LOST),
        (0.0, 0.49, 1.0, Health.LOST),
        (0.0, 1.0, 0.24, Health.LOST),
    ],
)
def test_health_at_its_limits(deviation, weight, explained, health):
    cluster = SimpleNamespace(weight=weight, covariance=np.diag((0.0, deviation**2, 9.0)))
    assert AmclLocalizer._health(SimpleNamespace(_heaviest=cluster, _explained=explained)) is health
