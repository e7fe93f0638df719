"""How the GPS-EKF comes to know its heading."""

import dataclasses
import math

import numpy as np
import pytest

from navstack.types import Belief, Health, Imu, Observation, Pose2D

from .gps_ekf_runs import ANY_HEADING, PARAMS, off, run, started, turned


@pytest.mark.parametrize("has_heading", [True, False])
@pytest.mark.parametrize("turn", [0.0, 1.0, 2.5, -2.0])
def test_an_unknown_heading_is_found_after_a_few_metres(drive, has_heading, turn):
    """Whatever the inertial unit takes for east."""
    observations, truth = drive(4, 30.0)
    localizer = started(belief=Belief(Pose2D(0.0, 0.0, turn), ANY_HEADING))
    for observation, body in zip(observations, truth, strict=True):
        imu = dataclasses.replace(
            observation.imu, yaw=observation.imu.yaw + turn if has_heading else math.nan
        )
        belief = localizer.update(dataclasses.replace(observation, imu=imu))
        if not localizer.knows_heading:
            assert belief.health is Health.DEGRADED
            assert belief.covariance[2, 2] > 1.0
            assert math.hypot(body.x, body.y) < 6.0
    assert localizer.knows_heading
    assert turned(belief, truth[-1]) < math.radians(5.0)
    assert off(belief, truth[-1]) < 1.0


@pytest.mark.parametrize(("stated", "std"), [(0.0, PARAMS.imu0_yaw_std), (0.2, 0.2)])
def test_while_the_heading_is_searched_for_the_orientation_is_believed(stated, std):
    """As the parameters correct it, however the robot was said to stand, and as it turned since."""
    params = dataclasses.replace(PARAMS, magnetic_declination_radians=0.3, yaw_offset=-1.0)
    localizer = started(params, Belief(Pose2D(0.0, 0.0, 1.1), ANY_HEADING))
    for stamp, yaw in ((0.0, 0.5), (0.1, 0.55)):
        belief = localizer.update(Observation(stamp, imu=Imu(stamp, yaw, 0.5, 0.0, 0.0, stated)))
        assert belief.pose.yaw == pytest.approx(yaw - 0.7, abs=1e-9)
        assert belief.covariance[2, 2] == pytest.approx(params.imu0_yaw_offset_std**2 + std**2)
        assert not belief.covariance[2, :2].any()
    later = localizer.update(Observation(0.2))
    assert later.pose.yaw == pytest.approx(0.6 - 0.7, abs=1e-9)
    assert not localizer.knows_heading


def test_a_unit_with_a_calibrated_orientation_knows_the_heading_at_once(drive):
    observations, truth = drive(4, 1.0)
    params = dataclasses.replace(PARAMS, imu0_yaw_offset_std=0.05)
    localizer = started(params, Belief(Pose2D(0.0, 0.0, 2.0), ANY_HEADING))
    belief = localizer.update(observations[0])
    assert localizer.knows_heading
    assert turned(belief, truth[0]) < 0.3


def test_fixes_count_once_a_unit_tells_the_heading_after_the_first_of_them(drive):
    observations, truth = drive(4, 10.0)
    params = dataclasses.replace(PARAMS, imu0_yaw_offset_std=0.05)
    localizer = started(params, Belief(Pose2D(), ANY_HEADING))
    first = dataclasses.replace(observations[0], imu=None)
    assert first.gps is not None
    assert localizer.update(first).health is Health.DEGRADED
    belief = run(localizer, observations[1:])[-1]
    assert belief.health is Health.TRACKING
    assert off(belief, truth[-1]) < 1.0


def test_a_unit_that_is_wrongly_called_calibrated_is_found_out(drive):
    observations, truth = drive(4, 60.0)
    localizer = started(
        dataclasses.replace(PARAMS, imu0_yaw_offset_std=0.05), Belief(Pose2D(), ANY_HEADING)
    )
    units = [
        dataclasses.replace(o, imu=dataclasses.replace(o.imu, yaw=o.imu.yaw + 2.0))
        for o in observations
    ]
    beliefs = run(localizer, units)
    assert turned(beliefs[30], truth[30]) > 1.0
    assert turned(beliefs[-1], truth[-1]) < math.radians(6.0)
    assert off(beliefs[-1], truth[-1]) < 1.0


def test_navsat_transforms_corrections_of_the_orientation(drive):
    observations, truth = drive(4, 2.0)
    params = dataclasses.replace(PARAMS, magnetic_declination_radians=0.3, yaw_offset=-1.0)
    localizer = started(params, Belief(Pose2D(), ANY_HEADING), uses_fixes=False)
    turned_units = [
        dataclasses.replace(o, imu=dataclasses.replace(o.imu, yaw=o.imu.yaw + 0.7), gps=None)
        for o in observations
    ]
    assert turned(run(localizer, turned_units)[-1], truth[-1]) < 0.05


def test_an_orientation_relative_to_the_first(drive):
    observations, truth = drive(4, 20.0, "rtk_good")
    start = Belief(Pose2D(0.0, 0.0, truth[0].yaw), ANY_HEADING)
    localizer = started(dataclasses.replace(PARAMS, imu0_relative=True), start, uses_fixes=False)
    units = [
        dataclasses.replace(o, imu=dataclasses.replace(o.imu, yaw=o.imu.yaw + 2.0))
        for o in observations
    ]
    for _ in range(2):  # a reset takes a new reference
        assert turned(run(localizer, units)[-1], truth[-1]) < 0.05
        localizer.reset(start, np.random.default_rng(0))
