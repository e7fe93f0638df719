"""Where people walk, as the robot has seen it, and how much longer that makes ways.

A way is as much longer as people are met on it: a metre counts ``1 + flow_weight n`` metres. ``n``
is the mean of how many people per square metre were seen there and of how many are expected there.
Those who come towards the robot count more than those who walk along with it. So the robot goes
round a crowd before it stands in front of it.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy import ndimage

from navstack.control.contact_risk import rows_of
from navstack.control.expected_cost.clearance import Clearance, clearance_at
from navstack.control.expected_cost.field import CostToGoField, blend, corner_of
from navstack.costmap.costmap import INSCRIBED_INFLATED_OBSTACLE, Costmap
from navstack.jit import njit
from navstack.types import BoolMatrix, FloatArray, FloatMatrix, Pose2D, Track

_BLOCK = 4  # cells of the field along each side of one here
_SPREAD = 0.8  # [m] standard deviation of the normal distribution that each person is spread over
_SIGHT_STEP = 0.2  # [m] along a line of sight
_PRIOR = 5.0  # looks at every place at which there were as many people as on average
_COSTS = 62.5  # of a cell in which a metre counts one metre more: a free one is 50, a cost 0.8
_AHEAD = 5  # [s] for which people walk on straight
_LEAST_SLOPE = 1e-6  # of the field, below which it leads nowhere


class FlowGrid(NamedTuple):
    """What was seen of each cell; looks and people fade with time."""

    looks: FloatMatrix  # (height, width) looks at the cell
    met: FloatMatrix  # (height, width) people seen there, by the speed at which one meets them
    coming: FloatMatrix  # (height, width) the same of those who are there within _AHEAD
    origin_x: float  # [m]
    origin_y: float
    cell: float  # [m]


class PeopleFlow:
    """How many people a robot meets on every cell, from what it sees and saw."""

    def __init__(self, ways: Costmap, memory: float, reach: float, speed: float) -> None:
        """Know nobody.

        Args:
            ways: which it will lengthen.
            memory: [s] over which what was seen fades to 1/e.
            reach: [m] up to which the robot sees people.
            speed: [m/s] at which it meets them.
        """
        shape = (-(-ways.size_y // _BLOCK), -(-ways.size_x // _BLOCK))
        self._grid = FlowGrid(
            np.zeros(shape),
            np.zeros(shape),
            np.zeros(shape),
            ways.origin_x,
            ways.origin_y,
            _BLOCK * ways.resolution,
        )
        self._cells = _cells_of(ways)
        self._memory = memory
        self._reach = reach
        self._speed = speed
        self._stamp = -math.inf  # [s] of the last look

    def is_of(self, ways: Costmap) -> bool:
        """Whether a costmap has the cells of the ways."""
        return self._cells == _cells_of(ways)

    def look(
        self,
        tracks: Sequence[Track],
        pose: Pose2D,
        stamp: float,
        clearance: Clearance,
        field: CostToGoField,
    ) -> None:
        """Count who is where.

        Args:
            tracks: everybody who is seen.
            pose: of the robot, map frame.
            stamp: [s] of both, no earlier than that of the look before.
            clearance: what hides cells from the robot, and what people do not walk through.
            field: along whose descent the robot would meet people.
        """
        grid = self._grid
        kept = math.exp((self._stamp - stamp) / self._memory)
        self._stamp = stamp
        grid.looks[:] *= kept
        grid.met[:] *= kept
        grid.coming[:] = 0.0
        is_seen = mark_seen(grid, clearance, pose.x, pose.y, self._reach)
        count_people(grid, is_seen, clearance, field, rows_of(tracks, stamp), self._speed)

    def lengthen(self, ways: Costmap, weight: float) -> Costmap:
        """The ways, where a metre counts ``weight`` metres more per person and m2.

        Four metres more at most: a costmap has no dearer cells.
        """
        grid = self._grid
        everywhere = mean_rate(grid)
        seen = (_spread(grid, grid.met) + _PRIOR * everywhere) / (
            _spread(grid, grid.looks) + _PRIOR
        )
        expected = _spread(grid, grid.coming) / _AHEAD
        per_area = 0.5 * (seen + expected) / (grid.cell * grid.cell)
        dearest = INSCRIBED_INFLATED_OBSTACLE - 1
        dearer = np.rint(np.minimum(_COSTS * weight * per_area, dearest)).astype(np.uint16)
        of_cells = np.repeat(np.repeat(dearer, _BLOCK, axis=0), _BLOCK, axis=1)
        costs = np.minimum(ways.data + of_cells[: ways.size_y, : ways.size_x], dearest)
        is_open = ways.data < INSCRIBED_INFLATED_OBSTACLE
        data = np.where(is_open, costs.astype(np.uint8), ways.data)
        return Costmap(data, ways.resolution, ways.origin_x, ways.origin_y)


def _cells_of(ways: Costmap) -> tuple[tuple[int, ...], float, float, float]:
    return ways.data.shape, ways.resolution, ways.origin_x, ways.origin_y


def _spread(grid: FlowGrid, values: FloatArray) -> FloatArray:
    spread: FloatArray = ndimage.gaussian_filter(values, _SPREAD / grid.cell, truncate=3.0)
    return spread


@njit(ahead=True)
def mean_rate(grid: FlowGrid) -> float:
    """People met per look at a cell, on average over all that was seen; 0: nothing was."""
    looks = 0.0
    met = 0.0
    for row in range(grid.looks.shape[0]):
        for column in range(grid.looks.shape[1]):
            looks += grid.looks[row, column]
            met += grid.met[row, column]
    return met / looks if looks > 0.0 else 0.0


@njit(ahead=True)
def mark_seen(grid: FlowGrid, clearance: Clearance, x: float, y: float, reach: float) -> BoolMatrix:
    """Count a look at each cell within ``reach`` [m] of (x, y) [m] that nothing hides.

    Returns which these are (height, width).
    """
    beams = int(2.0 * math.pi * reach / grid.cell) + 1
    steps = int(reach / _SIGHT_STEP)
    is_seen = np.zeros(grid.looks.shape, dtype=np.bool_)
    for beam in range(beams):
        angle = 2.0 * math.pi * beam / beams
        for step in range(steps + 1):
            px = x + step * _SIGHT_STEP * math.cos(angle)
            py = y + step * _SIGHT_STEP * math.sin(angle)
            if clearance_at(clearance, px, py) < 0.0:
                break
            row, column = cell_of(grid, px, py)
            if row >= 0 and not is_seen[row, column]:
                is_seen[row, column] = True
                grid.looks[row, column] += 1.0
    return is_seen


@njit(ahead=True)
def count_people(
    grid: FlowGrid,
    is_seen: BoolMatrix,
    clearance: Clearance,
    field: CostToGoField,
    people: FloatMatrix,
    speed: float,
) -> None:
    """Count people (n, FIELDS) where they are, and where they are in each of the next seconds.

    Now they count in cells that are looked at (height, width), as only these count a look.
    They walk on straight until an obstacle. Each counts as the speed at which a robot meets them
    that follows the field at ``speed`` [m/s], over that speed (as in the kinetic theory of gases).
    """
    for person in people:
        vx = person[2]
        vy = person[3]
        for second in range(_AHEAD + 1):
            x = person[0] + second * vx
            y = person[1] + second * vy
            if second > 0 and clearance_at(clearance, x, y) < 0.0:
                break
            row, column = cell_of(grid, x, y)
            if row < 0:
                break
            rate = meeting_rate(field, x, y, vx, vy, speed)
            if second > 0:
                grid.coming[row, column] += rate
            elif is_seen[row, column]:
                grid.met[row, column] += rate


@njit(inline="always")
def cell_of(grid: FlowGrid, x: float, y: float) -> tuple[int, int]:
    """Row and column of a point [m] of the map frame; -1, -1 off the grid."""
    row = math.floor((y - grid.origin_y) / grid.cell)
    column = math.floor((x - grid.origin_x) / grid.cell)
    height, width = grid.looks.shape
    if 0 <= row < height and 0 <= column < width:
        return row, column
    return -1, -1


@njit()
def meeting_rate(
    field: CostToGoField, x: float, y: float, vx: float, vy: float, speed: float
) -> float:
    """How fast somebody at (x, y) [m] who walks at (vx, vy) [m/s] is met, over ``speed`` [m/s].

    0 walks along with the robot, 1 stands, more comes towards it.
    """
    row, column, up, right = corner_of(field.cost, field.origin_x, field.origin_y, field.cell, x, y)
    dx = blend(field.slope_x, row, column, up, right)
    dy = blend(field.slope_y, row, column, up, right)
    slope = math.hypot(dx, dy)
    if slope < _LEAST_SLOPE:
        return 1.0
    return math.hypot(speed * dx / slope - vx, speed * dy / slope - vy) / speed
