"""Errors that real sensors have: the simulated statistics against the formulas."""

import dataclasses
import math

import numpy as np
import pytest

from harness.storage.shipped import shipped
from harness.world.physics.body_state import BodyState
from harness.world.sensors.gps_receiver import GpsParams, GpsReceiver
from harness.world.sensors.inertial_unit import ImuParams, InertialUnit
from harness.world.sensors.noise import GaussMarkov, RandomWalk
from harness.world.sensors.suite import SensorParams
from harness.world.sensors.wheel_odometry import OdometryParams, WheelOdometry
from navstack.errors import ParameterError
from navstack.params.strict import load_dataclass
from navstack.types import Pose2D

NOBODY = np.empty((0, 4))
EPISODES = 400
EXACT_WHEELS = OdometryParams(10.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
EXACT_UNIT = ImuParams(10.0, 0.0, 0.0, 0.0, 0.0)


class Hidden:
    """A sky of which a share is hidden that depends on x."""

    def __init__(self, share):
        self._share = share

    def hidden(self, x, y):
        return self._share(x)


HALF = Hidden(lambda x: 0.5)


def measure(sensor, bodies, seed=0, dt=0.1):
    """What a sensor measures as the robot goes from body to body."""
    sensor.reset(bodies[0], np.random.default_rng(seed))
    return [sensor.measure(body, NOBODY, k * dt) for k, body in enumerate(bodies)]


def assert_deviation(values, expected, mean=0.0):
    """The sample has the deviation (about the mean) within four standard errors of a normal's."""
    found = math.sqrt(np.mean((np.asarray(values) - mean) ** 2))
    assert abs(found - expected) < 4.0 * expected / math.sqrt(2.0 * len(values)), (found, expected)


def test_a_gauss_markov_process_is_stationary_and_forgets_exponentially_whatever_the_steps():
    n = 20_000
    process = GaussMarkov(np.random.default_rng(1), n, 5.0)
    stamps = (0.0, 0.1, 3.0, 3.5, 10.0, 11.0)
    values = [np.array(process.at(stamp)) for stamp in stamps]
    for stamp, value in zip(stamps, values, strict=True):
        assert_deviation(value, 1.0)
        assert np.mean(values[0] * value) == pytest.approx(
            math.exp(-stamp / 5.0), abs=4.0 * math.sqrt(2.0 / n)
        )


def test_the_variance_of_a_random_walk_is_time():
    ends = []
    for seed in range(EPISODES):
        walk = RandomWalk(np.random.default_rng(seed))
        ends.append([walk.at(stamp) for stamp in (0.0, 0.5, 4.0, 9.0)])
    for column, time in enumerate((0.5, 4.0, 9.0), 1):
        assert_deviation([row[column] for row in ends], math.sqrt(time))


def accelerating(acceleration, speed=0.0, n=21, dt=0.1):
    """A straight drive."""
    times = dt * np.arange(n)
    return [
        BodyState(
            speed * t + 0.5 * acceleration * t * t, vx=speed + acceleration * t, ax=acceleration
        )
        for t in times
    ]


@pytest.mark.parametrize(
    ("acceleration", "speed", "sign"), [(2.0, 0.1, 1), (-2.0, 5.0, -1), (-2.0, -0.1, 1)]
)
def test_pulling_wheels_turn_too_far_and_braking_ones_too_little(acceleration, speed, sign):
    sensor = WheelOdometry(dataclasses.replace(EXACT_WHEELS, slip=0.05))
    bodies = accelerating(acceleration, speed)
    ratios = []
    for seed in range(EPISODES):
        last = measure(sensor, bodies, seed)[-1]
        ratios.append(last.pose.x / (bodies[-1].x - bodies[0].x) - 1.0)
        assert last.twist.linear_x / bodies[-1].vx - 1.0 == pytest.approx(ratios[-1])
    assert np.all(np.sign(ratios) == sign)
    expected = 0.05 * 2.0 / 9.81  # the slope's root mean square times the traction
    assert math.sqrt(np.mean(np.square(ratios))) == pytest.approx(
        expected, rel=4.0 * math.sqrt(0.5 / EPISODES)
    )


def test_turns_count_too_large_by_the_lateral_traction_and_steady_driving_is_exact():
    sensor = WheelOdometry(dataclasses.replace(EXACT_WHEELS, slip=0.05))
    speed, rate = 1.5, 0.8
    yaws = rate * 0.1 * np.arange(11)
    radius = speed / rate
    circle = [
        BodyState(radius * math.sin(a), radius * (1 - math.cos(a)), a, speed, 0.0, rate, 0.0, 1.2)
        for a in yaws
    ]
    ratios = [
        measure(sensor, circle, seed)[-1].pose.yaw / yaws[-1] - 1.0 for seed in range(EPISODES)
    ]
    assert min(ratios) > 0.0
    expected = 0.05 * 1.2 / 9.81
    assert math.sqrt(np.mean(np.square(ratios))) == pytest.approx(
        expected, rel=4.0 * math.sqrt(0.5 / EPISODES)
    )
    steady = accelerating(0.0, 1.0)
    assert measure(sensor, steady)[-1].pose.x == pytest.approx(steady[-1].x, abs=1e-12)


def test_a_shock_slips_no_more_than_a_wheel_can_pull():
    sensor = WheelOdometry(dataclasses.replace(EXACT_WHEELS, slip=0.05))
    hit = measure(sensor, [BodyState(), BodyState(0.1, vx=1.0, ax=500.0)])[-1].pose.x
    strongest = measure(sensor, [BodyState(), BodyState(0.1, vx=1.0, ax=9.81)])[-1].pose.x
    assert hit == strongest


def test_odometry_is_what_its_formulas_say():
    """Along an arc, with all errors at once.

    The numbers are those that the generator gives in this order.
    """
    params = OdometryParams(10.0, 0.01, 0.02, 0.03, 0.04, 0.05, 0.06, 0.07, 0.08)
    slip = abs(np.random.default_rng(6).spawn(1)[0].standard_normal())
    rng = np.random.default_rng(6)
    scales, white = rng.standard_normal(2), rng.standard_normal((256, 5))[1]
    distance, turn = 0.2, 0.1
    chord = 2.0 * distance / turn * math.sin(0.5 * turn)
    moved = BodyState(
        chord * math.cos(0.05),
        chord * math.sin(0.05),
        turn,
        1.5,
        0.0,
        0.8,
        2.0,
        -1.2,
    )
    first, odometry = measure(WheelOdometry(params), [BodyState(), moved], seed=6)
    assert first.pose == Pose2D()
    linear = (1.0 + 0.01 * scales[0]) * (1.0 + 0.08 * slip * 2.0 / 9.81)
    angular = (1.0 + 0.02 * scales[1]) * (1.0 + 0.08 * slip * 1.2 / 9.81)
    way = linear * distance + 0.03 * math.sqrt(distance) * white[0]
    angle = (
        angular * turn + 0.04 * math.sqrt(distance) * white[1] + 0.05 * math.sqrt(turn) * white[2]
    )
    place = [way / angle * math.sin(angle), way / angle * (1.0 - math.cos(angle)), angle]
    assert odometry.pose.as_array() == pytest.approx(place)
    assert odometry.twist.linear_x == pytest.approx(linear * 1.5 + 0.06 * white[3])
    assert odometry.twist.angular_z == pytest.approx(angular * 0.8 + 0.07 * white[4])
    assert odometry.twist.linear_y == 0.0


def test_the_inertial_unit_is_what_its_formulas_say():
    """All errors at once; the numbers are those that the generators give in this order."""
    params = ImuParams(10.0, 0.01, 0.02, 0.03, 0.04, True, 0.05, 0.06, 2.0)
    rng = np.random.default_rng(6)
    of_bias, of_wander = rng.spawn(2)
    bias, white = 0.03 * rng.standard_normal(), rng.standard_normal((256, 4))[1]
    walk, (before, fresh) = of_bias.standard_normal(1)[0], of_wander.standard_normal(256)[:2]
    moved = BodyState(1.0, 2.0, 3.1, 0.5, 0.0, 0.8, 1.5, -0.7)
    found = measure(InertialUnit(params), [BodyState(), moved], seed=6)[1]
    wander = 0.06 * (math.exp(-0.05) * before + math.sqrt(1.0 - math.exp(-0.1)) * fresh)
    assert found.yaw == pytest.approx(math.remainder(3.1 + 0.01 * white[0] + wander, 2.0 * math.pi))
    assert found.angular_velocity_z == pytest.approx(
        0.8 + bias + 0.05 * math.sqrt(0.1) * walk + 0.02 * white[1]
    )
    accelerations = found.linear_acceleration_x, found.linear_acceleration_y
    assert accelerations == pytest.approx((1.5 + 0.04 * white[2], -0.7 + 0.04 * white[3]))
    assert (found.stamp, found.yaw_std, found.yaw_rate_std) == (
        0.1,
        pytest.approx(math.hypot(0.01, 0.06)),
        0.02,
    )


def test_a_fix_is_what_its_formulas_say():
    params = GpsParams(10.0, 0.1, 0.5, 4.0, 2.0, 1.0, 0.25)
    rng = np.random.default_rng(6)
    drift, multipath, _ = (each.standard_normal((256, 2)) for each in rng.spawn(3))
    white = rng.standard_normal((256, 2))[1]
    fix = measure(
        GpsReceiver(params, Hidden(lambda x: 0.3)), [BodyState(), BodyState(4.0, -2.0)], seed=6
    )[1]
    kept, lost = math.exp(-0.025), math.exp(-0.1)
    error = 0.1 * white + 0.5 * (kept * drift[0] + math.sqrt(1.0 - kept**2) * drift[1])
    # 0.3 of the sky, not half
    error += 2.0 * 0.6 * (lost * multipath[0] + math.sqrt(1.0 - lost**2) * multipath[1])
    assert (fix.x, fix.y) == pytest.approx((4.0 + error[0], -2.0 + error[1]))
    assert (fix.stamp, fix.position_std) == (
        0.1,
        pytest.approx(math.hypot(0.1, 0.25 * math.hypot(0.5, 1.2))),
    )


def test_the_gyro_bias_walks_from_where_it_began():
    sensor = InertialUnit(
        dataclasses.replace(EXACT_UNIT, yaw_rate_bias_std=0.002, yaw_rate_bias_walk=0.001)
    )
    rows = [measure(sensor, [BodyState()] * 161, seed) for seed in range(EPISODES)]
    rates = np.array([[imu.angular_velocity_z for imu in row] for row in rows])
    for k in (0, 40, 160):
        assert_deviation(rates[:, k], math.sqrt(0.002**2 + 0.001**2 * 0.1 * k))
    assert_deviation(np.diff(rates, axis=1).ravel(), 0.001 * math.sqrt(0.1))


def test_the_heading_wanders_slowly_and_says_how_much():
    sensor = InertialUnit(
        dataclasses.replace(EXACT_UNIT, yaw_std=0.03, yaw_wander_std=0.04, yaw_wander_time=2.0)
    )
    rows = [measure(sensor, [BodyState(yaw=0.5)] * 41, seed) for seed in range(1000)]
    errors = np.array([[imu.yaw - 0.5 for imu in row] for row in rows])
    assert_deviation(errors[:, 0], 0.05)
    assert_deviation(errors[:, -1], 0.05)
    lag = 15  # 1.5 s: the white part has forgotten, the wander has not
    expected = 0.04**2 * math.exp(-1.5 / 2.0)
    found = np.mean(errors[:, 10] * errors[:, 10 + lag])
    assert found == pytest.approx(expected, abs=4.0 * 0.05**2 / math.sqrt(1000))
    assert rows[0][0].yaw_std == pytest.approx(0.05)


def test_a_unit_without_heading_says_so_and_measures_the_rest_as_before():
    noisy = dataclasses.replace(EXACT_UNIT, yaw_std=0.03, yaw_rate_std=0.01, acceleration_std=0.1)
    without = measure(
        InertialUnit(dataclasses.replace(noisy, has_heading=False)), [BodyState()] * 50
    )
    known = measure(InertialUnit(noisy), [BodyState()] * 50)
    assert all(math.isnan(imu.yaw) and imu.yaw_std == 0.0 for imu in without)
    assert [imu.angular_velocity_z for imu in without] == [imu.angular_velocity_z for imu in known]


def test_messages_state_their_white_deviations():
    wheels = WheelOdometry(dataclasses.replace(EXACT_WHEELS, velocity_std=0.02, yaw_rate_std=0.01))
    odometry = measure(wheels, [BodyState()])[0]
    assert (odometry.velocity_std, odometry.yaw_rate_std) == (0.02, 0.01)
    imu = measure(
        InertialUnit(dataclasses.replace(EXACT_UNIT, yaw_std=0.03, yaw_rate_std=0.004)),
        [BodyState()],
    )[0]
    assert (imu.yaw_std, imu.yaw_rate_std) == (0.03, 0.004)


@pytest.mark.parametrize("share", [0.0, 0.25, 0.8])
def test_multipath_grows_with_the_hidden_sky_and_is_correlated_in_time(share):
    params = GpsParams(
        10.0,
        0.1,
        drift_std=0.5,
        drift_time=100.0,
        multipath_std=2.0,
        multipath_time=3.0,
    )
    receiver = GpsReceiver(params, Hidden(lambda x: share))
    rows = [measure(receiver, [BodyState(4.0, -2.0)] * 51, seed) for seed in range(1000)]
    errors = np.array([[(fix.x - 4.0, fix.y + 2.0) for fix in row] for row in rows])
    variances = (0.1**2, 0.5**2, (2.0 * share / 0.5) ** 2)
    for k in (0, 50):
        assert_deviation(errors[:, k].ravel(), math.sqrt(sum(variances)))
    for lag in (10, 40):
        expected = variances[1] * math.exp(-0.1 * lag / 100.0) + variances[2] * math.exp(
            -0.1 * lag / 3.0
        )
        found = np.mean(errors[:, 0] * errors[:, lag])
        assert found == pytest.approx(expected, abs=4.0 * sum(variances) / math.sqrt(2000))


def test_the_stated_deviation_holds_the_white_noise_and_a_share_of_the_rest():
    params = GpsParams(10.0, 0.3, drift_std=2.0, multipath_std=4.0, stated_share=0.5)
    fix = measure(GpsReceiver(params, Hidden(lambda x: 0.25)), [BodyState()])[0]
    assert fix.position_std == pytest.approx(math.sqrt(0.3**2 + 0.25 * (2.0**2 + 2.0**2)))
    honest = measure(GpsReceiver(GpsParams(10.0, 0.3), HALF), [BodyState()])[0]
    assert honest.position_std == 0.3


def test_the_fix_is_lost_in_a_canyon_and_comes_back_only_where_more_sky_is_seen():
    params = GpsParams(10.0, 0.0, lost_above=0.8, found_below=0.6)
    shares = [0.7, 0.79, 0.81, 0.7, 0.61, 0.6, 0.79, 0.81, 0.5]
    receiver = GpsReceiver(params, Hidden(lambda x: shares[int(x)]))
    fixes = measure(receiver, [BodyState(float(k)) for k in range(len(shares))])
    assert [fix is not None for fix in fixes] == [
        True,
        True,
        False,
        False,
        False,
        True,
        True,
        False,
        True,
    ]


def test_satellites_are_acquired_again_after_an_exponential_time():
    params = GpsParams(10.0, 0.0, lost_above=0.8, found_below=0.6, reacquisition_time=2.0)
    receiver = GpsReceiver(params, Hidden(lambda x: 0.9 if x < 1.0 else 0.3))
    waits = []
    for seed in range(1000):
        receiver.reset(BodyState(), np.random.default_rng(seed))
        assert receiver.measure(BodyState(0.0), NOBODY, 0.0) is None
        stamps = 0.1 + 0.01 * np.arange(3000)
        waits.append(
            next(t for t in stamps if receiver.measure(BodyState(2.0), NOBODY, t) is not None) - 0.1
        )
    assert np.mean(waits) == pytest.approx(2.0, abs=4.0 * 2.0 / math.sqrt(1000))
    assert np.mean(np.array(waits) > 2.0) == pytest.approx(
        math.exp(-1.0), abs=4.0 * 0.48 / math.sqrt(1000)
    )


def test_scripted_outages_hold_no_fix_and_leave_the_others_as_they_were():
    bodies = [BodyState()] * 60
    silent = measure(
        GpsReceiver(GpsParams(10.0, 0.5, outages=((1.0, 2.0), (4.0, 4.5))), HALF), bodies
    )
    always = measure(GpsReceiver(GpsParams(10.0, 0.5), HALF), bodies)
    missing = [k for k, fix in enumerate(silent) if fix is None]
    assert missing == [*range(10, 20), *range(40, 45)]
    assert all(fix == other for fix, other in zip(silent, always, strict=True) if fix is not None)


def test_an_error_that_is_switched_on_adds_to_the_others_without_changing_them():
    bodies = [BodyState(0.1 * k, vx=1.0) for k in range(100)]
    values = {}
    for white in (0.0, 0.5):
        for slow in (0.0, 2.0):
            params = GpsParams(10.0, white, drift_std=slow, multipath_std=slow)
            values[white, slow] = np.array(
                [fix.x for fix in measure(GpsReceiver(params, HALF), bodies)]
            )
    slow_error = values[0.0, 2.0] - values[0.0, 0.0]
    assert np.ptp(slow_error) > 0.1
    np.testing.assert_allclose(values[0.5, 2.0] - values[0.5, 0.0], slow_error, atol=1e-12)
    with_walk = dataclasses.replace(
        EXACT_UNIT,
        yaw_rate_std=0.01,
        yaw_rate_bias_walk=0.01,
        yaw_wander_std=0.1,
    )
    without = dataclasses.replace(with_walk, yaw_rate_bias_walk=0.0, yaw_wander_std=0.0)
    walk_only = dataclasses.replace(with_walk, yaw_rate_std=0.0)
    noisy, white, walk = (
        np.array([imu.angular_velocity_z for imu in measure(InertialUnit(params), bodies)])
        for params in (with_walk, without, walk_only)
    )
    np.testing.assert_allclose(noisy - white, walk, atol=1e-12)
    slipping = dataclasses.replace(EXACT_WHEELS, velocity_std=0.02, slip=0.05)
    steady = dataclasses.replace(slipping, slip=0.0)
    # no traction, no slip
    assert measure(WheelOdometry(slipping), bodies) == measure(WheelOdometry(steady), bodies)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("lost_above: 0.77", "lost_above: 1.2", "lost_above 1.2"),
        ("found_below: 0.70", "found_below: 0.9", "found_below 0.9 is above lost_above 0.77"),
        ("multipath_time: 10.0", "multipath_time: 0.0", "multipath_time 0"),
        ("multipath_std: 0.3", "multipath_std: -0.3", "multipath_std -0.3"),
        ("latency: 0.1", "latency: -0.1", "latency -0.1"),
        ("latency: 0.1", "outages: [[5.0, 3.0]]", "outage from 5.0 to 3.0"),
        ("dropout: 0.01", "dropout: 1.5", "dropout 1.5"),
        ("glass_transmission: 0.4", "glass_transmission: -0.4", "glass_transmission -0.4"),
        ("slip: 0.03", "slip: -1.0", "slip -1"),
        ("has_heading: true", "has_heading: 3", "has_heading"),
        ("yaw_wander_time: 10.0", "yaw_wander_time: -1.0", "yaw_wander_time -1"),
    ],
)
def test_impossible_errors_are_refused_by_name(tmp_path, old, new, message):
    text = (shipped("params") / "sensors" / "rtk_urban.yaml").read_text()
    assert old in text
    file = tmp_path / "sensors.yaml"
    file.write_text(text.replace(old, new))
    with pytest.raises(ParameterError, match=message):
        load_dataclass(SensorParams, file)
