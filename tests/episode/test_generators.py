"""Each consumer of randomness has a generator of its own, which a new consumer leaves alone."""

import pickle

import numpy as np

from harness.task.study import STREAMS, RandomStreams

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
    "controller",
)


def test_each_consumers_numbers_stay_what_they_were() -> None:
    alone = np.random.SeedSequence(7, spawn_key=(3,)).spawn(len(OLDEST))
    for name, child in zip(OLDEST, alone, strict=True):
        expected = np.random.default_rng(child).integers(0, 2**63, 5)
        np.testing.assert_array_equal(RandomStreams(7, 3)[name].integers(0, 2**63, 5), expected)


def test_a_consumer_needs_no_entry_and_shares_no_numbers() -> None:
    streams = RandomStreams(7, 3)
    first = {int(streams[name].integers(0, 2**63)) for name in (*STREAMS, "barometer", "sonar")}
    assert len(first) == len(STREAMS) + 2
    assert len(set(STREAMS.values())) == len(STREAMS)


def test_a_legs_streams_are_apart_from_those_that_the_first_legs_spawn() -> None:
    """Errors of a sensor spawn generators of their own."""
    spawned = [child.random() for child in RandomStreams(7, 3)["gps"].spawn(5)]
    legs = [RandomStreams(7, 3, leg)["gps"].random() for leg in range(5)]
    assert len({*spawned, *legs}) == 10


def test_a_stream_goes_on_where_it_was() -> None:
    streams = RandomStreams(7, 3)
    first = streams["barometer"].random()
    copy = pickle.loads(pickle.dumps(streams))
    assert streams["barometer"].random() == copy["barometer"].random() != first
    assert streams["imu"].random() == copy["imu"].random()
