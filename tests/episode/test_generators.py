"""Each consumer of randomness has a generator of its own, which a new consumer leaves alone."""

import numpy as np

from harness.task.study import CONSUMERS, make_generators

OLDEST = (
    "mission",
    "pedestrians",
    "lidar",
    "odometry",
    "imu",
    "gps",
    "cargo",
    "planner",
    "localizer",
)


def test_a_later_consumer_changes_nobodys_numbers() -> None:
    assert CONSUMERS[: len(OLDEST)] == OLDEST and len(set(CONSUMERS)) == len(CONSUMERS)
    alone = np.random.SeedSequence(7, spawn_key=(3,)).spawn(len(OLDEST))
    for name, child in zip(OLDEST, alone, strict=True):
        expected = np.random.default_rng(child).integers(0, 2**63, 5)
        np.testing.assert_array_equal(make_generators(7, 3)[name].integers(0, 2**63, 5), expected)


def test_no_two_consumers_share_numbers() -> None:
    first = {name: int(rng.integers(0, 2**63)) for name, rng in make_generators(7, 3).items()}
    assert len(set(first.values())) == len(CONSUMERS)
