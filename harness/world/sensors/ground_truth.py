"""Localizer and tracker that know the truth, exactly or with an injected error.

An injected error shows what a metre or a degree costs.
"""

import math
from collections.abc import Callable

import numpy as np

from harness.task.stack import InjectedError
from harness.world.sensors.noise import GaussMarkov
from navstack.geometry import normalize_angle
from navstack.localization.localizer import Localizer
from navstack.types import Belief, FloatArray, Health, LaserScan, Observation, Pose2D, Track

_CERTAIN: FloatArray = np.zeros((3, 3))  # one for all beliefs; read only
_SURE: FloatArray = np.zeros((4, 4))  # one for all tracks; read only
_CERTAIN.flags.writeable = _SURE.flags.writeable = False


class GroundTruthLocalizer(Localizer):
    """Believes the true pose, without error and without delay: the published evaluation's "GPS"."""

    def __init__(self, true_pose: Callable[[], Pose2D]) -> None:
        """Look at the world.

        Args:
            true_pose: gives the robot's true pose in the map frame now, e.g. ``lambda:
                world.truth.pose``.
        """
        self._true_pose = true_pose

    def reset(self, belief: Belief, rng: np.random.Generator) -> None:
        """Nothing to do: the initial belief does not matter."""

    def update(self, observation: Observation) -> Belief:
        """The true pose, with zero covariance."""
        return Belief(self._true_pose(), _CERTAIN, Health.TRACKING, observation.stamp)


class GroundTruthTracker:
    """All people as they are, behind walls too, without error and without delay."""

    def __init__(self, people: Callable[[], FloatArray], radius: float) -> None:
        """Look at the world.

        Args:
            people: gives them now (n, 4): x, y [m], vx, vy [m/s] in the map frame.
            radius: of a person, in [m].
        """
        self._people = people
        self._radius = radius

    def reset(self) -> None:
        """Nothing is remembered."""

    def observe(
        self,
        scan: LaserScan,
        in_map: Pose2D,
        in_odom: Pose2D,
        covariance: FloatArray,
    ) -> None:
        """Nothing to see that is not known."""

    def tracks(self, stamp: float) -> list[Track]:
        """All people who are there; a person's number is their place in the world's list."""
        return [
            Track(k, stamp, x, y, vx, vy, self._radius, _SURE)
            for k, (x, y, vx, vy) in enumerate(self._people().tolist())
            if math.isfinite(x)
        ]


class InjectedErrorLocalizer(Localizer):
    """Adds a slowly varying error to what another localizer believes.

    Each coordinate's error in the map frame is a first-order Gauss-Markov process, stationary from
    the start. It is drawn with unit variance and then scaled, so that all sizes of error meet the
    same drift. Two axes with a standard deviation of position_rms / sqrt(2) each have the root mean
    square distance position_rms.

    The covariance of the belief is the other localizer's and that of the error; health is the other
    localizer's.
    """

    def __init__(self, localizer: Localizer, error: InjectedError) -> None:
        axis = error.position_rms / math.sqrt(2.0)  # [m]
        self._localizer = localizer
        self._deviations = np.array([axis, axis, math.radians(error.heading_rms)])  # [m, m, rad]
        self._correlation_time = error.correlation_time  # [s]

    def reset(self, belief: Belief, rng: np.random.Generator) -> None:
        """Start over; the drift of this delivery is drawn from ``rng``."""
        self._localizer.reset(belief, rng)
        self._drift = GaussMarkov(rng, len(self._deviations), self._correlation_time)

    def update(self, observation: Observation) -> Belief:
        """The other localizer's belief with the error of this moment."""
        belief = self._localizer.update(observation)
        x, y, yaw = self._deviations * self._drift.at(belief.stamp)
        pose = Pose2D(belief.pose.x + x, belief.pose.y + y, normalize_angle(belief.pose.yaw + yaw))
        return Belief(
            pose, belief.covariance + np.diag(self._deviations**2), belief.health, belief.stamp
        )
