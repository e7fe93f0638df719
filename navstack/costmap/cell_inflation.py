"""The inflation around listed cells, for the quick ways to update a costmap."""

import numpy as np

from navstack.costmap import spread_kernels
from navstack.costmap.cell_kernels import CellArray
from navstack.costmap.inflation import InflationKernel
from navstack.costmap.inflation_kernels import BLOCK
from navstack.costmap.spread_kernels import DistanceArray
from navstack.costmap.window import Box, Window
from navstack.types import ByteArray, IntArray


class CellInflation:
    """Raises costs to an inflation kernel around each of some cells."""

    def __init__(self, kernel: InflationKernel) -> None:
        self.radius = kernel.radius
        side = 2 * kernel.radius + 1
        distance = np.uint8 if kernel.radius < np.iinfo(np.uint8).max else np.uint16
        self._around: DistanceArray = np.full(-(-side // BLOCK) * BLOCK, kernel.radius + 1, dtype=distance)
        self._around[:side] = np.abs(np.arange(-kernel.radius, kernel.radius + 1))
        self._profiles: ByteArray = np.zeros((kernel.radius + 1, side + 2 * BLOCK), dtype=np.uint8)
        self._profiles[:, BLOCK:-BLOCK] = kernel.costs[kernel.radius :]
        self._nearest: DistanceArray = np.empty(0, dtype=distance)
        self._ends: IntArray = np.empty((0, 2), dtype=np.int64)
        self._tile: ByteArray = np.empty(BLOCK * BLOCK, dtype=np.uint8)

    def apply(self, target: ByteArray, window: Window, cells: CellArray, count: int, box: Box) -> None:
        """Raise the costs of a window in a box around the first ``count`` lattice cells (n, 2), which may lie outside.

        Args:
            target: (height, width) costs of the window.
            window: where it lies.
            cells: x, y.
            count: how many of them count.
            box: lattice x0, xn, y0, yn within the window, ends exclusive.
        """
        columns, height = box[1] - box[0] + 2 * self.radius, box[3] - box[2]
        if columns * height > self._nearest.size or columns > len(self._ends):
            self._nearest = np.empty(max(columns * height, self._nearest.size), dtype=self._nearest.dtype)
            self._ends = np.empty((max(columns, len(self._ends)), 2), dtype=np.int64)
        given = (box, self._nearest, self._ends)
        spread_kernels.measure_columns(cells, count, self._around, self.radius, *given)
        corner = (window.cell_x, window.cell_y)
        spread_kernels.spread(target, corner, self.radius, self._profiles, *given, self._tile)
