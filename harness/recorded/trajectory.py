"""Trajectories: TUM files in and out, and the errors of one against another."""

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from harness.storage.files import replacing
from navstack.errors import InputError
from navstack.files import check_regular
from navstack.geometry import rotation
from navstack.types import FloatArray, IntArray

MATCHED_WITHIN = 0.02  # [s] between two poses of one time; the TUM tools' default
LARGEST_FILE = 400_000_000  # [bytes]
_COLUMNS = 8  # timestamp tx ty tz qx qy qz qw
_APART = 0.25  # [-] of the interval by which a pair of poses may be farther apart or nearer


@dataclass(frozen=True, slots=True, eq=False)
class Trajectory:
    """Poses in the plane in the order of their stamps."""

    stamps: FloatArray  # (N,) [s]
    poses: FloatArray  # (N, 3) x, y [m], yaw [rad]; yaw nan: positions only

    @classmethod
    def of_rows(cls, rows: FloatArray) -> "Trajectory":
        """From rows (N, 4) stamp, x, y, yaw in any order."""
        rows = rows[np.argsort(rows[:, 0], kind="stable")]
        return cls(rows[:, 0], rows[:, 1:])

    def __len__(self) -> int:
        return len(self.stamps)


@dataclass(frozen=True, slots=True, eq=False)
class Errors:
    """Errors of poses, or of relative motions."""

    positions: FloatArray  # (n,) [m]
    yaws: FloatArray | None  # (n,) [rad], not negative; None: of positions only

    def as_json(self) -> dict[str, float | int | None]:
        """Median, root mean square, 95th percentile and maximum, with n."""
        return {
            "n": len(self.positions),
            **_summary("", "m", self.positions),
            **_summary("yaw_", "rad", self.yaws),
        }


def write_tum(path: Path, trajectory: Trajectory) -> None:
    """Write a TUM file.

    Raises:
        InputError: the file cannot be written.
    """
    half = trajectory.poses[:, 2] / 2.0
    zero = np.zeros(len(trajectory))
    x, y = trajectory.poses[:, 0], trajectory.poses[:, 1]
    rows = np.column_stack((trajectory.stamps, x, y, zero, zero, zero, np.sin(half), np.cos(half)))
    try:
        with replacing(path) as stream:
            np.savetxt(stream, rows, fmt=("%.9f", "%.6f", "%.6f", "%g", "%g", "%g", "%.9f", "%.9f"))
    except OSError as error:
        raise InputError(
            f"trajectory '{path}' cannot be written: {error.strerror or error}"
        ) from None


def read_tum(path: Path) -> Trajectory:
    """Read a TUM file: ``timestamp tx ty tz qx qy qz qw`` per line; comments begin with #.

    Raises:
        InputError: it cannot be read, or a line is not of this form.
    """
    try:
        check_regular(path, LARGEST_FILE)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # of an empty file, which is refused below
            rows = np.loadtxt(path, dtype=np.float64, comments="#", ndmin=2, encoding="utf-8")
    except OSError as error:
        raise InputError(f"trajectory '{path}' cannot be read: {error.strerror or error}") from None
    except ValueError as error:
        reason = str(error).partition(";")[0].splitlines()[0]
        raise InputError(
            f"trajectory '{path}' is no TUM file (timestamp tx ty tz qx qy qz qw): {reason}"
        ) from None
    if rows.shape[0] == 0 or rows.shape[1] != _COLUMNS or not np.isfinite(rows).all():
        raise InputError(
            f"trajectory '{path}' is no TUM file: each line needs {_COLUMNS} finite numbers"
        )
    qx, qy, qz, qw = rows[:, 4:].T
    yaws = np.arctan2(2.0 * (qw * qz + qx * qy), qw * qw + qx * qx - qy * qy - qz * qz)
    return Trajectory.of_rows(np.column_stack((rows[:, :3], yaws)))


def match(estimate: Trajectory, reference: Trajectory) -> tuple[Trajectory, Trajectory]:
    """For every pose of the reference the estimate's nearest in time.

    Without those that are too far apart.

    Raises:
        InputError: nothing is left.
    """
    nearest = _nearest(estimate.stamps, reference.stamps)
    is_near = np.abs(estimate.stamps[nearest] - reference.stamps) <= MATCHED_WITHIN
    if not is_near.any():
        ranges = [f"{t.stamps[0]:.2f} to {t.stamps[-1]:.2f} s" for t in (estimate, reference)]
        raise InputError(
            f"no pose of the reference is within {MATCHED_WITHIN} s of one of the trajectory; "
            f"that runs from {ranges[0]}, the reference from {ranges[1]}"
        )
    chosen = nearest[is_near]
    return (
        Trajectory(estimate.stamps[chosen], estimate.poses[chosen]),
        Trajectory(reference.stamps[is_near], reference.poses[is_near]),
    )


def align(estimate: Trajectory, reference: Trajectory, how: str) -> Trajectory:
    """The matched estimate moved as a whole.

    Args:
        estimate: to be moved.
        reference: stays; of the same length.
        how: ``none``; ``start``: the first poses agree (positions only: the first positions);
            ``se2``: the positions agree best in the least squares (Umeyama 1991, in the plane,
            without scale).
    """
    if how == "none":
        return estimate
    moving, fixed = estimate.poses, reference.poses
    if how == "start":
        turn = np.nan_to_num(fixed[0, 2] - moving[0, 2])
        centre, target = moving[0, :2], fixed[0, :2]
    else:
        centre, target = moving[:, :2].mean(axis=0), fixed[:, :2].mean(axis=0)
        a, b = moving[:, :2] - centre, fixed[:, :2] - target
        turn = math.atan2((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum(), (a * b).sum())
    places = (moving[:, :2] - centre) @ rotation(-turn) + target
    return Trajectory(estimate.stamps, np.column_stack((places, moving[:, 2] + turn)))


def absolute_errors(estimate: Trajectory, reference: Trajectory) -> Errors:
    """The absolute pose error (APE) of matched trajectories.

    Distances, and differences of heading.
    """
    difference = estimate.poses - reference.poses
    yaws = None
    if not np.isnan(difference[:, 2]).any():
        yaws = np.abs(_wrapped(difference[:, 2]))
    return Errors(np.hypot(difference[:, 0], difference[:, 1]), yaws)


def relative_errors(estimate: Trajectory, reference: Trajectory, interval: float) -> Errors | None:
    """The relative pose error (RPE) over an interval [s], as the TUM tools define it.

    Sturm et al. 2012, eq. 2: the difference between the two motions from a pose to the one nearest
    to ``interval`` later, where there is one within a quarter of it. None: there is none, or the
    reference has no headings.
    """
    if np.isnan(reference.poses[:, 2]).any():
        return None
    stamps = reference.stamps
    ends = _nearest(stamps, stamps + interval)
    has_end = np.abs(stamps[ends] - stamps - interval) <= _APART * interval
    has_end &= stamps + interval <= stamps[-1] + MATCHED_WITHIN
    starts, ends = np.flatnonzero(has_end), ends[has_end]
    if len(starts) == 0:
        return None
    ours = motions_between(estimate.poses[starts], estimate.poses[ends])
    theirs = motions_between(reference.poses[starts], reference.poses[ends])
    difference = ours - theirs
    return Errors(np.hypot(difference[:, 0], difference[:, 1]), np.abs(_wrapped(difference[:, 2])))


def motions_between(before: FloatArray, after: FloatArray) -> FloatArray:
    """Poses (n, 3) as seen from others (n, 3)."""
    dx, dy, turn = (after - before).T
    cos, sin = np.cos(before[:, 2]), np.sin(before[:, 2])
    return np.column_stack((cos * dx + sin * dy, cos * dy - sin * dx, turn))


def _nearest(among: FloatArray, stamps: FloatArray) -> IntArray:
    """Indices of the sorted values nearest to each of ``stamps``."""
    right = np.clip(np.searchsorted(among, stamps), 1, max(len(among) - 1, 1)).clip(
        max=len(among) - 1
    )
    left = np.maximum(right - 1, 0)
    nearest: IntArray = np.where(
        np.abs(stamps - among[left]) <= np.abs(among[right] - stamps), left, right
    )
    return nearest


def _wrapped(angles: FloatArray) -> FloatArray:
    wrapped: FloatArray = (angles + math.pi) % (2.0 * math.pi) - math.pi
    return wrapped


def _summary(prefix: str, unit: str, values: FloatArray | None) -> dict[str, float | int | None]:
    names: Sequence[str] = ("median", "rmse", "p95", "max")
    if values is None:
        return {f"{prefix}{name}_{unit}": None for name in names}
    found = (
        np.median(values),
        np.sqrt(np.mean(values**2)),
        np.percentile(values, 95.0),
        values.max(),
    )
    return {
        f"{prefix}{name}_{unit}": float(value) for name, value in zip(names, found, strict=True)
    }
