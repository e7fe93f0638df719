"""The opening by a square is the one of mathematical morphology."""

import numpy as np
import pytest
from scipy import ndimage

from harness.world.map.opening import opened


@pytest.mark.parametrize("size", [1, 2, 3, 6, 7])
def test_it_equals_erosion_and_dilation(size: int) -> None:
    rng = np.random.default_rng(size)
    square = np.ones((size, size), dtype=bool)
    covered = 0
    for share in np.linspace(0.35, 0.6, 20):
        mask = ndimage.uniform_filter(rng.random(rng.integers(1, 50, 2)), 3) > share
        around = ndimage.binary_opening(np.pad(mask, size), square)
        assert np.array_equal(opened(mask, size), around[size:-size, size:-size])
        covered += int(opened(mask, size).sum())
    assert covered > 0
