"""Ray casting on an occupancy grid and against circles. Grid units are cells; row 0 is the lowest y."""

import math

import numpy as np
from numba import njit

MAX_CLEARANCE = 255  # [cells] the field saturates here


@njit(cache=True)
def clearance_field(occupied):
    """Chessboard distance from every cell to the nearest occupied one, in cells, at most ``MAX_CLEARANCE``.

    Two raster passes with the unit mask, exact for this metric (Rosenfeld & Pfaltz 1968). Around a cell of clearance
    k all cells of the square [-(k - 1), k - 1]^2 are free, so a ray may leap to the border of that square.

    Args:
        occupied: (H, W) bool.

    Returns:
        (H, W) uint8; 0 on occupied cells. Outside the grid counts as free.
    """
    height, width = occupied.shape
    field = np.full((height + 2, width + 2), MAX_CLEARANCE, np.uint8)
    for y in range(1, height + 1):
        for x in range(1, width + 1):
            if occupied[y - 1, x - 1]:
                field[y, x] = 0
            else:
                above = min(field[y - 1, x - 1], field[y - 1, x], field[y - 1, x + 1])
                field[y, x] = min(MAX_CLEARANCE, min(above, field[y, x - 1]) + 1)
    for y in range(height, 0, -1):
        for x in range(width, 0, -1):
            below = min(field[y + 1, x - 1], field[y + 1, x], field[y + 1, x + 1])
            field[y, x] = min(np.int64(field[y, x]), min(below, field[y, x + 1]) + 1)
    return field[1:-1, 1:-1].copy()


@njit(cache=True)
def _cast(field, x0, y0, dx, dy, reach):
    """Length from (x0, y0) along the unit vector (dx, dy) to where the ray enters an occupied cell, in cells.

    Inf beyond ``reach`` and outside the grid. A ray through a cell corner passes the neighbour along x.
    """
    height, width = field.shape
    cx, cy = math.floor(x0), math.floor(y0)
    inverse_x = 1.0 / dx if dx != 0.0 else math.inf
    inverse_y = 1.0 / dy if dy != 0.0 else math.inf
    t = 0.0
    while t <= reach and 0 <= cx < width and 0 <= cy < height:
        k = np.int64(field[cy, cx])
        if k == 0:
            return t
        # Borders of the free square around the cell, where the ray leaves it.
        tx = ((cx + k if dx > 0.0 else cx - k + 1) - x0) * inverse_x if dx != 0.0 else math.inf
        ty = ((cy + k if dy > 0.0 else cy - k + 1) - y0) * inverse_y if dy != 0.0 else math.inf
        # The cell across the border is known exactly; the other coordinate never goes back or leaves the square.
        if tx <= ty:
            t = tx
            side = math.floor(y0 + t * dy)
            cy = min(max(side, cy), cy + k - 1) if dy > 0.0 else max(min(side, cy), cy - k + 1)
            cx = cx + k if dx > 0.0 else cx - k
        else:
            t = ty
            side = math.floor(x0 + t * dx)
            cx = min(max(side, cx), cx + k - 1) if dx > 0.0 else max(min(side, cx), cx - k + 1)
            cy = cy + k if dy > 0.0 else cy - k
    return math.inf


@njit(cache=True)
def cast_grid(field, x0, y0, cos, sin, directions, reach, ranges):
    """Cast all beams on the grid.

    Args:
        field: (H, W) uint8 of :func:`clearance_field`.
        x0: sensor in [cells] along x from the grid's lower left corner.
        y0: the same along y.
        cos: cosine of the sensor's yaw in the grid frame.
        sin: its sine.
        directions: (n, 2) unit vectors of the beams in the sensor frame.
        reach: [cells] beyond which nothing is seen.
        ranges: (n,) output in [cells]; inf where nothing is hit.
    """
    for i in range(len(directions)):
        dx = cos * directions[i, 0] - sin * directions[i, 1]
        dy = sin * directions[i, 0] + cos * directions[i, 1]
        ranges[i] = _cast(field, x0, y0, dx, dy, reach)


@njit(cache=True)
def cast_circles(circles, radius, x0, y0, yaw, directions, angle_min, increment, reach, ranges):
    """Shorten the beams that meet a circle, looking only at the beams within each circle's bearing.

    Args:
        circles: (m, >= 2) centres x, y in the frame of the sensor's pose, [m].
        radius: of every circle, [m].
        x0: sensor pose, [m].
        y0: [m].
        yaw: [rad].
        directions: (n, 2) unit vectors of the beams in the sensor frame.
        angle_min: [rad] of beam 0 in the sensor frame.
        increment: [rad] between beams.
        reach: [m] beyond which nothing is seen.
        ranges: (n,) in [m], shortened in place.
    """
    n = len(directions)
    cos, sin = math.cos(yaw), math.sin(yaw)
    turn = 2.0 * math.pi
    for j in range(len(circles)):
        dx, dy = circles[j, 0] - x0, circles[j, 1] - y0
        squared = dx * dx + dy * dy
        if squared > (reach + radius) ** 2:
            continue
        if squared <= radius * radius:
            ranges[:] = 0.0  # the sensor stands inside
            return
        px, py = cos * dx + sin * dy, -sin * dx + cos * dy
        half = math.asin(radius / math.sqrt(squared))
        start = (math.atan2(py, px) - half - angle_min) % turn
        # One beam more on each side: rounding must not lose a beam, and the exact test below decides.
        first = math.floor(start / increment) - 1
        for lap in range(-1, 1):
            low = first + lap * math.floor(turn / increment + 0.5)
            high = low + math.ceil(2.0 * half / increment) + 3
            for i in range(max(low, 0), min(high, n - 1) + 1):
                _meet(i, px, py, squared, radius, directions, ranges)


@njit(cache=True)
def _meet(i, px, py, squared, radius, directions, ranges):
    """Shorten beam ``i`` to the near intersection with a circle about (px, py), if it meets it."""
    along = px * directions[i, 0] + py * directions[i, 1]
    discriminant = along * along - squared + radius * radius
    if along > 0.0 and discriminant >= 0.0:
        ranges[i] = min(ranges[i], along - math.sqrt(discriminant))


@njit(cache=True)
def finish_scan(ranges, noise, range_min, range_max, directions_base, mount_x, mount_y, box):
    """Add noise and drop what the sensor does not report.

    Args:
        ranges: (n,) exact ranges in [m]; replaced in place.
        noise: (n,) errors in [m].
        range_min: [m]; nearer returns become inf.
        range_max: [m]; farther ones too.
        directions_base: (n, 2) unit vectors of the beams in the base frame.
        mount_x: sensor in the base frame, [m].
        mount_y: [m].
        box: (4,) x_min, x_max, y_min, y_max in the base frame, [m]; points inside are taken for the robot itself.
    """
    for i in range(len(ranges)):
        if ranges[i] > range_max:
            ranges[i] = math.inf
            continue
        measured = ranges[i] + noise[i]
        x = mount_x + measured * directions_base[i, 0]
        y = mount_y + measured * directions_base[i, 1]
        own = box[0] <= x <= box[1] and box[2] <= y <= box[3]
        if own or not range_min <= measured <= range_max:
            measured = math.inf
        ranges[i] = measured
