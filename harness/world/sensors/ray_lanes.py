"""Rays on an occupancy grid, many at a time. Grid units are cells; row 0 is the lowest y."""

import math
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from navstack.jit import njit
from navstack.types import ByteArray, ByteVector, FloatArray, Uint16Vector

Field = tuple[int, int, int, Uint16Vector, ByteVector]  # of clearance_field
Index = TypeVar("Index", int, np.int32)  # vector instructions work on many of 32 bits

_BITS = 2  # a block's side is 2 ** _BITS cells, so that shifts find the block of a cell
TILE_BITS = 3  # and a tile's 2 ** TILE_BITS blocks
SIDE, TILE = 1 << _BITS, 1 << TILE_BITS
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
# block, its squares', beam; see look_ahead, advance
AT, SQUARES_AT, BEAM, BLOCKS, CELLS, STOPS = (LANES * i for i in range(6))
INTEGERS = 6 * LANES
_u, _i = np.uint64, np.int32  # unsigned indices spare the treatment of negative ones


@njit()
def place_of(row: Index, column: Index, tiles: int) -> Index:
    """Where a block stands in a table with ``tiles`` tiles per row."""
    tile = (row >> TILE_BITS) * tiles + (column >> TILE_BITS)
    return (tile << 2 * TILE_BITS) + ((row & (TILE - 1)) << TILE_BITS) + (column & (TILE - 1))


@njit()
def start_lane(
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
    tiles, solid = field[2], field[3]
    dx = cos * directions[beam, 0] - sin * directions[beam, 1]
    dy = sin * directions[beam, 0] + cos * directions[beam, 1]
    sign_x = -1.0 if dx < 0.0 else 1.0
    sign_y = -1.0 if dy < 0.0 else 1.0
    # the mirrored cell is -1 - cell
    b[SIGN_X + lane], b[SHIFT_X + lane] = sign_x, 0.5 * (sign_x - 1.0)
    b[SIGN_Y + lane], b[SHIFT_Y + lane] = sign_y, 0.5 * (sign_y - 1.0)
    column, row = math.floor(x0), math.floor(y0)
    b[COLUMN + lane] = column * sign_x + b[SHIFT_X + lane]
    b[ROW + lane] = row * sign_y + b[SHIFT_Y + lane]
    b[X + lane], b[Y + lane] = x0 * sign_x, y0 * sign_y
    b[DX + lane], b[DY + lane] = abs(dx), abs(dy)
    b[INVERSE_X + lane] = 1.0 / max(abs(dx), 1e-300)
    b[INVERSE_Y + lane] = 1.0 / max(abs(dy), 1e-300)
    b[LENGTH + lane] = 0.0
    n[BEAM + lane] = beam
    n[AT + lane] = place_of((row >> _BITS) + 1, (column >> _BITS) + 1, tiles)
    n[SQUARES_AT + lane] = ((dx < 0.0) + 2 * (dy < 0.0)) * len(solid)


@njit()
def look_ahead(solid: npt.NDArray[np.uint16], squares: ByteArray, n: npt.NDArray[np.int32]) -> None:
    """Read each lane's free square ahead, or the cells of its block where there is none.

    All at once, so that the processor waits for many places of memory at a time.
    """
    for i in range(LANES):
        n[BLOCKS + i] = squares[_u(n[SQUARES_AT + i] + n[AT + i])]
    for i in range(LANES):
        n[CELLS + i] = solid[_u(n[AT + i] if n[BLOCKS + i] == 0 else 0)]


@njit()
def advance(reach: float, tiles: int, b: FloatArray, n: npt.NDArray[np.int32]) -> None:
    """Take every ray out of the free square ahead of it, or into the next cell.

    Those in occupied cells or beyond ``reach`` stop. A ray through a corner passes the neighbour
    along x. Without branches, and with nothing that processors have no vector instructions for:
    cells are floats, places are int32.
    """
    for i in range(LANES):
        cx, cy = b[COLUMN + i], b[ROW + i]
        x, y, length = b[X + i], b[Y + i], b[LENGTH + i]
        sign_x, sign_y = b[SIGN_X + i], b[SIGN_Y + i]
        shift_x, shift_y = b[SHIFT_X + i], b[SHIFT_Y + i]
        blocks, cells = n[BLOCKS + i], n[CELLS + i]
        row_in_block = _i(cy * sign_y + shift_y) & (SIDE - 1)
        column_in_block = _i(cx * sign_x + shift_x) & (SIDE - 1)
        is_hit = (cells >> (SIDE * row_in_block + column_in_block)) & 1
        stops = (blocks == 0) & (is_hit != 0) | (length > reach)
        leap_x = (np.floor(cx / SIDE) + blocks) * SIDE
        leap_y = (np.floor(cy / SIDE) + blocks) * SIDE
        step_x, step_y = cx + 1.0, cy + 1.0
        end_x = leap_x if blocks > 0 else step_x
        end_y = leap_y if blocks > 0 else step_y
        to_x, to_y = (end_x - x) * b[INVERSE_X + i], (end_y - y) * b[INVERSE_Y + i]
        along_x = to_x <= to_y
        t = to_x if along_x else to_y
        # The cell across the border is known exactly; the other coordinate never goes back or
        # leaves the square.
        next_x, next_y = np.floor(x + t * b[DX + i]), np.floor(y + t * b[DY + i])
        last_x, last_y = end_x - 1.0, end_y - 1.0
        next_x = last_x if next_x > last_x else next_x
        next_y = last_y if next_y > last_y else next_y
        next_x = cx if next_x < cx else next_x
        next_y = cy if next_y < cy else next_y
        next_x = end_x if along_x else next_x
        next_y = next_y if along_x else end_y
        next_x = cx if stops else next_x
        next_y = cy if stops else next_y
        b[COLUMN + i], b[ROW + i] = next_x, next_y
        b[LENGTH + i] = length if stops else t
        column, row = _i(next_x * sign_x + shift_x), _i(next_y * sign_y + shift_y)
        n[AT + i] = place_of((row >> _BITS) + 1, (column >> _BITS) + 1, tiles)
        n[STOPS + i] = stops
