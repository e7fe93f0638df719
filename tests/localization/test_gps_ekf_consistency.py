"""Does the filter know how well it knows?

Normalized errors against chi-square (Bar-Shalom et al. 2001, sec. 5.4.2).
"""

import dataclasses
import math

import numpy as np
import pytest
from scipy.stats import chi2

from navstack.geometry import normalize_angle
from navstack.localization.gps_ekf import GpsEkfLocalizer
from navstack.params.gps_ekf import GpsEkfParams
from navstack.types import Belief, Pose2D

pytestmark = pytest.mark.slow

SEEDS, SECONDS = 100, 30.0
START = np.diag((0.5**2, 0.5**2, 0.1**2))
# The preset's own: no systematic error, white fixes, accelerometers of 0.1 m/s2 at 30 Hz. The rest
# stand in messages.
WHITE = dataclasses.replace(
    GpsEkfParams(),
    odom0_scale_std=0.0,
    odom0_scale_walk=0.0,
    imu0_yaw_rate_bias_std=0.0,
    imu0_yaw_rate_bias_walk=0.0,
    imu0_yaw_offset_std=0.0,
    imu0_yaw_offset_walk=0.0,
    gps0_correlated_share=0.0,
    gps0_rejection_threshold=100.0,  # a gate cuts the tails
    acceleration_noise=0.1 / math.sqrt(30.0),
    position_noise=0.0,
    yaw_noise=0.0,
)


@pytest.fixture(scope="module")
def squares(drive):
    """Normalized squared errors of pose (seeds, ticks) and innovations (seeds, fixes)."""
    nees, nis = [], []
    for seed in range(SEEDS):
        rng = np.random.default_rng((7, seed))
        localizer = GpsEkfLocalizer(WHITE)
        localizer.reset(Belief(Pose2D(*rng.multivariate_normal(np.zeros(3), START)), START), rng)
        pose_errors, innovations = [], []
        observations, truth = drive(seed, SECONDS)
        for observation, body in zip(observations, truth, strict=True):
            belief = localizer.update(observation)
            pose = belief.pose
            error = np.array(
                (pose.x - body.x, pose.y - body.y, normalize_angle(pose.yaw - body.yaw))
            )
            pose_errors.append(error @ np.linalg.solve(belief.covariance, error))
            if observation.gps is not None:
                innovations.append(localizer.state.nis)
        nees.append(pose_errors)
        nis.append(innovations)
    return np.array(nees), np.array(nis)


@pytest.mark.parametrize(("which", "freedoms"), [(0, 3), (1, 2)], ids=["nees", "nis"])
def test_errors_are_as_large_as_the_filter_says(squares, which, freedoms):
    means = squares[which].mean(axis=0)
    low, high = chi2.ppf((0.025, 0.975), SEEDS * freedoms) / SEEDS
    inside = ((means > low) & (means < high)).mean()
    assert inside > 0.9  # 0.95 are expected, but the means of one run of ticks are alike
    assert low < means.mean() < high


def test_innovations_are_white(squares):
    """The innovation of one fix says nothing of the next one's size."""
    nis = squares[1] - 2.0
    correlation = (nis[:, 1:] * nis[:, :-1]).mean() / nis.var()
    assert abs(correlation) < 3.0 / math.sqrt(nis.size)
