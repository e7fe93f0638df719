"""Place and heading from wheels and fixes, with noise and scale by maximum likelihood.

Fixes wander: their errors of one second are those of the next. A window that is laid on its fixes
turns after the wander, and takes it for length. Here heading and offset wander each at a rate of
its own, and what explains the fixes best is chosen (prediction-error method: Ljung 1999, System
Identification, ch. 7.2 and 7.4; the filter is an extended Kalman filter).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize
from scipy.stats import norm

from harness.identify.estimate import LEVEL
from harness.identify.wheel_path import WheelPath, turn_onto
from navstack.jit import njit
from navstack.types import BoolArray, FloatArray

_HEADING_BY = 20.0  # [m] driven until the heading is known from fixes
_UNSURE_HEADING = 0.3  # [rad] deviation of that
_FAR = 3.0  # [-] deviations from which an innovation counts linearly (Huber)
_GAP = 1.0  # [s] of the odometry over which nothing is known of the way
_LOST, _LOST_TURN = 100.0, 1.0  # [m2], [rad2] added in a gap
_LEAST = 30  # fixes
# logarithms, from which the fit starts: wander of the offset [m/sqrt(s)] and of the heading
# [rad/sqrt(s)]
_WANDER = (-2.0, -3.0)
_SIDES = (0.02, 0.7, 0.7, 0.7)  # of the simplex: scale, offset, heading, white noise
_MOST = 9.0  # of a logarithm's size
_STEP = 1e-2  # of them, for second derivatives


@dataclass(frozen=True, slots=True, eq=False)
class FixTrack:
    """Fixes, and the way by the wheels from each to the next."""

    stamps: FloatArray  # (N,) [s]
    fixes: FloatArray  # (N, 2) x, y [m]
    ways: FloatArray  # (N - 1, 2) [m] of the base, in the frame of the path
    swings: FloatArray  # (N - 1, 2) [m] of the antenna beside it, likewise
    gaps: BoolArray  # (N - 1,) whether the odometry has a gap there
    heading: float  # [rad] from the path's frame to that of the fixes, at first


@dataclass(frozen=True, slots=True)
class FilterFit:
    """What explains the fixes best."""

    share: float  # [-] true length over the odometry's
    half: float  # [-] half width of its 95 % interval


def track_of(path: WheelPath, fixes: FloatArray) -> FixTrack | None:
    """The fixes (N, 3 or more; stamp, x, y) along a path; None: too few or not driven enough."""
    inside = (fixes[:, 0] > path.stamps[0]) & (fixes[:, 0] < path.stamps[-1])
    fixes = fixes[inside]
    if len(fixes) < _LEAST:
        return None
    stamps = fixes[:, 0]
    places, antenna = path.at(stamps)[:, :2], path.of_antenna(stamps)
    driven = path.length(np.full(len(stamps), stamps[0]), stamps)
    first = driven <= _HEADING_BY
    if driven[-1] < _HEADING_BY:
        return None
    turn = turn_onto(antenna[first], fixes[first, 1:3])
    jumps = np.flatnonzero(np.diff(path.stamps) > _GAP)
    gaps = np.zeros(len(stamps) - 1, dtype=bool)
    for begin, end in zip(path.stamps[jumps], path.stamps[jumps + 1], strict=True):
        gaps |= (stamps[:-1] < end) & (stamps[1:] > begin)
    heading = float(np.arctan2(turn[1, 0], turn[0, 0]))
    swings = np.diff(antenna - places, axis=0)
    return FixTrack(stamps, fixes[:, 1:3], np.diff(places, axis=0), swings, gaps, heading)


@njit()
def _run(
    stamps: FloatArray,
    fixes: FloatArray,
    ways: FloatArray,
    swings: FloatArray,
    gaps: BoolArray,
    heading: float,
    logs: FloatArray,
) -> float:
    """Twice the negative log likelihood of the fixes."""
    share = np.exp(logs[0])
    offset, turn, white = np.exp(2.0 * logs[1]), np.exp(2.0 * logs[2]), np.exp(2.0 * logs[3])
    x = np.array((fixes[0, 0], fixes[0, 1], heading))
    p = np.diag(np.array((white, white, _UNSURE_HEADING**2)))
    deficit = 0.0
    for k in range(len(ways)):
        dt = stamps[k + 1] - stamps[k]
        cos, sin = np.cos(x[2]), np.sin(x[2])
        dx, dy = share * ways[k, 0] + swings[k, 0], share * ways[k, 1] + swings[k, 1]
        ex, ey = cos * dx - sin * dy, sin * dx + cos * dy
        f = np.eye(3)
        f[0, 2], f[1, 2] = -ey, ex
        x = x + np.array((ex, ey, 0.0))
        p = f @ p @ f.T
        p[0, 0] += offset * dt + gaps[k] * _LOST
        p[1, 1] += offset * dt + gaps[k] * _LOST
        p[2, 2] += turn * dt + gaps[k] * _LOST_TURN
        s = p[:2, :2] + white * np.eye(2)
        inverse = np.linalg.inv(s)
        error = fixes[k + 1] - x[:2]
        squared = error @ inverse @ error
        far = np.sqrt(squared)
        weight = 1.0
        if far > _FAR:
            weight = _FAR / far
            squared = _FAR * (2.0 * far - _FAR)
        deficit += np.log(np.linalg.det(s)) + squared
        gain = p[:, :2].copy() @ inverse
        x = x + weight * (gain @ error)
        p = p - weight * (gain @ p[:2, :].copy())
    return deficit


def fit_filter(track: FixTrack, white: float) -> FilterFit:
    """Fit the noise with a scale of 1, then both.

    Args:
        track: what to explain.
        white: [m] noise of the fixes from which the fit starts.
    """

    def of_noise(logs: FloatArray) -> float:
        return of_all(np.insert(logs, 0, 0.0))

    def of_all(logs: FloatArray) -> float:
        ways = track.ways, track.swings
        return float(_run(track.stamps, track.fixes, *ways, track.gaps, track.heading, logs))

    noise = _minimum(of_noise, np.array((*_WANDER, np.log(white))))
    found = _minimum(of_all, np.insert(noise, 0, 0.0))
    variance = float(np.linalg.pinv(0.5 * _hessian(of_all, found))[0, 0])
    half = float(norm.ppf(0.5 + 0.5 * LEVEL)) * max(variance, 0.0) ** 0.5
    share = float(np.exp(found[0]))
    return FilterFit(share, share * half)


def _minimum(function: Callable[[FloatArray], float], start: FloatArray) -> FloatArray:
    simplex = np.vstack((start, start + np.diag(_SIDES[-len(start) :])))
    options = {"initial_simplex": simplex, "xatol": 1e-3, "fatol": 1e-2, "maxiter": 600}
    bounds = [(-_MOST, _MOST)] * len(start)
    result: FloatArray = minimize(
        function,
        start,
        method="Nelder-Mead",
        bounds=bounds,
        options=options,
    ).x
    return result


def _hessian(function: Callable[[FloatArray], float], at: FloatArray) -> FloatArray:
    """Second derivatives (n, n) by central differences."""
    steps = _STEP * np.eye(len(at))
    found = np.empty((len(at), len(at)))
    for i, a in enumerate(steps):
        for j, b in enumerate(steps):
            corners = function(at + a + b) - function(at + a - b)
            corners -= function(at - a + b) - function(at - a - b)
            found[i, j] = corners / (4.0 * _STEP**2)
    return found
