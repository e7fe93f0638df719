"""Tracked people that are nobody."""

from typing import TYPE_CHECKING

import numpy as np

from harness.world.truth import Truth
from navstack.geometry import rotation
from navstack.types import BoolArray, FloatArray

if TYPE_CHECKING:
    from harness.task.brain import Brain

PERIOD = 0.5  # [s] between two looks at the tracks
SAME_BODY = 0.8  # [m] between a track and the person that it may be


class GhostTracks:
    """Counts the tracks with no person near, now and then during a delivery."""

    def __init__(self) -> None:
        self._next = 0.0  # [s] when to look
        self._looks = self._tracks = self._ghosts = 0

    def record(self, truth: Truth, brain: "Brain") -> None:
        """Take in a state, and what the brain made of it."""
        if truth.stamp < self._next:
            return
        self._next = truth.stamp + PERIOD
        self._looks += 1
        tracks, belief = brain.tracks, brain.belief
        if not tracks or belief is None:
            return
        places = np.array([(each.x, each.y) for each in tracks])
        places = in_true_frame(places, belief.pose.as_array(), truth.pose.as_array())
        self._tracks += len(tracks)
        self._ghosts += int(are_ghosts(places, truth.pedestrians[:, :2]).sum())

    @property
    def mean(self) -> float | None:
        """Ghosts at a time, on average; None: nothing was tracked."""
        if not self._tracks:
            return None
        return self._ghosts / self._looks


def in_true_frame(places: FloatArray, believed: FloatArray, true: FloatArray) -> FloatArray:
    """Places (k, 2) [m] of the believed map frame in the true one.

    ``believed`` and ``true`` are the robot's pose (3,) in each.
    """
    turn = rotation(believed[2] - true[2])
    moved: FloatArray = (places - believed[:2]) @ turn + true[:2]
    return moved


def are_ghosts(places: FloatArray, people: FloatArray) -> BoolArray:
    """Which places (k, 2) [m] have no person (n, 2) [m] within ``SAME_BODY``."""
    x, y = (places[:, None, axis] - people[None, :, axis] for axis in (0, 1))
    near = np.hypot(x, y) <= SAME_BODY  # False: nan and inf, of who is absent
    ghosts: BoolArray = near.sum(axis=1) == 0
    return ghosts
