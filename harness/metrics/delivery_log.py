"""Watches one delivery; what is measured of it is worked out when it is over."""

import math
from array import array

import numpy as np

from harness.metrics.catalog import EPISODE_METRICS
from harness.metrics.columns import Row
from harness.metrics.contacts import property_contacts, soft_contacts
from harness.metrics.encounters import Body, Encounters
from harness.metrics.ground import ground_driven
from harness.metrics.motion import (
    distance_driven,
    jerk,
    lateral_acceleration,
    wrapped,
)
from harness.world.map.scene import Scene
from harness.world.truth import Partner, Truth
from navstack.types import Belief, FloatArray, Pose2D

JOULES_PER_KWH = 3.6e6
STATE_SIZE = 7  # stamp, x, y, yaw, forward speed, yaw rate, tilt
BELIEF_SIZE = 3  # x, y, yaw
NOWHERE = Belief(Pose2D(math.nan, math.nan, math.nan))  # of who does not localize


class DeliveryLog:
    """Takes in a delivery tick by tick."""

    def __init__(self, truth: Truth, scene: Scene, body: Body) -> None:
        """Start with the state in which the brain first sees the world.

        Args:
            truth: that state.
            scene: the world; contacts with kinds of obstacles that it lacks are undefined, not 0.
            body: how people meet the robot.
        """
        self._scene = scene
        self._states = array("d")  # STATE_SIZE per tick, the state at the start first
        self._beliefs = array("d")  # BELIEF_SIZE per tick, of the pose before it
        self._encounters = Encounters(body)
        pose, twist = truth.pose, truth.twist
        self._states.extend(
            (truth.stamp, pose.x, pose.y, pose.yaw, twist.linear_x, twist.angular_z, truth.tilt)
        )
        self._stamp = truth.stamp  # [s] of the last state

    def record(self, truth: Truth, belief: Belief | None) -> None:
        """Take in the state after a step, and the belief before it (None: nobody localizes)."""
        pose, twist, stamp = truth.pose, truth.twist, truth.stamp
        x, y, yaw, forward, yaw_rate = pose.x, pose.y, pose.yaw, twist.linear_x, twist.angular_z
        believed = (belief or NOWHERE).pose
        self._beliefs.extend((believed.x, believed.y, believed.yaw))
        self._encounters.add(
            (stamp - self._stamp, x, y, yaw, forward, twist.linear_y, yaw_rate), truth.pedestrians
        )
        self._states.extend((stamp, x, y, yaw, forward, yaw_rate, truth.tilt))
        self._stamp = stamp

    def measurements(self, truth: Truth) -> Row:
        """The measured part of the episode's row, from the final truth; keys carry their units."""
        series = self.series()
        distance = distance_driven(series["x"], series["y"])
        return {
            "duration_s": truth.stamp,
            "distance_m": distance,
            "average_speed_mps": distance / truth.stamp if truth.stamp else 0.0,
            "motion_energy_kwh": truth.motion_energy / JOULES_PER_KWH,
            **_contacts(truth, frozenset(obstacle.kind for obstacle in self._scene.obstacles)),
            **self._people(truth),
            **ground_driven(series["stamp"], series["x"], series["y"], self._scene),
            **{each.key: each.measured(series) for each in EPISODE_METRICS if each.is_of_series},
        }

    def series(self) -> dict[str, FloatArray]:
        """What was recorded, tick by tick, by name.

        ``stamp`` [s], ``x``, ``y`` [m], ``yaw`` [rad], ``speed`` [m/s], ``yaw_rate`` [rad/s] and
        ``tilt`` [rad] are true. ``jerk`` [m/s3] and ``lateral_acceleration`` [m/s2] are magnitudes,
        ``localization_error`` [m] and ``heading_error`` [rad] those of the belief.
        """
        states = np.array(self._states).reshape(-1, STATE_SIZE)
        stamp, x, y, yaw, speed, yaw_rate, tilt = states.T
        beliefs = np.array(self._beliefs).reshape(-1, BELIEF_SIZE)
        localization, heading = localization_errors(states[:-1, 1:4], beliefs)
        found = {
            "stamp": stamp,
            "x": x,
            "y": y,
            "yaw": yaw,
            "speed": speed,
            "yaw_rate": yaw_rate,
            "tilt": tilt,
            "jerk": np.empty(0),
            "lateral_acceleration": np.empty(0),
            "localization_error": localization,
            "heading_error": heading,
        }
        period = (stamp[-1] - stamp[0]) / max(len(stamp) - 1, 1)  # [s] of a tick
        if period > 0.0:
            found["jerk"] = np.abs(jerk(speed, period))
            found["lateral_acceleration"] = np.abs(lateral_acceleration(speed, yaw_rate, period))
        return found

    def _people(self, truth: Truth) -> Row:
        """Distances, times to collision and personal space."""
        met = self._encounters
        met.finish()
        row: Row = {
            "min_pedestrian_distance_m": _finite(met.min_distance),
            "min_time_to_collision_s": _finite(met.min_time_to_collision),
        }
        for zone, time in (("intimate", met.intimate_time), ("personal", met.personal_time)):
            row[f"{zone}_intrusion_s"] = row[f"{zone}_intrusion_percent"] = None
            if len(truth.pedestrians) and truth.stamp:
                row[f"{zone}_intrusion_s"] = time
                row[f"{zone}_intrusion_percent"] = 100.0 * time / truth.stamp
        return row


def _contacts(truth: Truth, kinds: frozenset[str]) -> Row:
    row = {
        "collision_impulse_ns": float(sum(c.impulse for c in truth.counted_contacts)),
        "pedestrian_contacts": sum(c.partner is Partner.PEDESTRIAN for c in truth.counted_contacts),
        **property_contacts(truth.counted_contacts, kinds),
        "soft_contacts": soft_contacts(truth),
        "pieces_at_start": None,
        "pieces_lost": None,
    }
    if truth.cargo:
        row["pieces_at_start"] = truth.cargo.pieces_at_start
        row["pieces_lost"] = truth.cargo.pieces_outside
    return row


def localization_errors(true: FloatArray, believed: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Errors of position [m] and heading [rad] of poses (T, 3) of x, y [m], yaw [rad].

    Poses that nobody believes are left out.
    """
    known = ~np.isnan(believed[:, 0])
    dx, dy, turn = (believed[known] - true[known]).T
    return np.hypot(dx, dy), np.abs(wrapped(turn))


def _finite(value: float) -> float | None:
    if math.isfinite(value):
        return value
    return None
