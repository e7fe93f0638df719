"""Clearance on a coarse grid against SciPy's exact distance transform."""

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt

from harness.task.clearance import coarse_clearance
from navstack.costmap.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from navstack.types import Pose2D


@pytest.mark.parametrize("factor", [1, 2, 3, 4, 5])
@pytest.mark.parametrize("share", [0.5, 0.95, 1.0])
def test_clearance_is_the_exact_distance_less_half_a_cell(factor: int, share: float) -> None:
    rng = np.random.default_rng(factor)
    for _ in range(8):
        height, width = rng.integers(1, 70, 2).tolist()
        free = rng.random((height, width)) < share
        data = np.where(free, np.int8(FREE), np.int8(OCCUPIED))
        mesh = OccupancyGrid(data, 0.05, Pose2D(0.0, 0.0, 0.0))
        exact = distance_transform_edt(np.pad(free, 1))[1:-1, 1:-1]
        middle = exact[factor // 2 :: factor, factor // 2 :: factor]
        expected = (np.maximum(middle - 0.5, 0.0) * 0.05).astype(np.float32)
        found = coarse_clearance(mesh, factor)
        assert found.dtype == np.float32
        assert np.array_equal(found, expected)
