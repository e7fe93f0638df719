"""Ray casting on an occupancy grid and against circles. Grid units are cells.

Row 0 is the lowest y.
"""

import math
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from harness.world.sensors.ray_lanes import (
    BEAM,
    COLUMN,
    FLOATS,
    INTEGERS,
    LANES,
    LENGTH,
    ROW,
    SHIFT_X,
    SHIFT_Y,
    SIDE,
    SIGN_X,
    SIGN_Y,
    STOPS,
    TILE,
    Field,
    advance,
    look_ahead,
    place_of,
    start_lane,
)
from navstack.jit import njit
from navstack.types import (
    BoolMatrix,
    ByteArray,
    FloatArray,
    FloatMatrix,
    FloatVector,
)

Unsigned = TypeVar("Unsigned", np.uint8, np.uint16)
_MAX_SQUARE = np.int64(255)  # [blocks]


@njit(ahead=True)
def clearance_field(occupied: BoolMatrix) -> Field:
    """Prepare a grid for :func:`cast_grid`: blocks of 4 x 4 cells with a ring of blocks around.

    Six bytes per block, tile by tile: what is near in the plane lies in one line of the processor's
    caches.

    Args:
        occupied: (H, W) bool.

    Returns:
        Height and width in cells, and the tiles per row. (blocks,) uint16: bit 4 * row + column of
        each occupied cell; all cells outside the grid are occupied. (4 * blocks,) uint8: side in
        blocks of the largest free square that begins in the block and goes on to higher x and y; to
        lower x and higher y; to higher x and lower y; to lower x and y. 0: not all its cells are
        free.
    """
    height, width = occupied.shape
    rows, columns = -(-height // SIDE), -(-width // SIDE)
    tiles = -(-(columns + 2) // TILE)
    solid = np.full((-(-(rows + 2) // TILE) * TILE, tiles * TILE), 0xFFFF, np.uint16)
    for row in range(rows):
        for column in range(columns):
            bits = 0
            for bit in range(SIDE * SIDE):
                y, x = SIDE * row + bit // SIDE, SIDE * column + bit % SIDE
                if y >= height or x >= width or occupied[y, x]:
                    bits |= 1 << bit
            solid[row + 1, column + 1] = bits
    squares = np.zeros((4, solid.size), np.uint8)
    for quadrant in range(4):
        ahead = np.zeros(solid.shape, np.uint8)
        _find_squares(solid, rows, columns, 1 - 2 * (quadrant & 1), 1 - (quadrant & 2), ahead)
        _by_tiles(ahead, squares[quadrant])
    blocks = _by_tiles(solid, np.empty(solid.size, np.uint16))
    return height, width, tiles, blocks, squares.reshape(-1)


@njit()
def _by_tiles(
    table: npt.NDArray[Unsigned], ordered: npt.NDArray[Unsigned]
) -> npt.NDArray[Unsigned]:
    """Put the blocks of a table (rows, columns) into their places.

    Returns ``ordered`` (blocks,).
    """
    rows, columns = table.shape
    for row in range(rows):
        for column in range(columns):
            ordered[place_of(row, column, columns // TILE)] = table[row, column]
    return ordered


@njit()
def _find_squares(
    solid: npt.NDArray[np.uint16],
    rows: int,
    columns: int,
    ahead_x: int,
    ahead_y: int,
    squares: ByteArray,
) -> None:
    """The side of the largest free square that begins in each block.

    It goes on along ``ahead_x`` and ``ahead_y``, and is one more than the least of the next blocks
    along x, along y and along both (textbook recursion). Works in place on ``squares``, which are
    zeros, from row and column 1 on.
    """
    for i in range(rows):
        row = rows - i if ahead_y > 0 else i + 1
        for j in range(columns):
            column = columns - j if ahead_x > 0 else j + 1
            if solid[row, column] == 0:
                beside = min(squares[row, column + ahead_x], squares[row + ahead_y, column])
                least = np.int64(min(beside, squares[row + ahead_y, column + ahead_x]))
                squares[row, column] = min(least + 1, _MAX_SQUARE)


@njit(ahead=True)
def cast_grid(
    field: Field,
    x0: float,
    y0: float,
    cos: float,
    sin: float,
    directions: FloatMatrix,
    reach: float,
    ranges: FloatVector,
) -> None:
    """Cast all beams on the grid.

    A ray leaps over the free square ahead of it; in a block with occupied cells it goes from cell
    to cell (Amanatides & Woo 1987). Many rays are under way at a time, each in a lane of the
    buffers.

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
    height, width, tiles, solid, squares = field
    ranges[:] = math.inf
    if not (0.0 <= x0 < width and 0.0 <= y0 < height) or len(directions) == 0:
        return
    b, n = np.empty(FLOATS), np.zeros(INTEGERS, np.int32)
    begun, ended = min(LANES, len(directions)), 0
    for lane in range(LANES):
        start_lane(lane, min(lane, begun - 1), x0, y0, cos, sin, directions, field, b, n)
    n[BEAM + begun : BEAM + LANES] = -1  # these cast the last one again, for nothing
    while ended < len(directions):
        look_ahead(solid, squares, n)
        advance(reach, tiles, b, n)
        for lane in range(LANES):
            beam = n[BEAM + lane]
            if n[STOPS + lane] == 0 or beam < 0:
                continue
            column = b[COLUMN + lane] * b[SIGN_X + lane] + b[SHIFT_X + lane]
            row = b[ROW + lane] * b[SIGN_Y + lane] + b[SHIFT_Y + lane]
            if b[LENGTH + lane] <= reach and 0 <= column < width and 0 <= row < height:
                ranges[beam] = b[LENGTH + lane]
            ended += 1
            n[BEAM + lane] = -1
            if begun < len(directions):
                start_lane(lane, begun, x0, y0, cos, sin, directions, field, b, n)
                begun += 1


@njit(ahead=True)
def cast_circles(
    circles: FloatMatrix,
    radius: float,
    x0: float,
    y0: float,
    yaw: float,
    directions: FloatMatrix,
    angle_min: float,
    increment: float,
    reach: float,
    ranges: FloatVector,
) -> None:
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
        # One beam more on each side: rounding must not lose a beam, and the exact test below
        # decides.
        first = math.floor(start / increment) - 1
        for lap in range(-1, 1):
            low = first + lap * math.floor(turn / increment + 0.5)
            high = low + math.ceil(2.0 * half / increment) + 3
            for i in range(max(low, 0), min(high, n - 1) + 1):
                _meet(i, px, py, squared, radius, directions, ranges)


@njit()
def _meet(
    i: int,
    px: float,
    py: float,
    squared: float,
    radius: float,
    directions: FloatArray,
    ranges: FloatArray,
) -> None:
    """Shorten beam ``i`` to the near intersection with a circle about (px, py), if it meets it."""
    along = px * directions[i, 0] + py * directions[i, 1]
    discriminant = along * along - squared + radius * radius
    if along > 0.0 and discriminant >= 0.0:
        ranges[i] = min(ranges[i], along - math.sqrt(discriminant))


@njit(ahead=True)
def finish_scan(
    ranges: FloatVector,
    noise: FloatVector,
    range_min: float,
    range_max: float,
    directions_base: FloatMatrix,
    mount_x: float,
    mount_y: float,
    box: FloatVector,
) -> None:
    """Add noise and drop what the sensor does not report.

    Args:
        ranges: (n,) exact ranges in [m]; replaced in place.
        noise: (n,) errors in [m].
        range_min: [m]; nearer returns become inf.
        range_max: [m]; farther ones too.
        directions_base: (n, 2) unit vectors of the beams in the base frame.
        mount_x: sensor in the base frame, [m].
        mount_y: [m].
        box: (4,) x_min, x_max, y_min, y_max in the base frame, [m]; points inside are taken for the
            robot itself.
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
