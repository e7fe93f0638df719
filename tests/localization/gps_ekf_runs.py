"""Runs of the GPS-EKF and how far its beliefs lie from the truth."""

import dataclasses
import math

import numpy as np

from navstack.geometry import normalize_angle
from navstack.localization.gps_ekf import GpsEkfLocalizer
from navstack.params.gps_ekf import GpsEkfParams
from navstack.types import Belief, Pose2D

ANY_HEADING = np.diag((1.0, 1.0, math.pi**2 / 3.0))
PARAMS = GpsEkfParams()


def started(params=PARAMS, belief=None, uses_fixes=True):
    localizer = GpsEkfLocalizer(params, uses_fixes=uses_fixes)
    localizer.reset(belief or Belief(Pose2D()), np.random.default_rng(0))
    return localizer


def run(localizer, observations):
    return [localizer.update(observation) for observation in observations]


def off(belief, body):
    """[m] between a belief and the truth."""
    return math.hypot(belief.pose.x - body.x, belief.pose.y - body.y)


def turned(belief, body):
    """[rad] between them."""
    return abs(normalize_angle(belief.pose.yaw - body.yaw))


def without(observation, *names):
    return dataclasses.replace(observation, **dict.fromkeys(names))


def moved(observation, x, y):
    """An observation with its fix moved, [m]."""
    fix = observation.gps
    if fix is None:
        return observation
    return dataclasses.replace(observation, gps=dataclasses.replace(fix, x=fix.x + x, y=fix.y + y))


def rms(beliefs, truth):
    return math.sqrt(np.mean([off(*pair) ** 2 for pair in zip(beliefs, truth, strict=True)]))
