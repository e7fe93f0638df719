"""Watches one delivery; what is measured of it is worked out when it is over."""

import math
from array import array
from collections.abc import Sequence

import numpy as np

from harness.metrics.columns import Row
from harness.metrics.contacts import property_contacts, soft_contacts
from harness.metrics.encounters import Body, Encounters
from harness.metrics.motion import (
    distance_driven,
    jerk,
    largest_usual,
    lateral_acceleration,
    path_irregularity,
    wrapped,
)
from harness.world.truth import Partner, Truth
from navstack.types import Belief, FloatArray, Pose2D

JOULES_PER_KWH = 3.6e6
STATE_SIZE = 6  # stamp, x, y, yaw, forward speed, yaw rate
BELIEF_SIZE = 3  # x, y, yaw
NOWHERE = Belief(Pose2D(math.nan, math.nan, math.nan))  # of who does not localize


class DeliveryLog:
    """Takes in a delivery tick by tick."""

    def __init__(self, truth: Truth, kinds: frozenset[str], body: Body) -> None:
        """Start with the state in which the brain first sees the world.

        Args:
            truth: that state.
            kinds: of obstacles in this world; contacts with others are undefined, not 0.
            body: how people meet the robot.
        """
        self._kinds = kinds
        self._states = array("d")  # STATE_SIZE per tick, the state at the start first
        self._beliefs = array("d")  # BELIEF_SIZE per tick, of the pose before it
        self._encounters = Encounters(body)
        self._max_tilt = 0.0  # [rad]
        pose, twist = truth.pose, truth.twist
        self._states.extend(
            (truth.stamp, pose.x, pose.y, pose.yaw, twist.linear_x, twist.angular_z)
        )
        self._stamp = truth.stamp  # [s] of the last state

    def record(self, truth: Truth, belief: Belief | None) -> None:
        """Take in the state after a step, and what was believed before it (None.

        Nobody localizes).
        """
        pose, twist, stamp = truth.pose, truth.twist, truth.stamp
        x, y, yaw, forward, yaw_rate = pose.x, pose.y, pose.yaw, twist.linear_x, twist.angular_z
        believed = belief.pose if belief is not None else NOWHERE.pose
        self._beliefs.extend((believed.x, believed.y, believed.yaw))
        self._encounters.add(
            (stamp - self._stamp, x, y, yaw, forward, twist.linear_y, yaw_rate), truth.pedestrians
        )
        if truth.tilt > self._max_tilt:
            self._max_tilt = truth.tilt
        self._states.extend((stamp, x, y, yaw, forward, yaw_rate))
        self._stamp = stamp

    def measurements(self, truth: Truth) -> Row:
        """The measured part of the episode's row, from the final truth; keys carry their units."""
        states = np.array(self._states).reshape(-1, STATE_SIZE)
        distance = distance_driven(states[:, 1], states[:, 2])
        return {
            "duration_s": truth.stamp,
            "distance_m": distance,
            "average_speed_mps": distance / truth.stamp if truth.stamp else 0.0,
            **_motion(states),
            "max_tilt_rad": self._max_tilt,
            "motion_energy_kwh": truth.motion_energy / JOULES_PER_KWH,
            **_contacts(truth, self._kinds),
            **self._people(truth),
            **localization_errors(
                states[:-1, 1:4], np.array(self._beliefs).reshape(-1, BELIEF_SIZE)
            ),
        }

    def _people(self, truth: Truth) -> Row:
        """Distances, times to collision and personal space."""
        met = self._encounters
        met.finish()
        # [s]
        inside: dict[str, float | None] = {
            "intimate": met.intimate_time,
            "personal": met.personal_time,
        }
        if len(truth.pedestrians) == 0 or truth.stamp == 0.0:
            inside = dict.fromkeys(inside)
        return {
            "min_pedestrian_distance_m": _finite(met.min_distance),
            "min_time_to_collision_s": _finite(met.min_time_to_collision),
            **{f"{zone}_intrusion_s": time for zone, time in inside.items()},
            **{
                f"{zone}_intrusion_percent": None if time is None else 100.0 * time / truth.stamp
                for zone, time in inside.items()
            },
        }


def _motion(states: FloatArray) -> Row:
    stamp, x, y, yaw, speed, yaw_rate = states.T
    period = (stamp[-1] - stamp[0]) / max(len(stamp) - 1, 1)  # [s] of a tick
    lateral = lateral_acceleration(speed, yaw_rate, period) if period > 0.0 else np.empty(0)
    return {
        "path_irregularity_radpm": path_irregularity(x, y, yaw),
        "jerk_p95_mps3": largest_usual(jerk(speed, period)) if period > 0.0 else None,
        "lateral_acceleration_p95_mps2": largest_usual(lateral),
    }


def _contacts(truth: Truth, kinds: frozenset[str]) -> Row:
    cargo = truth.cargo
    return {
        "collision_impulse_ns": float(sum(c.impulse for c in truth.counted_contacts)),
        "pedestrian_contacts": sum(c.partner is Partner.PEDESTRIAN for c in truth.counted_contacts),
        **property_contacts(truth.counted_contacts, kinds),
        "soft_contacts": soft_contacts(truth),
        "pieces_at_start": cargo.pieces_at_start if cargo else None,
        "pieces_lost": cargo.pieces_outside if cargo else None,
    }


def localization_errors(true: FloatArray, believed: FloatArray) -> Row:
    """Errors of position and heading of poses (T, 3) of x, y [m], yaw [rad].

    None where nothing is believed.
    """
    known = ~np.isnan(believed[:, 0])
    difference = believed[known] - true[known]
    return {
        **_statistics("localization_error", "m", np.hypot(difference[:, 0], difference[:, 1])),
        **_statistics("heading_error", "rad", np.abs(wrapped(difference[:, 2]))),
    }


def _statistics(name: str, unit: str, errors: FloatArray) -> Row:
    figures: Sequence[float | None] = [None] * 4
    if len(errors):
        median, p95 = np.percentile(errors, (50.0, 95.0))
        figures = [float(errors.mean()), float(median), float(p95), float(errors.max())]
    return {
        f"{name}_{key}_{unit}": value
        for key, value in zip(("mean", "median", "p95", "max"), figures, strict=True)
    }


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
