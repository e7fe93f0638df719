"""Transforms in the plane and the size of covariances, by hand."""

import math

import numpy as np
import pytest

from navstack.geometry import compose, largest_variance, relative_to, transform_points
from navstack.types import Pose2D


@pytest.mark.parametrize(
    ("frame", "local", "whole"),
    [
        ((1.0, 2.0, 0.5 * math.pi), (3.0, 1.0, 0.2), (0.0, 5.0, 0.5 * math.pi + 0.2)),
        ((1.0, 2.0, 3.0), (0.0, 0.0, 1.0), (1.0, 2.0, 4.0 - 2.0 * math.pi)),
        ((-1.0, 0.5, math.atan2(3.0, 4.0)), (5.0, 10.0, 0.0), (-3.0, 11.5, math.atan2(3.0, 4.0))),
    ],
)
def test_poses_are_composed_and_taken_apart(frame, local, whole) -> None:
    found = compose(Pose2D(*frame), Pose2D(*local))
    assert (found.x, found.y, found.yaw) == pytest.approx(whole)
    back = relative_to(Pose2D(*frame), Pose2D(*whole))
    assert (back.x, back.y, back.yaw) == pytest.approx(local)
    np.testing.assert_allclose(
        transform_points(Pose2D(*frame), np.array([local[:2]])), [whole[:2]], atol=1e-12
    )


@pytest.mark.parametrize("angle", [0.0, 0.4, -1.2, 2.0])
def test_the_largest_variance_is_that_along_the_longest_axis(angle) -> None:
    turn = np.array(((math.cos(angle), -math.sin(angle)), (math.sin(angle), math.cos(angle))))
    covariance = np.diag((0.0, 0.0, 50.0))
    covariance[:2, :2] = turn @ np.diag((9.0, 2.0)) @ turn.T
    assert largest_variance(covariance) == pytest.approx(9.0)
    assert largest_variance(np.diag((-1.0, -2.0))) == 0.0
