"""The filter's formulas.

Derivatives against finite differences, kernels against plain NumPy and filterpy.
"""

import dataclasses
import math

import numpy as np
import pytest

from navstack.localization import gps_ekf_filter, gps_ekf_kernels
from navstack.localization.gps_ekf import GpsEkfLocalizer
from navstack.localization.gps_ekf_filter import COMPILED, FilterState, GpsEkfFilter
from navstack.localization.gps_ekf_kernels import OFFSET, SIZE, SPEED, YAW, X, Y
from navstack.params.gps_ekf import GpsEkfParams
from navstack.types import Belief, GpsFix, Imu, Odometry, Pose2D, Twist2D

DENSITIES = np.array((0.02, 0.3, 0.01, 1e-4, 1e-5, 1e-3))


def random_state(seed):
    rng = np.random.default_rng(seed)
    mean = rng.normal(size=SIZE) * (5.0, 5.0, 2.0, 1.5, 0.05, 0.05, 1.0, 1.0, 1.0)
    root = rng.normal(size=(SIZE, SIZE))
    return mean, root @ root.T + np.eye(SIZE), rng


def test_a_copy_of_the_state_has_every_field_and_arrays_of_its_own():
    mean, covariance, rng = random_state(0)
    names = [each.name for each in dataclasses.fields(FilterState)[2:]]
    state = FilterState(mean, covariance, **dict(zip(names, rng.normal(size=99), strict=False)))
    kept = dataclasses.asdict(state)
    copied = state.copy()
    state.mean += 1.0
    state.covariance += 1.0
    for name, value in dataclasses.asdict(copied).items():
        assert np.array_equal(value, kept[name]), name


@pytest.mark.parametrize("seed", range(10))
def test_the_motions_jacobian(seed):
    mean, _, rng = random_state(seed)
    dt, rate, gyro, push = 0.08, rng.normal(), float(seed % 2), rng.normal()

    def moved(state):
        state = state.copy()
        gps_ekf_kernels.move(state, dt, rate, gyro, push)
        return state

    step = 1e-6
    numeric = np.column_stack(
        [(moved(mean + step * e) - moved(mean - step * e)) / (2 * step) for e in np.eye(SIZE)]
    )
    found = gps_ekf_kernels.motion_jacobian(mean, dt, rate, gyro, push)
    np.testing.assert_allclose(found, numeric, atol=1e-9)


def test_the_measurements_derivatives():
    """Speed, difference of gyro and wheels, absolute orientation and fixes are sums of states."""
    mean, covariance, _ = random_state(3)
    cases = (
        (gps_ekf_filter.SPEED_ROW, mean[SPEED]),
        (gps_ekf_filter.BIAS_ROW, mean[gps_ekf_kernels.BIAS]),
        (gps_ekf_filter.YAW_ROW, mean[YAW] + mean[OFFSET]),
        (gps_ekf_filter.FIX_X_ROW, mean[X] + mean[gps_ekf_kernels.GPS_X]),
        (gps_ekf_filter.FIX_Y_ROW, mean[Y] + mean[gps_ekf_kernels.GPS_Y]),
    )
    for row, measured in cases:
        assert row @ mean == pytest.approx(measured, abs=1e-15)
    rows = np.array((gps_ekf_filter.FIX_X_ROW, gps_ekf_filter.FIX_Y_ROW))
    innovation = np.array((1.0, 2.0)) - rows @ mean
    expected = innovation @ np.linalg.solve(
        rows @ covariance @ rows.T + 0.5 * np.eye(2), innovation
    )
    dx, dy, square = gps_ekf_kernels.fix_innovation(mean, covariance, 1.0, 2.0, 0.5)
    np.testing.assert_allclose((dx, dy, square), (*innovation, expected), rtol=1e-12)


@pytest.mark.parametrize("seed", range(5))
def test_prediction_and_correction_against_the_textbook(seed):
    mean, covariance, _ = random_state(seed)
    arguments = (0.05, 0.4, 1.0, 0.3)
    jacobian = gps_ekf_kernels.motion_jacobian(mean, *arguments)
    noise = gps_ekf_kernels.process_noise(mean, *arguments[:3], DENSITIES)
    expected_mean, expected = mean.copy(), jacobian @ covariance @ jacobian.T + noise
    gps_ekf_kernels.move(expected_mean, *arguments)
    gps_ekf_kernels.propagate(mean, covariance, *arguments, DENSITIES)
    np.testing.assert_allclose(covariance, expected, atol=1e-12)
    np.testing.assert_allclose(mean, expected_mean, atol=1e-15)
    row = gps_ekf_filter.YAW_ROW
    gain = expected @ row / (row @ expected @ row + 0.04)
    gps_ekf_kernels.correct(mean, covariance, row, 0.7, 0.04)
    np.testing.assert_allclose(mean, expected_mean + 0.7 * gain, atol=1e-12)
    np.testing.assert_allclose(
        covariance, (np.eye(SIZE) - np.outer(gain, row)) @ expected, atol=1e-10
    )


def test_the_noise_of_one_step_is_that_of_many():
    """Noise integrated in closed form is that of 100 small steps, and positive semidefinite."""
    mean = np.array((0.0, 0.0, 0.7, 1.3, 0.0, 0.0, 0.0, 0.0, 0.0))
    one = gps_ekf_kernels.process_noise(mean, 0.1, 0.0, 1.0, DENSITIES)
    many, state = np.zeros((SIZE, SIZE)), mean.copy()
    for _ in range(100):
        gps_ekf_kernels.propagate(state, many, 0.001, 0.0, 1.0, 0.0, DENSITIES)
    there = one != 0.0  # elsewhere the walks of bias and scale have come through a little
    np.testing.assert_allclose(many[there], one[there], rtol=0.02)
    assert np.abs(many[~there]).max() < 1e-5
    assert np.linalg.eigvalsh(one).min() > -1e-15


@pytest.mark.parametrize("speed", [0.0, 0.4, -1.7])
def test_noise_grows_with_the_distance_driven(speed):
    """Position noise is a random walk per metre.

    The other densities are the squares of what the parameters say.
    """
    params = dataclasses.replace(
        GpsEkfParams(),
        position_noise=0.3,
        yaw_noise=0.07,
        acceleration_noise=0.9,
    )
    ekf = GpsEkfFilter(params, COMPILED, True)
    state = ekf.start(np.array((1.0, 2.0, 0.4)), np.diag((0.1, 0.2, 0.03)), 10.0)
    state.mean[SPEED], state.rate_density = speed, 0.02
    state.acceleration_stamp = state.rate_stamp = state.wheel_stamp = 10.0
    walks = (params.imu0_yaw_rate_bias_walk, params.odom0_scale_walk, params.imu0_yaw_offset_walk)
    densities = np.array((0.02 + 0.07**2, 0.9**2, 0.3**2 * abs(speed), *np.square(walks)))
    given = (0.06, state.yaw_rate, state.gyro)
    jacobian = gps_ekf_kernels.motion_jacobian(state.mean, *given, state.acceleration)
    noise = gps_ekf_kernels.process_noise(state.mean, *given, densities)
    expected = jacobian @ state.covariance @ jacobian.T + noise
    ekf.advance(state, 10.06)
    np.testing.assert_allclose(state.covariance, expected, atol=1e-12)


@pytest.mark.parametrize("shared", [-0.04, 0.0, 0.05])
@pytest.mark.parametrize("deviations", [-3.3, -2.7, 2.7, 3.3])
def test_an_orientation_beyond_the_gate_makes_its_offset_uncertain(shared, deviations):
    """The gate is in standard deviations of heading plus offset, their covariance included."""
    params = dataclasses.replace(
        GpsEkfParams(), imu0_pose_rejection_threshold=3.0, imu0_yaw_std=0.1
    )
    ekf = GpsEkfFilter(params, COMPILED, True)
    state = ekf.start(np.array((1.0, 2.0, 0.4)), np.diag((0.1, 0.2, 0.06)), 10.0)
    state.mean[OFFSET], state.covariance[OFFSET, OFFSET] = 0.2, 0.05
    state.covariance[YAW, OFFSET] = state.covariance[OFFSET, YAW] = shared
    row, variance = gps_ekf_filter.YAW_ROW, 0.1**2
    innovation = deviations * math.sqrt(row @ state.covariance @ row + variance)
    covariance = state.covariance.copy()
    covariance[OFFSET, OFFSET] += innovation**2 if abs(deviations) > 3.0 else 0.0
    gain = covariance @ row / (row @ covariance @ row + variance)
    mean = state.mean + gain * innovation
    yaw = 0.6 + innovation - params.magnetic_declination_radians - params.yaw_offset
    message = Imu(10.0, yaw, 0.0, 0.0, 0.0, yaw_std=0.1)
    ekf.take_imu(state, message, with_yaw=True)
    np.testing.assert_allclose(
        state.covariance, covariance - np.outer(gain, row @ covariance), atol=1e-12
    )
    np.testing.assert_allclose(state.mean, mean, atol=1e-12)


def test_an_error_that_fixes_share_keeps_its_variance():
    mean, covariance = np.zeros(SIZE), np.zeros((SIZE, SIZE))
    gps_ekf_kernels.age_shared_error(mean, covariance, 0.0, 4.0)
    for _ in range(3):
        gps_ekf_kernels.age_shared_error(mean, covariance, 0.9, 4.0)
    np.testing.assert_allclose(np.diag(covariance)[-2:], 4.0)
    covariance[X, gps_ekf_kernels.GPS_X] = covariance[gps_ekf_kernels.GPS_X, X] = 1.0
    gps_ekf_kernels.age_shared_error(mean, covariance, 0.5, 4.0)
    assert covariance[X, gps_ekf_kernels.GPS_X] == covariance[gps_ekf_kernels.GPS_X, X] == 0.5


@pytest.mark.parametrize("uses_fixes", [True, False])
def test_a_start_knows_what_the_parameters_say(uses_fixes):
    params = dataclasses.replace(
        GpsEkfParams(),
        imu0_yaw_rate_bias_std=0.3,
        odom0_scale_std=0.2,
        imu0_yaw_offset_std=0.7,
    )
    given = np.array(((0.4, 0.1, 0.0), (0.1, 0.3, 0.02), (0.0, 0.02, 0.06)))
    state = GpsEkfFilter(params, COMPILED, uses_fixes).start(np.array((1.0, 2.0, 0.4)), given, 10.0)
    expected = np.diag(
        (0.0, 0.0, 0.0, 1.0, 0.3**2, 0.2**2, 0.7**2 if uses_fixes else 0.0, 0.0, 0.0)
    )
    expected[:3, :3] = given
    np.testing.assert_allclose(state.covariance, expected)
    assert (state.mean.tolist(), state.stamp) == ([1.0, 2.0, 0.4] + [0.0] * 6, 10.0)
    others = {
        key: value
        for key, value in dataclasses.asdict(state).items()
        if key not in ("mean", "covariance")
    }
    never = dict.fromkeys(
        ("rate_stamp", "acceleration_stamp", "wheel_stamp", "fix_stamp", "accepted_stamp"),
        -math.inf,
    )
    unknown = {"stamp": 10.0, "level": 1.0, "wheel_speed": math.nan, "nis": math.nan}
    zeros = (
        "yaw_rate",
        "gyro",
        "rate_density",
        "acceleration",
        "slip",
        "rejected",
        "rejected_since",
        "distance",
    )
    np.testing.assert_equal(others, {**never, **unknown, **dict.fromkeys(zeros, 0.0)})


@pytest.mark.parametrize(
    ("speed", "rate", "difference", "slip", "learns"),
    [
        (1.0, 0.4, 0.5, (0.5 - 0.19209) * 0.3, False),  # 0.19209 = 3 sqrt(0.03^2 + 0.04^2 + 0.04^2)
        (1.0, 0.4, -0.5, (0.5 - 0.19209) * 0.3, False),
        (-0.06, -0.01, 0.25, (0.25 - 0.15003) * 0.3, False),
        (1.0, 0.4, 0.19, 0.0, False),
        (0.04, 0.06, 0.25, (0.25 - 0.15108) * 0.3, False),
        (0.04, 0.04, 0.26, 0.0, True),  # standing: up to 5 sqrt(0.03^2 + 0.04^2 + 0.02^2) = 0.269
        (-0.04, -0.04, -0.26, 0.0, True),
        (0.04, 0.04, 0.28, 0.0, False),
    ],
)
def test_wheels_that_turn_otherwise_than_the_gyro_slip_or_show_its_bias(
    speed,
    rate,
    difference,
    slip,
    learns,
):
    """One wheel is wrong by the difference times the track width of 0.6 m.

    The mean of both is wrong by half of that.
    """
    params = dataclasses.replace(
        GpsEkfParams(),
        imu0_yaw_rate_std=0.04,
        imu0_yaw_rate_bias_std=0.02,
        track_width=0.6,
    )
    ekf = GpsEkfFilter(params, COMPILED, True)
    state = ekf.start(np.zeros(3), np.eye(3), 10.0)
    state.mean[gps_ekf_kernels.BIAS], state.yaw_rate = 0.1, rate + 0.1 + difference
    assert math.sqrt(ekf._compare_turns(state, rate, 0.03, speed)) == pytest.approx(slip, abs=1e-5)
    share = 0.02**2 / (0.02**2 + 0.03**2 + 0.04**2) if learns else 0.0
    assert state.mean[gps_ekf_kernels.BIAS] == pytest.approx(0.1 + share * difference)
    assert state.covariance[gps_ekf_kernels.BIAS, gps_ekf_kernels.BIAS] == pytest.approx(
        (1.0 - share) * 0.02**2
    )


@pytest.mark.parametrize("slip", [-2.0, -1.2, 1.2, 2.0])
def test_wheels_that_slip_beyond_the_gate_are_as_wrong_as_they_slip(slip):
    params = dataclasses.replace(GpsEkfParams(), acceleration_noise=0.4, sensor_timeout=0.5)
    ekf = GpsEkfFilter(params, COMPILED, True)
    state = ekf.start(np.zeros(3), np.eye(3), 10.0)
    state.wheel_stamp = state.acceleration_stamp = 9.8
    state.slip, state.wheel_speed = slip - 0.5, 1.0
    gate = 3.0 * math.sqrt(2.0 * 0.1**2 + 0.4**2 * 0.5)  # 0.95 m/s
    assert ekf._slip_variance(state, 1.5, 0.1**2) == pytest.approx(
        slip**2 if abs(slip) > gate else 0.0
    )
    assert ekf._slip_variance(state, 1.0 - slip, 0.1**2) == pytest.approx(0.0)
    state.acceleration_stamp = 9.4
    assert (ekf._slip_variance(state, 9.0, 0.1**2), state.slip) == (0.0, 0.0)


@pytest.mark.parametrize(
    ("speed", "difference", "age", "variance"),
    [
        (1.8, 0.0, 0.25, 0.01),
        (5.6, 0.0, 0.25, 0.21),  # 2 m/s off: as wrong as makes that four deviations
        (1.8, 0.5, 0.25, 0.01 + ((0.5 - 0.19209) * 0.3) ** 2 / 0.25),
        (1.8, -0.5, 4.0, 0.01 + ((0.5 - 0.19209) * 0.3) ** 2),
    ],
)
def test_wheels_count_less_where_they_slip_or_are_far_off(speed, difference, age, variance):
    """On a slope, half of the way is horizontal.

    A slip lasts a second, however many messages tell of it.
    """
    given = {
        "odom0_velocity_std": 0.1,
        "odom0_twist_rejection_threshold": 4.0,
        "imu0_yaw_rate_std": 0.04,
    }
    params = dataclasses.replace(GpsEkfParams(), track_width=0.6, **given)
    ekf = GpsEkfFilter(params, COMPILED, True)
    state = ekf.start(np.zeros(3), np.eye(3), 10.0)
    state.mean[SPEED], state.covariance[SPEED, SPEED], state.level = 0.8, 0.04, 0.5
    state.yaw_rate, state.gyro, state.rate_stamp, state.wheel_stamp = (
        0.4 + difference,
        1.0,
        10.0,
        10.0 - age,
    )
    ekf.take_odometry(state, Odometry(10.0, Pose2D(), Twist2D(speed, 0.0, 0.4), 0.0, 0.03))
    assert state.mean[SPEED] == pytest.approx(
        0.8 + 0.04 / (0.04 + variance) * (0.5 * speed - 0.8), abs=1e-5
    )
    assert state.covariance[SPEED, SPEED] == pytest.approx(
        0.04 * variance / (0.04 + variance), abs=1e-6
    )
    assert (state.wheel_speed, state.wheel_stamp, state.gyro) == (0.5 * speed, 10.0, 1.0)


@pytest.mark.parametrize(
    ("gyro", "age", "lasts"), [(0.0, 0.05, 0.05), (0.0, 0.3, 0.1), (1.0, 9.0, 0.1)]
)
def test_wheels_tell_the_yaw_rate_where_no_gyro_does(gyro, age, lasts):
    ekf = GpsEkfFilter(GpsEkfParams(), COMPILED, True)
    state = ekf.start(np.zeros(3), np.eye(3), 10.0)
    state.yaw_rate, state.gyro, state.rate_stamp = 9.0, gyro, 10.0 - age
    ekf.take_odometry(state, Odometry(10.0, Pose2D(), Twist2D(1.0, 0.0, 0.4), 0.1, 0.03))
    assert (state.yaw_rate, state.gyro, state.rate_stamp) == (0.4, 0.0, 10.0)
    assert state.rate_density == pytest.approx((0.03**2 + (0.1 * 0.4) ** 2) * lasts)


@pytest.mark.parametrize("aside", [0.3, 40.0])
def test_a_fix_corrects_by_the_part_of_its_error_that_is_its_own(aside):
    params = dataclasses.replace(
        GpsEkfParams(), gps0_correlated_share=0.6, gps0_correlation_time=8.0
    )
    ekf, (mean, covariance, _) = GpsEkfFilter(params, COMPILED, True), random_state(2)
    state = ekf.start(np.zeros(3), np.eye(3), 10.0)
    state.mean[:], state.covariance[:], state.fix_stamp = mean, covariance, 7.0
    gps_ekf_kernels.age_shared_error(mean, covariance, math.exp(-3.0 / 8.0), 0.6 * 0.5**2)
    x, y = (
        mean[X] + mean[gps_ekf_kernels.GPS_X] + aside,
        mean[Y] + mean[gps_ekf_kernels.GPS_Y] - 0.2,
    )
    rows = np.array((gps_ekf_filter.FIX_X_ROW, gps_ekf_filter.FIX_Y_ROW))
    spread = rows @ covariance @ rows.T + 0.4 * 0.5**2 * np.eye(2)
    gain = covariance @ rows.T @ np.linalg.inv(spread)
    ekf.take_fix(state, GpsFix(10.0, x, y, 0.5))
    assert state.nis == pytest.approx((aside, -0.2) @ np.linalg.solve(spread, (aside, -0.2)))
    is_taken = aside < 1.0
    assert (state.rejected, state.fix_stamp) == (0 if is_taken else 1, 10.0)
    if is_taken:
        mean, covariance = mean + gain @ (aside, -0.2), covariance - gain @ rows @ covariance
    np.testing.assert_allclose(state.mean, mean, atol=1e-9)
    np.testing.assert_allclose(state.covariance, covariance, atol=1e-9)


def test_filterpy_computes_the_same(drive):
    """Over a drive with an outlier, late fixes, an outage and a start without a heading."""
    believed = []
    for engine in ("kernel", "filterpy"):
        localizer = GpsEkfLocalizer(dataclasses.replace(GpsEkfParams(), engine=engine))
        localizer.reset(Belief(Pose2D(), np.diag((1.0, 1.0, 3.0))), np.random.default_rng(0))
        poses = []
        for i, observation in enumerate(drive(5, 40.0).observations):
            fix = observation.gps
            if fix is not None and i % 60 == 0:
                observation = dataclasses.replace(
                    observation, gps=dataclasses.replace(fix, x=fix.x + 20.0)
                )
            if fix is not None and i % 50 == 3:
                observation = dataclasses.replace(
                    observation, gps=GpsFix(fix.stamp - 0.07, fix.x, fix.y, 0.5)
                )
            if 600 < i < 800:
                observation = dataclasses.replace(observation, gps=None)
            belief = localizer.update(observation)
            poses.append(np.concatenate((belief.pose.as_array(), belief.covariance.ravel())))
        assert localizer.knows_heading
        believed.append(np.array(poses))
    np.testing.assert_allclose(believed[0], believed[1], atol=1e-9)
