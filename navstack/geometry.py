"""Angles, transforms in the plane and footprints: pure functions."""

import math
from collections.abc import Sequence

import numpy as np

from navstack.errors import ParameterError
from navstack.types import FloatArray, Pose2D


def normalize_angle(angle: float) -> float:
    """The same angle in [-pi, pi)."""
    return (angle + math.pi) % (2.0 * math.pi) - math.pi


def shortest_angular_distance(start: float, end: float) -> float:
    """The signed turn in [-pi, pi) that leads from ``start`` to ``end``, in [rad]."""
    return normalize_angle(end - start)


def compose(frame: Pose2D, local: Pose2D) -> Pose2D:
    """A pose given in ``frame``, expressed in the parent of ``frame``."""
    cos, sin = math.cos(frame.yaw), math.sin(frame.yaw)
    return Pose2D(
        frame.x + cos * local.x - sin * local.y,
        frame.y + sin * local.x + cos * local.y,
        normalize_angle(frame.yaw + local.yaw),
    )


def relative_to(frame: Pose2D, pose: Pose2D) -> Pose2D:
    """A pose of the parent frame, expressed in ``frame``: the inverse of :func:`compose`."""
    cos, sin = math.cos(frame.yaw), math.sin(frame.yaw)
    dx, dy = pose.x - frame.x, pose.y - frame.y
    return Pose2D(cos * dx + sin * dy, -sin * dx + cos * dy, normalize_angle(pose.yaw - frame.yaw))


def rotation(angle: float) -> FloatArray:
    """The matrix (2, 2) that turns a column vector by ``angle`` [rad]."""
    cos, sin = math.cos(angle), math.sin(angle)
    return np.array(((cos, -sin), (sin, cos)))


def transform_points(frame: Pose2D, points: FloatArray) -> FloatArray:
    """Points (N, 2) given in ``frame``, expressed in the parent of ``frame``."""
    moved: FloatArray = points @ rotation(frame.yaw).T + (frame.x, frame.y)
    return moved


def points_relative_to(frame: Pose2D, points: FloatArray) -> FloatArray:
    """Points (N, 2) of the parent frame, expressed in ``frame``."""
    moved: FloatArray = (points - (frame.x, frame.y)) @ rotation(frame.yaw)
    return moved


def make_footprint(vertices: Sequence[Sequence[float]]) -> FloatArray:
    """A footprint polygon (N, 2) in [m], base frame.

    Raises:
        ParameterError: fewer than three vertices, or a vertex that is not a pair of finite numbers.
    """
    try:
        polygon = np.array(vertices, dtype=np.float64)
    except (TypeError, ValueError):
        polygon = np.empty(0)
    if (
        polygon.ndim != 2
        or polygon.shape[0] < 3
        or polygon.shape[1] != 2
        or not np.isfinite(polygon).all()
    ):
        raise ParameterError(
            f"footprint {vertices!r} is not a list of at least three [x, y] pairs in metres"
        )
    return polygon


def crosses_itself(polygon: FloatArray) -> bool:
    """Whether edges of a polygon (N, 2) cross or touch, so that its corners are in no order."""
    import shapely  # here alone, and seldom: it takes longer to load than the rest

    return not shapely.LinearRing(polygon).is_simple


def holds_origin(polygon: FloatArray) -> bool:
    """Whether the origin lies within a polygon (N, 2) of either order, by its winding number."""
    angles = np.arctan2(polygon[:, 1], polygon[:, 0])
    turns = np.roll(angles, -1) - angles
    turned = np.remainder(turns + math.pi, 2.0 * math.pi) - math.pi
    return bool(abs(turned.sum()) > math.pi)


def pad_footprint(footprint: FloatArray, padding: float) -> FloatArray:
    """Move each vertex outwards by ``sign(coordinate) * padding``, as nav2_costmap_2d does."""
    return footprint + np.sign(footprint) * padding


def footprint_radii(footprint: FloatArray) -> tuple[float, float]:
    """Inscribed and circumscribed radius of a footprint about the base origin, in [m].

    The inscribed radius is the least distance from the origin to an edge (nav2_costmap_2d's
    ``calculateMinAndMaxDistances``).
    """
    edges = np.roll(footprint, -1, axis=0) - footprint
    length_squared = np.maximum((edges**2).sum(axis=1), 1e-300)
    t = np.clip(-(footprint * edges).sum(axis=1) / length_squared, 0.0, 1.0)
    nearest = footprint + t[:, None] * edges
    return float(np.hypot(*nearest.T).min()), float(np.hypot(*footprint.T).max())


def cover(footprint: FloatArray, count: int) -> tuple[FloatArray, float]:
    """Centres (count,) in [m] on the base's x axis and radius [m] of circles over a footprint."""
    front, rear = float(footprint[:, 0].max()), float(footprint[:, 0].min())
    half = (front - rear) / (2 * count)
    centres = np.linspace(rear + half, front - half, count)
    return centres, math.hypot(half, float(np.abs(footprint[:, 1]).max()))


def largest_variance(covariance: FloatArray) -> float:
    """The largest variance along any direction of the plane, of a covariance (n, n) of x, y, .."""
    a, b, c = float(covariance[0, 0]), float(covariance[0, 1]), float(covariance[1, 1])
    return max(0.0, 0.5 * (a + c) + math.hypot(0.5 * (a - c), b))
