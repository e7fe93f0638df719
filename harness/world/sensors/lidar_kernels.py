"""Ray casting on an occupancy grid and against circles. Grid units are cells.

Row 0 is the lowest y.
"""

import math
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from navstack.jit import njit
from navstack.types import BoolArray, ByteArray, FloatArray

Field = tuple[int, int, int, npt.NDArray[np.uint16], ByteArray]  # of clearance_field
Index = TypeVar("Index", int, np.int32)  # vector instructions work on many of 32 bits
Unsigned = TypeVar("Unsigned", np.uint8, np.uint16)

_BITS = 2  # a block's side is 2 ** _BITS cells, so that shifts find the block of a cell
_TILE_BITS = 3  # and a tile's 2 ** _TILE_BITS blocks
_SIDE, _TILE = 1 << _BITS, 1 << _TILE_BITS
_MAX_SQUARE = np.int64(255)  # [blocks]
# rays that are under way at a time; a constant, so that the loops over them use vector instructions
LANES = 32
# Where in the buffers of the rays their values stand: in that of floats
X, Y, DX, DY, INVERSE_X, INVERSE_Y = (LANES * i for i in range(6))  # start, direction, one over it
# so far [cells], and the cell that it leads to
LENGTH, COLUMN, ROW = (LANES * i for i in range(6, 9))
# that mirror cells: cell * sign + shift
SIGN_X, SIGN_Y, SHIFT_X, SHIFT_Y = (LANES * i for i in range(9, 13))
FLOATS = 13 * LANES
# ... and in that of integers.
# block, its squares', beam; see _look, _go
AT, SQUARES_AT, BEAM, BLOCKS, CELLS, STOPS = (LANES * i for i in range(6))
INTEGERS = 6 * LANES
_u, _i = np.uint64, np.int32  # unsigned indices spare the treatment of negative ones


@njit()
def _place_of(row: Index, column: Index, tiles: int) -> Index:
    """Where a block stands in a table with ``tiles`` tiles per row."""
    tile = (row >> _TILE_BITS) * tiles + (column >> _TILE_BITS)
    return (tile << 2 * _TILE_BITS) + ((row & (_TILE - 1)) << _TILE_BITS) + (column & (_TILE - 1))


@njit(ahead="bool[:, ::1]")
def clearance_field(occupied: BoolArray) -> Field:
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
    rows, columns = -(-height // _SIDE), -(-width // _SIDE)
    tiles = -(-(columns + 2) // _TILE)
    solid = np.full((-(-(rows + 2) // _TILE) * _TILE, tiles * _TILE), 0xFFFF, np.uint16)
    for row in range(rows):
        for column in range(columns):
            bits = 0
            for bit in range(_SIDE * _SIDE):
                y, x = _SIDE * row + bit // _SIDE, _SIDE * column + bit % _SIDE
                if y >= height or x >= width or occupied[y, x]:
                    bits |= 1 << bit
            solid[row + 1, column + 1] = bits
    squares = np.zeros((4, solid.size), np.uint8)
    for quadrant in range(4):
        ahead = np.zeros(solid.shape, np.uint8)
        _find_squares(solid, rows, columns, 1 - 2 * (quadrant & 1), 1 - (quadrant & 2), ahead)
        _by_tiles(ahead, squares[quadrant])
    return (
        height,
        width,
        tiles,
        _by_tiles(solid, np.empty(solid.size, np.uint16)),
        squares.reshape(-1),
    )


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
            ordered[_place_of(row, column, columns // _TILE)] = table[row, column]
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


@njit()
def _start(
    lane: int,
    beam: int,
    x0: float,
    y0: float,
    cos: float,
    sin: float,
    directions: FloatArray,
    field: Field,
    b: FloatArray,
    n: npt.NDArray[np.int32],
) -> None:
    """Begin to cast a beam in a lane of the buffers.

    Other arguments are those of :func:`cast_grid`.

    Coordinates are mirrored where needed, so that every ray goes to higher x and y.
    """
    _, _, tiles, solid, _ = field
    dx = cos * directions[beam, 0] - sin * directions[beam, 1]
    dy = sin * directions[beam, 0] + cos * directions[beam, 1]
    sign_x, sign_y = (-1.0 if dx < 0.0 else 1.0), (-1.0 if dy < 0.0 else 1.0)
    # the mirrored cell is -1 - cell
    b[SIGN_X + lane], b[SHIFT_X + lane] = sign_x, 0.5 * (sign_x - 1.0)
    b[SIGN_Y + lane], b[SHIFT_Y + lane] = sign_y, 0.5 * (sign_y - 1.0)
    column, row = math.floor(x0), math.floor(y0)
    b[COLUMN + lane] = column * sign_x + b[SHIFT_X + lane]
    b[ROW + lane] = row * sign_y + b[SHIFT_Y + lane]
    b[X + lane], b[Y + lane], b[DX + lane], b[DY + lane] = (
        x0 * sign_x,
        y0 * sign_y,
        abs(dx),
        abs(dy),
    )
    b[INVERSE_X + lane], b[INVERSE_Y + lane] = (
        1.0 / max(abs(dx), 1e-300),
        1.0 / max(abs(dy), 1e-300),
    )
    b[LENGTH + lane] = 0.0
    n[BEAM + lane] = beam
    n[AT + lane] = _place_of((row >> _BITS) + 1, (column >> _BITS) + 1, tiles)
    n[SQUARES_AT + lane] = ((dx < 0.0) + 2 * (dy < 0.0)) * len(solid)


@njit()
def _look(solid: npt.NDArray[np.uint16], squares: ByteArray, n: npt.NDArray[np.int32]) -> None:
    """Read each lane's free square ahead, or the cells of its block where there is none.

    All at once, so that the processor waits for many places of memory at a time.
    """
    for i in range(LANES):
        n[BLOCKS + i] = squares[_u(n[SQUARES_AT + i] + n[AT + i])]
    for i in range(LANES):
        n[CELLS + i] = solid[_u(n[AT + i] if n[BLOCKS + i] == 0 else 0)]


@njit()
def _go(reach: float, tiles: int, b: FloatArray, n: npt.NDArray[np.int32]) -> None:
    """Take every ray out of the free square ahead of it, or into the next cell.

    Those in occupied cells or beyond ``reach`` stop. A ray through a corner passes the neighbour
    along x. Without branches, and with nothing that processors have no vector instructions for:
    cells are floats, places are int32.
    """
    for i in range(LANES):
        cx, cy, sign_x, sign_y = b[COLUMN + i], b[ROW + i], b[SIGN_X + i], b[SIGN_Y + i]
        shift_x, shift_y, x, y, length = (
            b[SHIFT_X + i],
            b[SHIFT_Y + i],
            b[X + i],
            b[Y + i],
            b[LENGTH + i],
        )
        blocks, cells = n[BLOCKS + i], n[CELLS + i]
        bit = _SIDE * (_i(cy * sign_y + shift_y) & (_SIDE - 1)) + (
            _i(cx * sign_x + shift_x) & (_SIDE - 1)
        )
        is_hit = (cells >> bit) & 1
        stops = (blocks == 0) & (is_hit != 0) | (length > reach)
        leap_x, leap_y = (
            (np.floor(cx / _SIDE) + blocks) * _SIDE,
            (np.floor(cy / _SIDE) + blocks) * _SIDE,
        )
        step_x, step_y = cx + 1.0, cy + 1.0
        end_x, end_y = (leap_x if blocks > 0 else step_x), (leap_y if blocks > 0 else step_y)
        to_x, to_y = (end_x - x) * b[INVERSE_X + i], (end_y - y) * b[INVERSE_Y + i]
        along_x = to_x <= to_y
        t = to_x if along_x else to_y
        # The cell across the border is known exactly; the other coordinate never goes back or
        # leaves the square.
        next_x, next_y = np.floor(x + t * b[DX + i]), np.floor(y + t * b[DY + i])
        last_x, last_y = end_x - 1.0, end_y - 1.0
        next_x, next_y = (
            (last_x if next_x > last_x else next_x),
            (last_y if next_y > last_y else next_y),
        )
        next_x, next_y = (cx if next_x < cx else next_x), (cy if next_y < cy else next_y)
        next_x, next_y = (end_x if along_x else next_x), (next_y if along_x else end_y)
        next_x, next_y = (cx if stops else next_x), (cy if stops else next_y)
        b[COLUMN + i], b[ROW + i], b[LENGTH + i] = next_x, next_y, (length if stops else t)
        column, row = _i(next_x * sign_x + shift_x), _i(next_y * sign_y + shift_y)
        n[AT + i] = _place_of((row >> _BITS) + 1, (column >> _BITS) + 1, tiles)
        n[STOPS + i] = stops


@njit(
    ahead="Tuple((int64, int64, int64, uint16[::1], uint8[::1])), float64, float64, float64, float64, "
    "float64[:, ::1], float64, float64[::1]",
)
def cast_grid(
    field: Field,
    x0: float,
    y0: float,
    cos: float,
    sin: float,
    directions: FloatArray,
    reach: float,
    ranges: FloatArray,
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
        _start(lane, min(lane, begun - 1), x0, y0, cos, sin, directions, field, b, n)
    n[BEAM + begun : BEAM + LANES] = -1  # these cast the last one again, for nothing
    while ended < len(directions):
        _look(solid, squares, n)
        _go(reach, tiles, b, n)
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
                _start(lane, begun, x0, y0, cos, sin, directions, field, b, n)
                begun += 1


@njit(
    ahead="float64[:, ::1], float64, float64, float64, float64, float64[:, ::1], float64, float64, float64, "
    "float64[::1]",
)
def cast_circles(
    circles: FloatArray,
    radius: float,
    x0: float,
    y0: float,
    yaw: float,
    directions: FloatArray,
    angle_min: float,
    increment: float,
    reach: float,
    ranges: FloatArray,
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


@njit(
    ahead="float64[::1], float64[::1], float64, float64, float64[:, ::1], float64, float64, float64[::1]",
)
def finish_scan(
    ranges: FloatArray,
    noise: FloatArray,
    range_min: float,
    range_max: float,
    directions_base: FloatArray,
    mount_x: float,
    mount_y: float,
    box: FloatArray,
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
