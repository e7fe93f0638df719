"""The tracker of a robot that believes itself elsewhere."""

import math

import numpy as np
import pytest
from numpy.random import default_rng

from navstack.params.tracker import TrackerParams
from navstack.perception.tracker import Tracker
from navstack.types import Pose2D, Track

from . import made_up_scans as made_up

RATE = 10.0  # [Hz]


@pytest.mark.parametrize("away", [0.1, 0.3, 0.5, 0.75, 1.0])
@pytest.mark.parametrize("boxes", [made_up.SQUARE, made_up.CORRIDOR], ids=["square", "corridor"])
def test_nobody_is_made_of_walls(boxes, away) -> None:
    """Walls only, and a belief that is off by as much as it says: no track appears."""
    covariance = np.diag((0.5 * away, 0.5 * away, 0.02)) ** 2
    found = {}
    for aligns in (False, True):
        tracker = Tracker(TrackerParams(aligns_scans=aligns), made_up.map_of(boxes))
        found[aligns] = 0
        for k in range(20):
            true = Pose2D(0.05 * k, -0.5, 0.3)
            believed = Pose2D(true.x + 0.6 * away, true.y + 0.8 * away, true.yaw + 0.02)
            scan = made_up.scan_of(boxes, true, default_rng(k), stamp=k / RATE)
            tracker.observe(scan, believed, believed, covariance)
            found[aligns] += len(tracker.tracks(k / RATE))
    assert found[True] == 0
    if boxes is made_up.SQUARE and away >= 0.5:
        assert found[False] > 0, "without alignment walls become people"


def test_a_person_is_followed_although_the_belief_is_off() -> None:
    tracker = Tracker(TrackerParams(aligns_scans=True), made_up.map_of(made_up.SQUARE))
    tracks: list[Track] = []
    for k in range(20):
        scan = made_up.scan_of(
            made_up.SQUARE, Pose2D(), default_rng(k), [(1.5, -3.0 + 0.1 * k)], k / RATE
        )
        believed = Pose2D(0.4, 0.3, 0.0)
        tracker.observe(scan, believed, believed, np.diag((0.09, 0.09, 0.0004)))
        tracks = tracker.tracks(k / RATE)
    (track,) = tracks
    # where it is seen from the place that is believed
    assert math.hypot(track.x - 1.9, track.y + 0.8) < 0.15
    assert abs(track.vy - 1.0) < 0.2
