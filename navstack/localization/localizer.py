"""What every localizer does."""

import math
from abc import ABC, abstractmethod

import numpy as np

from navstack.types import Belief, FloatArray, GpsFix, Health, Observation

HEALTHS = (Health.TRACKING, Health.DEGRADED, Health.LOST)


class Localizer(ABC):
    """Turns observations into a belief about the robot's pose in the map frame."""

    @abstractmethod
    def reset(self, belief: Belief, rng: np.random.Generator) -> None:
        """Start over from an initial belief; all chance in localization is drawn from ``rng``."""

    @abstractmethod
    def update(self, observation: Observation) -> Belief:
        """Take in what has arrived, and return the belief at ``observation.stamp``."""


def initial_covariance(belief: Belief, variances: tuple[float, float, float]) -> FloatArray:
    """The covariance (3, 3) of a start; one without gets ``variances`` [m2, m2, rad2]."""
    if belief.covariance.any():
        return belief.covariance
    return np.diag(variances)


def health_of(is_lost: bool, is_degraded: bool) -> Health:
    """The health of a localizer."""
    if is_lost:
        return Health.LOST
    if is_degraded:
        return Health.DEGRADED
    return Health.TRACKING


def worst(*healths: Health) -> Health:
    """The worst of some healths."""
    return max(healths, key=HEALTHS.index)


def is_sound_fix(fix: GpsFix) -> bool:
    """Whether all that a fix says are numbers."""
    return all(map(math.isfinite, (fix.stamp, fix.x, fix.y, fix.position_std)))
