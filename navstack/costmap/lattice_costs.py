"""The costs of a map or mask on the cells of a costmap's lattice, however fine that is."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from navstack.costmap.costmap import Box
from navstack.params.costmap import MOST_CELLS
from navstack.types import ByteArray, IntArray

Part = tuple[ByteArray, int, int]  # costs, and the column and row of the grid where they begin


class LatticeCosts(Protocol):
    """Costs by lattice cells."""

    def part(self, region: Box, left: int, low: int) -> Part:
        """At least those within a region x0, xn, y0, yn of a grid's cells, ends exclusive.

        The grid's first cell is the lattice cell (left, low).
        """
        ...


@dataclass(frozen=True, slots=True, eq=False)
class DenseCosts:
    """The cost of each lattice cell."""

    costs: ByteArray
    x: int = 0  # lattice x and y of the first
    y: int = 0

    def part(self, region: Box, left: int, low: int) -> Part:
        """All of them."""
        return self.costs, self.x - left, self.y - low


@dataclass(frozen=True, slots=True, eq=False)
class SampledCosts:
    """The costs of coarser cells, of which a moving window samples those that it shows.

    As Nav2's static layer does it (``static_layer.cpp``, ``isRolling()``), for on a fine lattice
    there would be too many.
    """

    costs: ByteArray  # (height, width) of the coarser cells
    rows: IntArray  # of them, the one below each lattice cell along y
    columns: IntArray
    x: int = 0  # lattice x and y of the first
    y: int = 0

    def part(self, region: Box, left: int, low: int) -> Part:
        """Those within the region."""
        x, y = self.x - left, self.y - low
        x0, xn, y0, yn = region
        first_x, first_y = max(x0 - x, 0), max(y0 - y, 0)
        columns = self.columns[first_x : max(xn - x, 0)]
        rows = self.rows[first_y : max(yn - y, 0)]
        costs = np.ascontiguousarray(self.costs[rows[:, None], columns])
        return costs, x + first_x, y + first_y


def fits(rows: IntArray, columns: IntArray) -> bool:
    """Whether so many rows and columns of lattice cells may all be held in memory."""
    return rows.size * columns.size <= MOST_CELLS
