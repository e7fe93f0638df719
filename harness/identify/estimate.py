"""A value that was identified, with its interval, and the statistics that intervals come from."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import minimize
from scipy.stats import chi2, t

from navstack.types import BoolArray, FloatArray

LEVEL = 0.95
BLOCK = 8.0  # [s] of neighbouring residuals that may depend on each other
_MAD = 1.4826  # standard deviation over median absolute deviation, of a normal distribution
# [-] by which an interval of a component grows: wheels' errors are not quite white and normal
_MISMATCH = 0.05
_RATIO = chi2.ppf(LEVEL, 1)


@dataclass(frozen=True, slots=True)
class Estimate:
    """One identified value."""

    key: str  # its name with its unit
    value: float | None  # None: not identifiable
    low: float | None = None  # 95 % interval
    high: float | None = None
    seconds: float = 0.0  # [s] of data that it rests on
    method: str = ""
    advice: str = ""  # what to drive so that it can be identified

    @property
    def is_known(self) -> bool:
        """Whether it was identified."""
        return self.value is not None

    def as_json(self) -> dict[str, Any]:
        """As ``navbench identify --json`` has it."""
        value, low, high = (
            None if each is None else float(each) for each in (self.value, self.low, self.high)
        )
        return {
            "value": value,
            "low": low,
            "high": high,
            "seconds": float(self.seconds),
            "method": self.method,
            "advice": self.advice,
        }


def around(key: str, value: float, half: float, seconds: float, method: str) -> Estimate:
    """A value with an interval of a half width."""
    return Estimate(key, value, value - half, value + half, seconds, method)


def unknown(key: str, advice: str, seconds: float = 0.0) -> Estimate:
    """A value that the log does not tell."""
    return Estimate(key, None, seconds=seconds, advice=advice)


def robust_std(values: FloatArray) -> float:
    """Standard deviation of normal values (N,) among outliers, by the median absolute deviation."""
    if not len(values):
        return 0.0
    return float(_MAD * np.median(np.abs(values - np.median(values))))


def half_widths(
    jacobian: FloatArray,
    residuals: FloatArray,
    stamps: FloatArray,
    block: float = BLOCK,
) -> FloatArray:
    """Half widths (p,) of 95 % intervals of least-squares parameters.

    Residuals depend on their neighbours: the sandwich estimator with blocks of time as clusters
    (White 1984, Asymptotic Theory for Econometricians, ch. 6) and Student's t with one degree of
    freedom per block but one. With few blocks that may be too small by chance: never less than the
    textbook's, for independent residuals.

    Args:
        jacobian: (N, p) of the residuals.
        residuals: (N,).
        stamps: (N,) [s].
        block: [s] of neighbouring residuals that may depend on each other.
    """
    inverse = np.linalg.pinv(jacobian.T @ jacobian)
    _, blocks = np.unique(np.floor(stamps / block), return_inverse=True)
    count = int(blocks.max()) + 1
    scores = np.zeros((count, jacobian.shape[1]))
    np.add.at(scores, blocks, jacobian * residuals[:, None])
    freedom = max(count - 1, 1)
    middle = scores.T @ scores * (count / freedom)
    variance = residuals @ residuals / max(len(residuals) - len(inverse), 1)
    clustered = np.diag(inverse @ middle @ inverse)
    variances = np.maximum(clustered, variance * np.diag(inverse))
    half: FloatArray = t.ppf(0.5 + 0.5 * LEVEL, freedom) * np.sqrt(variances)
    return half


def combined(estimates: Sequence[Estimate]) -> Estimate:
    """One value from several of it, weighted by their intervals.

    Where they disagree by more than these, the interval grows by the ratio (Birge 1932). The first
    one if none is known.
    """
    known = [each for each in estimates if each.value is not None]
    if len(known) < 2:
        return (known or list(estimates))[0]
    values = np.array([each.value for each in known])
    halves = np.array([_half(each) for each in known])
    weights = 1.0 / halves**2
    value = float(np.sum(weights * values) / np.sum(weights))
    ratio = np.sqrt(np.sum(weights * (values - value) ** 2) / (len(known) - 1)) * 1.96
    half = float(max(ratio, 1.0) / np.sqrt(np.sum(weights)))
    seconds = max(each.seconds for each in known)
    method = " and ".join(each.method for each in known)
    return around(known[0].key, value, half, seconds, method)


def widened(value: Estimate, parts: Sequence[Estimate]) -> Estimate:
    """A combined value whose interval is no narrower than that of its best part.

    For parts that share an error.
    """
    if value.value is None:
        return value
    half = max(_half(value), min(_half(each) for each in parts if each.value is not None))
    return replace(value, low=value.value - half, high=value.value + half)


def _half(estimate: Estimate) -> float:
    """Half the width of a known value's interval."""
    low, high = estimate.low, estimate.high
    if low is None or high is None:
        return 1.0
    return max(0.5 * (high - low), 1e-9)


def deviation_interval(count: int) -> tuple[float, float]:
    """Factors from a standard deviation of ``count`` normal values to its 95 % interval.

    By the chi-squared distribution (textbook).
    """
    freedom = max(count - 1, 1)
    tail = 0.5 * (1.0 - LEVEL)
    return (
        float(np.sqrt(freedom / chi2.ppf(1.0 - tail, freedom))),
        float(np.sqrt(freedom / chi2.ppf(tail, freedom))),
    )


def variance_components(
    residuals: FloatArray, causes: FloatArray
) -> list[tuple[float, float, float]]:
    """Deviations k with variances ``causes @ k**2`` of normal residuals, each with its interval.

    Maximum likelihood; intervals by the profile of the likelihood (Wilks 1938). A component that
    may be 0 has the lower end 0.

    Args:
        residuals: (N,), of mean 0.
        causes: (N, p) what each deviation grows with, not negative.

    Returns:
        Value, low and high of each.
    """
    scale = np.median(np.abs(residuals)) ** 2 + 1e-18
    size = causes.mean(axis=0) + 1e-18
    squares = residuals**2 / scale
    shares = causes / size

    def deficit(logs: FloatArray) -> tuple[float, FloatArray]:
        parts = shares * np.exp(logs)
        variances = parts.sum(axis=1) + 1e-9
        slopes = (1.0 - squares / variances) / variances
        return float(np.sum(np.log(variances) + squares / variances)), slopes @ parts

    count = causes.shape[1]
    best = _minimum(deficit, np.zeros(count))
    least, _ = deficit(best)
    found = []
    for number in range(count):
        ends = [
            _profile_end(deficit, best, number, least + _RATIO, direction) for direction in (-1, 1)
        ]
        logs = np.array((best[number], *ends))
        values = np.sqrt(np.exp(logs) * scale / size[number])
        values *= (1.0, 1.0 - _MISMATCH, 1.0 + _MISMATCH)
        found.append((float(values[0]), float(values[1]), float(values[2])))
    return found


_LOWEST, _HIGHEST = -9.0, 6.0  # logarithms of a component's share of the variance


_Deficit = Callable[[FloatArray], tuple[float, FloatArray]]  # with its gradient


def _minimum(function: _Deficit, start: FloatArray) -> FloatArray:
    bounds = [(_LOWEST, _HIGHEST)] * len(start)
    result: FloatArray = minimize(function, start, method="L-BFGS-B", jac=True, bounds=bounds).x
    return result


def _profile_end(
    deficit: _Deficit,
    best: FloatArray,
    number: int,
    limit: float,
    direction: int,
) -> float:
    """The logarithm of a component at which the profile of the likelihood crosses a limit."""
    others = np.delete(np.arange(len(best)), number)
    end = _HIGHEST if direction > 0 else -np.inf

    def profile(value: float) -> float:
        def rest(logs: FloatArray) -> tuple[float, FloatArray]:
            found, slopes = deficit(np.insert(logs, number, value))
            return found, slopes[others]

        if not len(others):
            return rest(np.empty(0))[0]
        return rest(_minimum(rest, best[others]))[0]

    inside, outside = best[number], best[number] + direction * 0.25
    while profile(outside) < limit:
        inside, outside = outside, outside + direction * 0.5
        if not _LOWEST < outside < _HIGHEST:
            return float(end)
    for _ in range(6):
        middle = 0.5 * (inside + outside)
        if profile(middle) < limit:
            inside = middle
        else:
            outside = middle
    return float(0.5 * (inside + outside))


def runs_of(chosen: BoolArray) -> list[slice]:
    """The stretches of neighbours that are chosen (N,)."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], chosen, [False])).astype(np.int8)))
    return [slice(int(a), int(b)) for a, b in edges.reshape(-1, 2)]
