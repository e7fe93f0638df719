"""What touching a person is expected to cost: the parts that controllers and critics share.

People are seen as circles, the robot as a box. Where a person will be is a normal distribution
about a straight walk.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from navstack.jit import njit, tuple_of
from navstack.params.expected_contact import ContactPrices
from navstack.types import FloatArray, FloatMatrix, FloatVector, IntArray, IntVector, Pose2D, Track

# x, y [m], vx, vy [m/s], radius [m], variances of place [m2] and velocity [m2/s2] per axis
FIELDS = 7
UNLIKELY = 4.0  # standard deviations beyond which nothing happens
# of a row of the robot's states: [m], [m], [rad], [m/s], [rad/s]; cosine and sine of the yaw
X, Y, YAW, V, OMEGA, COS, SIN = range(7)
# slope at which the logistic function is nearest to the normal distribution's (Bowling et al. 2009)
_LOGISTIC = 1.702
# Shares of position_std: this one adds to the track's variance, the rest to the deviation itself,
# so that the place of an exact track has position_std.
_SHARE_OF_TRACK = 0.6
_SHARE_OF_SHAPE = 0.4
# Chosen by deliveries among people, like the parameters' defaults.
_MOST_SPREAD = 0.6  # [m] that the track's covariance adds at most
_KNOWN = 2.0  # [s] over which the track's velocity variance counts; then it is the drift's
_TOUCHING = 1e-6  # [m] from the box, below which the direction is that of the nearest side


class RobotBox(NamedTuple):
    """The robot's outline: a box about a point of the base frame's x axis."""

    centre: float  # [m] on the x axis
    half_length: float  # [m]
    half_width: float  # [m]


class ContactRates(NamedTuple):
    """What a contact costs; fields as in ``ExpectedCostParams``."""

    touch_usd: float
    counted_speed: float
    speed_std: float
    position_std: float
    drift_std: float


def body_of(footprint: FloatArray) -> RobotBox:
    """The bounding box of a footprint (V, 2), base frame."""
    low = footprint.min(axis=0)
    high = footprint.max(axis=0)
    half_length, half_width = (0.5 * (high - low)).tolist()
    return RobotBox(float(0.5 * (low[0] + high[0])), half_length, half_width)


def nearest(
    tracks: Sequence[Track],
    pose: Pose2D,
    stamp: float,
    most: int,
    reach: float,
) -> FloatArray:
    """The nearest tracks within ``reach`` [m] at ``stamp`` [s] as rows (n <= most, FIELDS)."""
    rows = rows_of(tracks, stamp)
    near: FloatArray = rows[nearest_of(rows, pose, most, reach)]
    return near


def rows_of(tracks: Sequence[Track], stamp: float) -> FloatArray:
    """Where all tracks are at ``stamp`` [s], in their order: rows (n, FIELDS)."""
    rows = np.empty((len(tracks), FIELDS))
    for row, track in zip(rows, tracks, strict=True):
        late = stamp - track.stamp
        p = track.covariance
        row[:5] = (
            track.x + late * track.vx,
            track.y + late * track.vy,
            track.vx,
            track.vy,
            track.radius,
        )
        row[5:] = 0.5 * (p[0, 0] + p[1, 1]), 0.5 * (p[2, 2] + p[3, 3])
    return rows


def nearest_of(rows: FloatArray, pose: Pose2D, most: int, reach: float) -> IntArray:
    """Numbers (k <= most,) of the rows within ``reach`` [m] of the robot, the nearest first."""
    distances = np.hypot(rows[:, 0] - pose.x, rows[:, 1] - pose.y)
    order = np.argsort(distances, kind="stable")[:most]
    near: IntArray = order[distances[order] <= reach]
    return near


class ContactPricing:
    """The prices of a critic as the kernels take them."""

    def __init__(self, params: ContactPrices) -> None:
        self._params = params
        self.rates: ContactRates = tuple_of(ContactRates, params)
        self.contact_usd = np.array(params.contact_usd)

    def people(self, tracks: Sequence[Track], pose: Pose2D, stamp: float) -> FloatArray:
        """Who (n, FIELDS) counts."""
        return nearest(tracks, pose, stamp, self._params.max_tracks, self._params.range)


@njit(inline="always")
def spread_at(person: FloatArray, t: float, position_std: float, drift_std: float) -> float:
    """Standard deviation [m] of the place of a person (FIELDS,) who walks on for ``t`` [s]."""
    tracked = _SHARE_OF_TRACK**2 * position_std**2 + person[5] + person[6] * min(t, _KNOWN) ** 2
    known = min(math.sqrt(tracked), _MOST_SPREAD)
    return known + _SHARE_OF_SHAPE * position_std + drift_std * t


@njit(inline="always")
def chance(z: float) -> float:
    """Probability that a standard normal variable exceeds ``z``, by the logistic function."""
    return 1.0 / (1.0 + math.exp(_LOGISTIC * z))


@njit(inline="always")
def contact_cost(closing: float, contact_usd: FloatArray) -> float:
    """What a counted contact costs [USD] at a closing speed [m/s], by linear interpolation."""
    last = len(contact_usd) - 1
    place = min(max(closing, 0.0), float(last))
    i = min(int(place), last - 1)
    return float(contact_usd[i] + (place - i) * (contact_usd[i + 1] - contact_usd[i]))


@njit(inline="always")
def gap_to(
    rx: float, ry: float, half_length: float, half_width: float
) -> tuple[float, float, float]:
    """Distance [m] from a box about the origin to a point, negative inside, and its direction."""
    ex = abs(rx) - half_length
    ey = abs(ry) - half_width
    ax = max(ex, 0.0)
    ay = max(ey, 0.0)
    gap = math.sqrt(ax * ax + ay * ay)
    if gap > _TOUCHING:
        return gap, math.copysign(ax, rx) / gap, math.copysign(ay, ry) / gap
    if ey > ex:
        return ey, 0.0, math.copysign(1.0, ry)
    return ex, math.copysign(1.0, rx), 0.0


@njit(inline="always")
def seen_from(state: FloatArray, x: float, y: float, body: RobotBox) -> tuple[float, float]:
    """A point of the map from the middle of the robot's box in a state (7,), along its axes [m]."""
    dx = x - state[X]
    dy = y - state[Y]
    along = state[COS] * dx + state[SIN] * dy - body.centre
    return along, state[COS] * dy - state[SIN] * dx


@njit(inline="always")
def closing_speed(
    state: FloatArray,
    vx: float,
    vy: float,
    rx: float,
    ry: float,
    nx: float,
    ny: float,
    body: RobotBox,
) -> float:
    """How fast [m/s] the nearest points of robot and person approach along (nx, ny), base frame.

    (vx, vy) is the person's velocity in the map, (rx, ry) its place by :func:`seen_from`.
    """
    px = min(max(rx, -body.half_length), body.half_length) + body.centre
    py = min(max(ry, -body.half_width), body.half_width)
    along = state[COS] * vx + state[SIN] * vy
    across = state[COS] * vy - state[SIN] * vx
    return float((state[V] - state[OMEGA] * py - along) * nx + (state[OMEGA] * px - across) * ny)


@njit(inline="always")
def touch_price(closing: float, rates: ContactRates, contact_usd: FloatArray) -> float:
    """What touching somebody costs [USD] at a predicted closing speed [m/s]."""
    counted = chance((rates.counted_speed - closing) / rates.speed_std)
    return rates.touch_usd + counted * contact_cost(max(closing, rates.counted_speed), contact_usd)


@njit(ahead=True)
def expected_contacts(
    x: FloatMatrix,
    y: FloatMatrix,
    yaw: FloatMatrix,
    lengths: IntVector,
    steps: FloatVector,
    speeds: FloatMatrix,
    turns: FloatMatrix,
    people: FloatMatrix,
    body: RobotBox,
    rates: ContactRates,
    contact_usd: FloatVector,
) -> FloatArray:
    """Expected cost (K,) [USD] of the contacts with people on each of K trajectories.

    Args:
        x: (K, T) [m] of the poses, the first one now; map frame.
        y: (K, T) [m].
        yaw: (K, T) [rad].
        lengths: (K,) poses of each trajectory; the rest of its row does not count.
        steps: (K,) [s] between two poses.
        speeds: (K, T) [m/s] at the poses; of fewer columns: the last one holds on.
        turns: the same of the yaw rate [rad/s].
        people: (n, FIELDS).
        body: the robot.
        rates: prices and spreads.
        contact_usd: (S,) [USD] of a counted contact at a closing speed of 0, 1, .. m/s.
    """
    costs = np.zeros(len(x))
    state = np.empty(7)
    for i in range(len(x)):
        for p in range(len(people)):
            person = people[p]
            worst = 0.0
            for k in range(lengths[i]):
                t = k * steps[i]
                state[X] = x[i, k]
                state[Y] = y[i, k]
                state[V] = speeds[i, min(k, speeds.shape[1] - 1)]
                state[OMEGA] = turns[i, min(k, turns.shape[1] - 1)]
                state[COS] = math.cos(yaw[i, k])
                state[SIN] = math.sin(yaw[i, k])
                there_x = person[0] + t * person[2]
                there_y = person[1] + t * person[3]
                rx, ry = seen_from(state, there_x, there_y, body)
                gap, nx, ny = gap_to(rx, ry, body.half_length, body.half_width)
                std = spread_at(person, t, rates.position_std, rates.drift_std)
                gap -= person[4]
                if gap > UNLIKELY * std:
                    continue
                closing = closing_speed(state, person[2], person[3], rx, ry, nx, ny, body)
                worst = max(worst, chance(gap / std) * touch_price(closing, rates, contact_usd))
            costs[i] += worst
    return costs
