"""What the GPS-EKF does when things go wrong, and when they do not."""

import dataclasses
import math

import numpy as np
import pytest

from navstack.build import build_localizer
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.localization.gps import LOST_AFTER
from navstack.localization.gps_ekf import UNKNOWN_YAW_VARIANCE, GpsEkfLocalizer
from navstack.localization.gps_ekf_kernels import GPS_X, GPS_Y, OFFSET, SIZE, SPEED, YAW, X, Y
from navstack.params.nav2_file.file import load_nav2
from navstack.types import Belief, GpsFix, Health, Imu, Observation, Odometry, Pose2D, Twist2D

from .gps_ekf_runs import PARAMS, moved, off, rms, run, started, turned, without

RATE = 30.0


def test_it_is_better_than_the_fixes(drive):
    observations, truth = drive(1, 60.0)
    beliefs = run(started(), observations)
    raw = [
        math.hypot(o.gps.x - b.x, o.gps.y - b.y)
        for o, b in zip(observations, truth, strict=True)
        if o.gps
    ]
    assert rms(beliefs[300:], truth[300:]) < 0.5 * math.sqrt(np.mean(np.square(raw)))
    assert max(
        turned(*pair) for pair in zip(beliefs[300:], truth[300:], strict=True)
    ) < math.radians(5.0)
    assert all(belief.health is Health.TRACKING for belief in beliefs[60:])


def test_late_fixes_count_as_if_they_had_come_in_time(drive):
    observations, _ = drive(2, 20.0)
    # ticks: up to 0.8 s, so they overtake others
    delays = np.random.default_rng(3).integers(0, 25, len(observations))
    arrivals = {}
    for i, observation in enumerate(observations):
        if observation.gps is not None and i + delays[i] < len(observations) - 60:
            arrivals.setdefault(i + int(delays[i]), []).append(observation.gps)
        elif observation.gps is not None:
            arrivals.setdefault(i, []).append(observation.gps)
    late = started()
    for i, observation in enumerate(observations):
        last = late.update(without(observation, "gps"))
        for fix in arrivals.get(i, ()):
            last = late.update(Observation(observation.stamp, gps=fix))
    in_order = run(started(), observations)[-1]
    np.testing.assert_allclose(last.pose.as_array(), in_order.pose.as_array(), atol=1e-9)
    np.testing.assert_allclose(last.covariance, in_order.covariance, atol=1e-9)


def test_wheels_and_gyro_may_be_late_too(drive):
    observations, _ = drive(2, 10.0)
    shuffled, later = started(), []
    for observation in observations:
        last = shuffled.update(without(observation, "imu"))
        later.append(observation.imu)
        if len(later) == 3:
            for imu in reversed(later):
                last = shuffled.update(Observation(observation.stamp, imu=imu))
            later.clear()
    in_order = run(started(), observations)[-1]
    np.testing.assert_allclose(last.pose.as_array(), in_order.pose.as_array(), atol=1e-9)


def test_a_fix_from_before_the_history_is_passed_over(drive):
    observations, _ = drive(2, 10.0)
    params = dataclasses.replace(PARAMS, history_length=1.0)
    with_old, plain = started(params), started(params)
    run(plain, observations)
    run(with_old, observations)
    old = Observation(observations[-1].stamp, gps=GpsFix(-1.0, 300.0, 300.0, 0.1))
    assert with_old.update(old).pose == plain.update(Observation(old.stamp)).pose


def test_outliers_do_not_move_it(drive):
    observations, truth = drive(5, 60.0)
    rng = np.random.default_rng(1)
    angles = rng.uniform(0.0, 2.0 * math.pi, len(observations))
    struck = rng.random(len(observations)) < 0.2
    struck[:150] = False
    given = [
        moved(o, 10.0 * math.cos(angle), 10.0 * math.sin(angle)) if hit else o
        for o, angle, hit in zip(observations, angles, struck, strict=True)
    ]
    spoilt, clean = run(started(), given), run(started(), observations)
    assert max(off(*pair) for pair in zip(spoilt[300:], truth[300:], strict=True)) < 1.0
    assert rms(spoilt, truth) < 1.5 * rms(clean, truth) + 0.05


@pytest.mark.parametrize(
    "wrong", [Pose2D(30.0, -20.0, 0.0), Pose2D(0.0, 0.0, 2.5), Pose2D(5.0, 5.0, -1.5)]
)
def test_it_gets_out_of_a_lock_out(drive, wrong):
    """Sure of a wrong start it refuses the truth at first, but not for ever."""
    observations, truth = drive(6, 60.0)
    localizer = started(belief=Belief(wrong, np.diag((1e-4, 1e-4, 1e-4))))
    beliefs = run(localizer, observations)
    assert off(beliefs[30], truth[30]) > 1.0 or turned(beliefs[30], truth[30]) > 1.0
    assert off(beliefs[-1], truth[-1]) < 1.0
    assert turned(beliefs[-1], truth[-1]) < math.radians(6.0)


def test_after_a_lock_out_only_what_wheels_and_gyro_say_is_left(drive):
    observations, _ = drive(6, 5.0)
    last = observations[-1].stamp
    states = []
    for count in (9, 1):  # the first one refuses the fix only
        params = dataclasses.replace(PARAMS, gps0_rejection_threshold=20.0, gps0_lockout_time=0.0)
        localizer = started(dataclasses.replace(params, gps0_lockout_count=count))
        run(localizer, observations)
        belief = localizer.update(Observation(last, gps=GpsFix(last, 300.0, -200.0, 0.7)))
        states.append(localizer.state)
    before, after = states
    mean, covariance = before.mean.copy(), np.zeros((SIZE, SIZE))
    assert before.rejected == 1 and np.abs(mean[[GPS_X, GPS_Y]]).min() > 1e-3
    mean[[X, Y, GPS_X, GPS_Y]] = 300.0, -200.0, 0.0, 0.0
    covariance[SPEED:OFFSET, SPEED:OFFSET] = before.covariance[SPEED:OFFSET, SPEED:OFFSET]
    covariance[X, X] = covariance[Y, Y] = 0.7**2
    covariance[YAW, YAW] = covariance[OFFSET, OFFSET] = UNKNOWN_YAW_VARIANCE
    np.testing.assert_array_equal(after.mean, mean)
    np.testing.assert_allclose(after.covariance, covariance, rtol=1e-12)
    assert (after.rejected, after.stamp, localizer.knows_heading) == (0, last, False)
    assert (belief.pose.x, belief.pose.y) == (300.0, -200.0)
    np.testing.assert_allclose(belief.covariance, np.diag((0.7**2, 0.7**2, 0.5**2)), atol=1e-12)


@pytest.mark.slow
def test_dead_reckoning_through_an_outage(drive):
    """20 s without fixes, after 40 s with them.

    Within 2 % of the distance, and the filter says what it risks.
    """
    drifts, squares = [], []
    for seed in range(20):
        observations, truth = drive(seed, 60.0, "rtk_good")
        beliefs = run(
            started(), [o if i < 1200 else without(o, "gps") for i, o in enumerate(observations)]
        )
        distance = sum(abs(body.vx) for body in truth[1200:]) / RATE
        start = np.array(
            (beliefs[1199].pose.x - truth[1199].x, beliefs[1199].pose.y - truth[1199].y)
        )
        end = np.array((beliefs[-1].pose.x - truth[-1].x, beliefs[-1].pose.y - truth[-1].y))
        drifts.append(np.linalg.norm(end - start) / distance)
        squares.append(end @ np.linalg.solve(beliefs[-1].covariance[:2, :2], end))
    assert np.mean(drifts) < 0.01
    assert max(drifts) < 0.02
    assert np.mean(squares) < 4.0  # 2 of a filter that is neither too sure nor too shy


def test_health(drive):
    observations, _ = drive(7, 40.0)
    localizer = started()
    beliefs = run(localizer, [o if o.stamp < 20.0 else without(o, "gps") for o in observations])
    by_stamp = {round(belief.stamp, 3): belief.health for belief in beliefs}
    assert by_stamp[19.0] is Health.TRACKING
    assert by_stamp[20.0 + LOST_AFTER] is Health.DEGRADED  # raw GPS would be lost by now
    last = observations[-1].stamp
    params = localizer._params
    lost = [localizer.update(Observation(last + dt)).health for dt in (1.0, params.lost_after)]
    assert lost == [Health.DEGRADED, Health.LOST]
    fix = GpsFix(last + params.lost_after + 1.0, beliefs[-1].pose.x, beliefs[-1].pose.y, 0.1)
    run(
        localizer,
        [
            Observation(
                fix.stamp + 0.1 * i, gps=dataclasses.replace(fix, stamp=fix.stamp + 0.1 * i)
            )
            for i in range(60)
        ],
    )
    assert localizer.update(Observation(fix.stamp + 6.0)).health is not Health.LOST


@pytest.mark.parametrize("angle", [0.0, 0.4, 1.2, math.pi / 2.0, 2.5])
@pytest.mark.parametrize(
    ("std", "health"), [(0.9, Health.TRACKING), (1.1, Health.DEGRADED), (3.1, Health.LOST)]
)
def test_health_is_that_of_the_worst_direction(angle, std, health):
    localizer = started()
    localizer.update(Observation(0.0, gps=GpsFix(0.0, 0.0, 0.0, 0.1)))
    turned_ = np.array(((math.cos(angle), -math.sin(angle)), (math.sin(angle), math.cos(angle))))
    covariance = np.eye(3)
    covariance[:2, :2] = turned_ @ np.diag((std**2, 0.05**2)) @ turned_.T
    assert localizer._health(localizer.state, covariance) is health


@pytest.mark.parametrize(
    ("age", "health"),
    [
        (2.0, Health.TRACKING),
        (2.01, Health.DEGRADED),
        (60.0, Health.DEGRADED),
        (60.01, Health.LOST),
    ],
)
def test_health_falls_with_the_age_of_the_last_fix_that_was_let_in(age, health):
    localizer = started()
    localizer.update(Observation(128.0))
    state, covariance = localizer.state.copy(), np.zeros((3, 3))
    state.accepted_stamp = 128.0 - age
    assert localizer._health(state, covariance) is health
    localizer._last_fix = (GpsFix(128.0, 0.0, 0.0, 0.1), 0.0)
    assert localizer._health(state, covariance) is Health.TRACKING
    assert started(uses_fixes=False)._health(state, covariance) is Health.TRACKING


def test_a_slipping_wheel_counts_less():
    """One wheel spins for 2 s: the wheels say 1 m/s more and a turn.

    The gyro and the accelerometer do not.
    """

    def observation(i):
        stamp, spins = i / RATE, 300 <= i < 360
        speed = 1.0 if not spins else 2.0
        return Observation(
            stamp,
            Odometry(stamp, Pose2D(), Twist2D(speed, 0.0, 2.0 if spins else 0.0), 0.02, 0.01),
            Imu(stamp, math.nan, 0.0, 0.001, 0.0, 0.0, 0.003),
        )

    start = Belief(Pose2D(), np.diag((1e-4, 1e-4, 1e-4)))
    beliefs = run(started(belief=start, uses_fixes=False), [observation(i) for i in range(450)])
    assert beliefs[-1].pose.x == pytest.approx(15.0, abs=0.7)  # by the wheels it would be 17
    assert abs(beliefs[-1].pose.y) < 0.1
    assert beliefs[-1].covariance[0, 0] > beliefs[290].covariance[0, 0]


def test_wheels_and_orientation_without_gps(drive):
    observations, truth = drive(8, 60.0, "rtk_good")
    localizer = started(uses_fixes=False)
    # fixes are not looked at
    beliefs = run(localizer, [moved(o, 50.0, 50.0) for o in observations])
    distance = sum(abs(body.vx) for body in truth) / RATE
    assert off(beliefs[-1], truth[-1]) < 0.02 * distance
    assert turned(beliefs[-1], truth[-1]) < 0.02


def test_wheels_alone_turn_it_where_there_is_no_gyro(drive):
    observations, truth = drive(8, 20.0, "rtk_good")
    localizer = started(belief=Belief(Pose2D(), np.diag((1e-4, 1e-4, 1e-4))), uses_fixes=False)
    beliefs = run(localizer, [without(o, "imu") for o in observations])
    assert turned(beliefs[-1], truth[-1]) < 0.1
    assert off(beliefs[-1], truth[-1]) < 1.0


def test_what_is_not_a_number_is_passed_over(drive):
    observations, truth = drive(9, 10.0)
    nan = math.nan
    bad = Observation(
        observations[-1].stamp,
        Odometry(observations[-1].stamp, Pose2D(), Twist2D(nan)),
        Imu(observations[-1].stamp, 0.0, nan, 0.0, 0.0),
        GpsFix(observations[-1].stamp, nan, 0.0, 0.1),
    )
    localizer = started()
    run(localizer, observations)
    belief = localizer.update(bad)
    assert np.isfinite(belief.pose.as_array()).all()
    assert off(belief, truth[-1]) < 1.0


def test_stamps_that_cannot_be(drive):
    """A message from next year makes no others late, and one from 1970 does not take for ever."""
    observations, truth = drive(9, 10.0)
    shift = 1.7e9
    localizer = started()
    localizer.update(Observation(0.0, odometry=Odometry(0.0, Pose2D(), Twist2D())))
    for i, observation in enumerate(observations):
        stamp = observation.stamp + shift
        given = {
            name: message
            and dataclasses.replace(
                message, stamp=stamp + (3e7 if i == 100 and name == "gps" else 0.0)
            )
            for name in ("odometry", "imu", "gps")
            for message in [getattr(observation, name)]
        }
        belief = localizer.update(Observation(stamp, **given))
    assert off(belief, truth[-1]) < 1.0
    assert belief.health is Health.TRACKING


def test_a_reset_forgets_everything(drive):
    observations, _ = drive(10, 5.0)
    localizer = started()
    first = run(localizer, observations)[-1]
    localizer.reset(Belief(Pose2D()), np.random.default_rng(1))
    again = run(localizer, observations)[-1]
    assert first.pose == again.pose
    np.testing.assert_array_equal(first.covariance, again.covariance)


@pytest.mark.parametrize("name", ["gps-ekf", "odom_imu"])
def test_it_is_chosen_by_name_and_reads_its_section(tmp_path, name):
    file = tmp_path / "robot.yaml"
    file.write_text(
        "gps_ekf: {ros__parameters: {gps0_lockout_count: 9, yaw_offset: 1.5}}\n", encoding="utf-8"
    )
    room = OccupancyGrid(np.zeros((4, 4), dtype=np.int8), 1.0, Pose2D())
    localizer = build_localizer(name, load_nav2(file, False), room)
    assert isinstance(localizer, GpsEkfLocalizer)
    assert localizer._params == dataclasses.replace(PARAMS, gps0_lockout_count=9, yaw_offset=1.5)


def test_a_heading_that_may_be_any_has_the_variance_of_a_uniform_one():
    assert UNKNOWN_YAW_VARIANCE == pytest.approx((2.0 * math.pi) ** 2 / 12.0)
