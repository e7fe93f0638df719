"""From a scan to the bodies in it that no map shows."""

import math

import numpy as np
from scipy import ndimage

from navstack.costmap.occupancy_grid import OCCUPIED, OccupancyGrid
from navstack.jit import njit
from navstack.types import (
    BoolArray,
    BoolVector,
    ByteArray,
    ByteMatrix,
    FloatArray,
    FloatMatrix,
    FloatVector,
)


def background_of(static_map: OccupancyGrid, margin: float) -> ByteArray:
    """The cells (H, W) of a map within ``margin`` [m] along x and y of an occupied one: 1, else 0.

    Raises:
        MapError: the map is rotated.
    """
    static_map.require_unrotated("map")
    size = 2 * math.ceil(margin / static_map.resolution) + 1
    cells = (static_map.data >= OCCUPIED).astype(np.uint8)
    for axis in (0, 1):
        cells = ndimage.maximum_filter1d(cells, size, axis=axis, mode="constant")
    return cells


@njit()
def is_background(
    background: ByteArray,
    origin_x: float,
    origin_y: float,
    resolution: float,
    x: float,
    y: float,
) -> bool:
    """Whether a point of the map frame [m] is near something that the map shows, or off the map."""
    column = math.floor((x - origin_x) / resolution)
    row = math.floor((y - origin_y) / resolution)
    height, width = background.shape
    return not (0 <= column < width and 0 <= row < height) or background[row, column] == 1


@njit(ahead=True)
def mark_foreground(
    ranges: FloatVector,
    angle_min: float,
    increment: float,
    range_min: float,
    max_range: float,
    sensor: FloatVector,
    background: ByteMatrix,
    origin: FloatVector,
    resolution: float,
    foreground: BoolVector,
) -> None:
    """Which beams return from something that the map does not show.

    Args:
        ranges: (n,) [m]; what is not finite has no return.
        angle_min: [rad] of beam 0 in the sensor frame.
        increment: [rad].
        range_min: [m].
        max_range: [m].
        sensor: (3,) x, y [m], yaw [rad] of the sensor in the map frame.
        background: (H, W) of :func:`background_of`.
        origin: (2,) [m] of the map's lower left corner.
        resolution: [m/cell].
        foreground: (n,) output.
    """
    for i in range(len(ranges)):
        r = ranges[i]
        foreground[i] = False
        if not range_min <= r <= max_range:  # nan too
            continue
        angle = sensor[2] + angle_min + i * increment
        x = sensor[0] + r * math.cos(angle)
        y = sensor[1] + r * math.sin(angle)
        foreground[i] = not is_background(background, origin[0], origin[1], resolution, x, y)


@njit(ahead=True)
def find_bodies(
    ranges: FloatVector,
    foreground: BoolVector,
    increment: float,
    is_closed: bool,
    cluster_gap: float,
    min_points: int,
    max_width: float,
    body_radius: float,
    bodies: FloatMatrix,
) -> int:
    """Group neighbouring foreground beams, and measure each group as the near side of a cylinder.

    The upright cylinder's centre is ``body_radius`` behind the nearest return, at the bearing of
    the group's middle.

    Args:
        ranges: (n,) [m].
        foreground: (n,) of :func:`mark_foreground`.
        increment: [rad] between beams; negative: the beams turn clockwise.
        is_closed: whether the last beam is beside the first.
        cluster_gap: [m], see :class:`TrackerParams`.
        min_points: returns of a group.
        max_width: [m] of a group.
        body_radius: [m].
        bodies: (n, 3) output: middle beam (may be between two), distance of the centre [m], 1 where
            something nearer or the end of an open scan may hide a part of it, else 0.

    Returns:
        How many were found.
    """
    n = len(ranges)
    start = found = i = 0
    if is_closed:
        start = first_break(ranges, foreground, increment, cluster_gap)
    while i < n:
        at = (start + i) % n
        if not foreground[at]:
            i += 1
            continue
        nearest = ranges[at]
        length = 1
        while i + length < n:
            last = (start + i + length - 1) % n
            following = (start + i + length) % n
            if not foreground[following] or not belongs(
                ranges[last], ranges[following], increment, cluster_gap
            ):
                break
            nearest = min(nearest, ranges[following])
            length += 1
        end = (start + i + length - 1) % n
        if length >= min_points and length * abs(increment) * nearest <= max_width:
            bodies[found, 0] = start + i + 0.5 * (length - 1)
            bodies[found, 1] = nearest + body_radius
            hidden = not is_closed and (at == 0 or end == n - 1)
            hidden = hidden or is_hidden(ranges, (at - 1) % n, ranges[at], cluster_gap)
            hidden = hidden or is_hidden(ranges, (end + 1) % n, ranges[end], cluster_gap)
            bodies[found, 2] = hidden
            found += 1
        i += length
    return found


@njit()
def first_break(
    ranges: FloatArray, foreground: BoolArray, increment: float, cluster_gap: float
) -> int:
    """The first beam that does not belong to the one before it: there no group is cut."""
    n = len(ranges)
    for i in range(n):
        before = (i - 1) % n
        if not (
            foreground[i]
            and foreground[before]
            and belongs(ranges[before], ranges[i], increment, cluster_gap)
        ):
            return i
    return 0


@njit()
def belongs(before: float, after: float, increment: float, cluster_gap: float) -> bool:
    """Whether two returns [m] of neighbouring beams can come from one surface.

    It is seen at no more than 60 degrees.
    """
    return bool(abs(after - before) <= cluster_gap + 2.0 * min(before, after) * abs(increment))


@njit()
def is_hidden(ranges: FloatArray, beside: int, edge: float, cluster_gap: float) -> bool:
    """Whether the beam beside a group ends nearer than the group's edge [m].

    Then the group may go on behind.
    """
    return bool(ranges[beside] < edge - cluster_gap)
