"""Simulated people beside real ones (UCY zara01); the table is in docs/pedestrians.md."""

import importlib
import os
from pathlib import Path

import numpy as np
import pytest

from harness.world.people.params import ReplayParams
from harness.world.people.replay_file import load_recording


@pytest.fixture(scope="module")
def comparison():
    return importlib.import_module("tools.compare_pedestrians")


@pytest.fixture(scope="module")
def real(comparison):
    data = os.environ.get("NAVSTACK_DATA")
    if not data:
        pytest.skip("NAVSTACK_DATA is not set: no ucy_zara01")
    return comparison.measure(
        [load_recording(ReplayParams(str(Path(data) / "ucy_zara01" / "obsmat.txt")))]
    )


@pytest.fixture(scope="module")
def social(comparison):
    return comparison.measure([comparison.simulate("social", seed) for seed in range(2)])


@pytest.fixture(scope="module")
def random_walk(comparison):
    return comparison.measure([comparison.simulate("easy", seed) for seed in range(2)])


@pytest.mark.slow
@pytest.mark.parametrize("percentile", [25, 50, 75, 95])
def test_social_force_people_walk_about_as_fast_as_real_ones(real, social, percentile):
    ours, theirs = (np.percentile(values["speed"], percentile) for values in (social, real))
    assert ours == pytest.approx(theirs, rel=0.25)


@pytest.mark.parametrize("percentile", [1, 5, 25, 50])
def test_social_force_people_keep_about_the_distance_of_real_ones(real, social, percentile):
    ours, theirs = (np.percentile(values["separation"], percentile) for values in (social, real))
    assert ours == pytest.approx(theirs, rel=0.3)


def test_social_force_is_nearer_to_real_people_than_the_random_walk(real, social, random_walk):
    """Largest difference (Kolmogorov-Smirnov) of the distributions of speeds.

    Also of those of how many come too near.
    """

    def difference(values, name):
        points = np.linspace(0.0, 2.0, 200)
        shares = [np.searchsorted(np.sort(v[name]), points) / len(v[name]) for v in (values, real)]
        return np.abs(shares[0] - shares[1]).max()

    assert difference(social, "speed") < 0.5 * difference(random_walk, "speed")
    near = [(values["separation"] < 0.5).mean() for values in (real, social, random_walk)]
    assert near[0] < 0.01 and near[1] < 0.01 < near[2]
