"""Ray casting on an occupancy grid and against circles. Grid units are cells; row 0 is the lowest y."""

import math

import numpy as np
from numba import njit

_BITS = 2  # a block's side is 2 ** _BITS cells, so that shifts find the block of a cell
_SIDE = 1 << _BITS
_MAX_SQUARE = 255  # [blocks]
_LANES = 8  # rays that are under way at a time
_u = np.uint64  # unsigned indices spare the treatment of negative ones


@njit(cache=True)
def clearance_field(occupied):
    """Prepare a grid for :func:`cast_grid`: blocks of 4 x 4 cells with a ring of blocks around.

    Six bytes per block, so that what the rays of a scan look at stays in the processor's caches.

    Args:
        occupied: (H, W) bool.

    Returns:
        Height and width in cells, and the blocks per row.
        (blocks,) uint16: bit 4 * row + column of each occupied cell; all cells outside the grid are occupied.
        (4, blocks) uint8: side in blocks of the largest free square that begins in the block and goes on to higher x
        and y; to lower x and higher y; to higher x and lower y; to lower x and y. 0: not all its cells are free.
    """
    height, width = occupied.shape
    rows, columns = -(-height // _SIDE), -(-width // _SIDE)
    solid = np.full((rows + 2, columns + 2), 0xFFFF, np.uint16)
    for row in range(rows):
        for column in range(columns):
            bits = 0
            for bit in range(_SIDE * _SIDE):
                y, x = _SIDE * row + bit // _SIDE, _SIDE * column + bit % _SIDE
                if y >= height or x >= width or occupied[y, x]:
                    bits |= 1 << bit
            solid[row + 1, column + 1] = bits
    squares = np.zeros((4, rows + 2, columns + 2), np.uint8)
    for quadrant in range(4):
        _find_squares(solid, 1 - 2 * (quadrant & 1), 1 - (quadrant & 2), squares[quadrant])
    return height, width, columns + 2, solid.reshape(-1), squares.reshape((4, -1))


@njit(cache=True)
def _find_squares(solid, ahead_x, ahead_y, squares):
    """The side of the largest free square that begins in each block and goes on along ``ahead_x`` and ``ahead_y``.

    It is one more than the least of the next blocks along x, along y and along both (textbook recursion). Works in
    place on ``squares`` (rows, columns), which are zeros.
    """
    rows, columns = solid.shape[0] - 2, solid.shape[1] - 2
    for i in range(rows):
        row = rows - i if ahead_y > 0 else i + 1
        for j in range(columns):
            column = columns - j if ahead_x > 0 else j + 1
            if solid[row, column] == 0:
                beside = min(squares[row, column + ahead_x], squares[row + ahead_y, column])
                least = min(beside, squares[row + ahead_y, column + ahead_x])
                squares[row, column] = min(np.int64(least) + 1, _MAX_SQUARE)


@njit(cache=True)
def _start(beam, lane, x0, y0, cos, sin, directions, places, lengths):
    """Begin to cast a beam in a lane; arguments are those of :func:`cast_grid`.

    Coordinates are mirrored where needed, so that every ray goes to higher x and y.

    Args:
        beam: its number.
        lane: where it is kept while it is under way.
        x0: start.
        y0: start.
        cos: of the sensor's yaw.
        sin: of it.
        directions: of all beams.
        places: (lanes, 6) column, row, masks that mirror columns and rows, quadrant, beam.
        lengths: (lanes, 7) x, y of the start, the direction's x and y, their inverses, the length so far.
    """
    dx = cos * directions[beam, 0] - sin * directions[beam, 1]
    dy = sin * directions[beam, 0] + cos * directions[beam, 1]
    mirror_x, mirror_y = (-1 if dx < 0.0 else 0), (-1 if dy < 0.0 else 0)  # n ^ -1 is the mirrored cell, -1 - n
    places[lane, 0], places[lane, 1] = math.floor(x0) ^ mirror_x, math.floor(y0) ^ mirror_y
    places[lane, 2], places[lane, 3] = mirror_x, mirror_y
    places[lane, 4], places[lane, 5] = -mirror_x - 2 * mirror_y, beam
    lengths[lane, 0], lengths[lane, 1] = (-x0 if mirror_x else x0), (-y0 if mirror_y else y0)
    lengths[lane, 2], lengths[lane, 3] = abs(dx), abs(dy)
    lengths[lane, 4], lengths[lane, 5] = 1.0 / max(abs(dx), 1e-300), 1.0 / max(abs(dy), 1e-300)
    lengths[lane, 6] = 0.0


@njit(cache=True)
def _go_on(lane, blocks, places, lengths):
    """Take a ray out of the free square of ``blocks`` blocks ahead of it; 0: into the next cell.

    A ray through a corner passes the neighbour along x. Without branches, which processors would guess wrong.
    """
    lane = _u(lane)
    cx, cy = places[lane, 0], places[lane, 1]
    end_x = ((cx >> _BITS) + blocks) << _BITS if blocks else cx + 1
    end_y = ((cy >> _BITS) + blocks) << _BITS if blocks else cy + 1
    x, y = lengths[lane, 0], lengths[lane, 1]
    to_x, to_y = (end_x - x) * lengths[lane, 4], (end_y - y) * lengths[lane, 5]
    along_x = to_x <= to_y
    t = to_x if along_x else to_y
    # The cell across the border is known exactly; the other coordinate never goes back or leaves the square.
    next_x = max(min(math.floor(x + t * lengths[lane, 2]), end_x - 1), cx)
    next_y = max(min(math.floor(y + t * lengths[lane, 3]), end_y - 1), cy)
    places[lane, 0] = end_x if along_x else next_x
    places[lane, 1] = next_y if along_x else end_y
    lengths[lane, 6] = t


@njit(cache=True)
def cast_grid(field, x0, y0, cos, sin, directions, reach, ranges):
    """Cast all beams on the grid.

    A ray leaps over the free square ahead of it; in a block with occupied cells it goes from cell to cell (Amanatides &
    Woo 1987). Some rays go on in turn, so that what one waits for from memory comes while the others move.

    Args:
        field: of :func:`clearance_field`.
        x0: sensor in [cells] along x from the grid's lower left corner.
        y0: the same along y.
        cos: cosine of the sensor's yaw in the grid frame.
        sin: its sine.
        directions: (n, 2) unit vectors of the beams in the sensor frame.
        reach: [cells] beyond which nothing is seen.
        ranges: (n,) output in [cells]; inf where nothing is hit, and outside the grid.
    """
    height, width, stride, solid, squares = field
    ranges[:] = math.inf
    if not (0.0 <= x0 < width and 0.0 <= y0 < height):
        return
    places, lengths = np.empty((_LANES, 6), np.int64), np.empty((_LANES, 7))
    begun = under_way = min(_LANES, len(directions))
    for lane in range(under_way):
        _start(lane, lane, x0, y0, cos, sin, directions, places, lengths)
    while under_way > 0:
        lane = 0
        while lane < under_way:
            u = _u(lane)
            column, row = places[u, 0] ^ places[u, 2], places[u, 1] ^ places[u, 3]
            at = _u(((row >> _BITS) + 1) * stride + (column >> _BITS) + 1)
            blocks, hit = np.int64(squares[_u(places[u, 4]), at]), 0
            if blocks == 0:
                hit = np.int64(solid[at]) >> (_SIDE * (row & (_SIDE - 1)) + (column & (_SIDE - 1))) & 1
            if hit == 0 and lengths[u, 6] <= reach:
                _go_on(lane, blocks, places, lengths)
                lane += 1
                continue
            if lengths[u, 6] <= reach and 0 <= column < width and 0 <= row < height:
                ranges[places[u, 5]] = lengths[u, 6]
            if begun < len(directions):
                _start(begun, lane, x0, y0, cos, sin, directions, places, lengths)
                begun += 1
            else:
                under_way -= 1
                places[lane], lengths[lane] = places[under_way], lengths[under_way]


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
