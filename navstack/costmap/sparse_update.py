"""The quick way to update a costmap without a map: obstacles by maximum and their inflation."""

from collections.abc import Sequence

import numpy as np

from navstack.costmap import spread_kernels
from navstack.costmap.cell_inflation import CellInflation
from navstack.costmap.cell_kernels import CellArray
from navstack.costmap.costmap import FREE_SPACE, Costmap
from navstack.costmap.inflation import Inflation
from navstack.costmap.layers import Bounds, InflationLayer
from navstack.costmap.obstacle_cells import ObstacleCells
from navstack.costmap.window import Window, shift
from navstack.types import ByteArray, FloatArray, Pose2D


class SparseUpdate:
    """Does with lists of lethal cells what :class:`~navstack.costmap.full_update.FullUpdate` does with grids.

    Within Nav2's bounds it writes what the obstacle layers know; what the bounds miss keeps its old cost there, too.

    Args:
        obstacles: the obstacle layers.
        inflation: the layer after them.
        master: the costmap to write.
        window: where it lies.
    """

    def __init__(
        self, obstacles: Sequence[ObstacleCells], inflation: Inflation, master: Costmap, window: Window
    ) -> None:
        self._obstacles = obstacles
        self._inflation_layer = InflationLayer(inflation)  # it knows how far the bounds reach
        self._inflation = CellInflation(inflation.kernel)
        self._master = master
        self._window = window
        self._shown: CellArray = np.empty((1024, 2), dtype=np.int32)  # the lethal cells of the master
        self._count = 0  # of these
        self._cleared = Bounds.empty()  # since the last update
        self.region = (0, 0, 0, 0)  # cells x0, xn, y0, yn of the last update

    def moved(self, dx: int, dy: int) -> None:
        """The window has moved by so many cells."""
        shift(self._master.data, dx, dy, FREE_SPACE)
        self._count = spread_kernels.keep_cells(self._shown, self._count, self._window.bounds, True)
        for obstacles in self._obstacles:
            obstacles.drop_outside(self._window)

    def update(self, pose: Pose2D, footprint: FloatArray) -> None:
        """Take in the newest observations; ``pose`` and padded ``footprint`` are the robot's in the map frame."""
        bounds, self._cleared = self._cleared, Bounds.empty()
        for obstacles in self._obstacles:
            obstacles.touch(self._window, footprint, bounds.values)
            obstacles.update(self._window, footprint)
        self._inflation_layer.update_bounds(self._window, pose, footprint, bounds)
        if bounds.values[0] > bounds.values[1]:
            return
        self.region = bounds.region(self._window)
        self._write(*self.region)

    def clear(self) -> None:
        """Forget all obstacles. The window may have been put anywhere."""
        for obstacles in self._obstacles:
            obstacles.clear()
        self._count = 0
        self._master.data.fill(FREE_SPACE)

    def clear_box(self, x0: int, xn: int, y0: int, yn: int) -> None:
        """Forget the obstacles in cells of the window (ends exclusive); the master shows it after the next update."""
        left, low, x0, y0 = self._window.cell_x, self._window.cell_y, max(x0, 0), max(y0, 0)
        for obstacles in self._obstacles:
            obstacles.drop_box((x0 + left, xn + left, y0 + low, yn + low))
        if self._obstacles:
            self._cleared.join(self._window.metric((x0, xn, y0, yn)))

    @property
    def obstacle_costs(self) -> list[ByteArray]:
        """The obstacle layers as grids."""
        return [obstacles.as_grid(self._window) for obstacles in self._obstacles]

    def _write(self, x0: int, xn: int, y0: int, yn: int) -> None:
        """Show what the obstacle layers know in cells of the window (ends exclusive)."""
        left, low = self._window.cell_x, self._window.cell_y
        box = (x0 + left, xn + left, y0 + low, yn + low)
        self._count = spread_kernels.keep_cells(self._shown, self._count, box, False)
        self._make_room(sum(obstacles.count for obstacles in self._obstacles))
        for obstacles in self._obstacles:
            self._count = spread_kernels.append_cells(self._shown, self._count, box, obstacles.cells, obstacles.count)
        self._master.data[y0:yn, x0:xn] = FREE_SPACE
        self._inflation.apply(self._master.data, self._window, self._shown, self._count, box)

    def _make_room(self, more: int) -> None:
        if self._count + more > len(self._shown):
            grown = np.empty((2 * (self._count + more), 2), dtype=np.int32)
            grown[: self._count] = self._shown[: self._count]
            self._shown = grown
