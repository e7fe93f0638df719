import math

import numpy as np
import pytest

from navstack.localization.gps import DEGRADED_AFTER, LOST_AFTER, GpsLocalizer
from navstack.types import Belief, GpsFix, Health, Imu, Observation, Odometry, Pose2D, Twist2D

START = Belief(Pose2D(1.0, 2.0, 0.5), np.diag((0.3, 0.4, 0.2)))


def fix(stamp, x, y, std=0.1):
    return GpsFix(stamp, x, y, std)


def imu(stamp, yaw):
    return Imu(stamp, yaw, 0.0, 0.0, 0.0)


def started():
    localizer = GpsLocalizer()
    localizer.reset(START, np.random.default_rng(0))
    return localizer


def test_the_initial_belief_holds_until_something_arrives():
    belief = started().update(Observation(0.0))
    assert belief.pose == START.pose
    assert np.array_equal(belief.covariance, START.covariance)


def test_the_last_fix_is_the_position_and_the_last_heading_the_heading():
    localizer = started()
    first = localizer.update(Observation(0.1, gps=fix(0.1, 3.0, 4.0)))
    assert first.pose == Pose2D(3.0, 4.0, 0.5)
    np.testing.assert_allclose(first.covariance, np.diag((0.01, 0.01, 0.2)))
    second = localizer.update(Observation(0.2, imu=imu(0.2, -1.0)))
    assert second.pose == Pose2D(3.0, 4.0, -1.0)
    np.testing.assert_allclose(np.diag(second.covariance), (0.01, 0.01, math.radians(2.0) ** 2))
    assert first.pose == Pose2D(3.0, 4.0, 0.5)  # beliefs given away do not change
    assert first.covariance[2, 2] == 0.2


def test_there_is_no_dead_reckoning():
    localizer = started()
    before = localizer.update(Observation(0.0, gps=fix(0.0, 3.0, 4.0)))
    moving = Odometry(0.1, Pose2D(5.0, 5.0, 1.0), Twist2D(2.0))
    after = localizer.update(Observation(0.1, odometry=moving))
    assert after.pose == before.pose
    assert after.stamp == 0.1


def test_health_follows_the_age_of_the_last_fix():
    localizer = started()
    localizer.update(Observation(10.0, gps=fix(10.0, 0.0, 0.0)))
    cases = (
        (10.0 + DEGRADED_AFTER, Health.TRACKING),
        (10.1 + DEGRADED_AFTER, Health.DEGRADED),
        (10.0 + LOST_AFTER, Health.DEGRADED),
        (10.1 + LOST_AFTER, Health.LOST),
    )
    for stamp, health in cases:
        assert localizer.update(Observation(stamp)).health is health
    again = Observation(20.0, imu=imu(20.0, 0.0), gps=fix(20.0, 0.0, 0.0))
    assert localizer.update(again).health is Health.TRACKING


@pytest.mark.parametrize("old", [math.nan, DEGRADED_AFTER + 0.1])
def test_health_follows_the_age_of_the_last_heading(old):
    localizer = started()
    localizer.update(Observation(10.0, imu=imu(10.0, 0.0), gps=fix(10.0, 0.0, 0.0)))
    stale = Observation(11.0, imu=imu(11.0 - old, 0.0), gps=fix(11.0, 0.0, 0.0))
    assert localizer.update(stale).health is Health.DEGRADED


def test_without_any_fix_the_first_update_starts_the_clock_and_reset_starts_it_anew():
    localizer = started()
    assert localizer.update(Observation(100.0)).health is Health.TRACKING
    assert localizer.update(Observation(101.0 + LOST_AFTER)).health is Health.LOST
    localizer.reset(START, np.random.default_rng(0))
    assert localizer.update(Observation(0.0)).health is Health.TRACKING


def test_a_stated_heading_deviation_replaces_the_assumed_one():
    belief = started().update(Observation(0.2, imu=Imu(0.2, -1.0, 0.0, 0.0, 0.0, 0.1)))
    assert math.isclose(belief.covariance[2, 2], 0.01)


def test_without_an_absolute_heading_the_initial_one_stays_and_counts_as_unknown():
    localizer = started()
    belief = localizer.update(Observation(0.1, gps=fix(0.1, 3.0, 4.0), imu=imu(0.1, math.nan)))
    assert belief.pose == Pose2D(3.0, 4.0, 0.5)
    assert math.isclose(belief.covariance[2, 2], math.pi**2 / 3.0)
    assert belief.health is Health.DEGRADED
    assert localizer.update(Observation(20.0)).health is Health.LOST
    assert (
        localizer.update(Observation(20.1, gps=fix(20.1, 0.0, 0.0), imu=imu(20.1, 1.0))).health
        is Health.TRACKING
    )
    localizer.update(Observation(20.2, imu=imu(20.2, math.nan)))
    localizer.reset(START, np.random.default_rng(0))
    assert localizer.update(Observation(0.0)).health is Health.TRACKING
