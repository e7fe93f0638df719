"""The quick way to update a costmap of the usual layers: map, keepout masks and obstacles by maximum, inflation.

The map is inflated once as a whole, with the masks that come before the inflation. An update copies what it needs of
that and stamps the inflation kernel on the few cells that only the scans know to be occupied. The result is that of
writing all layers over the whole costmap, hence equal to that of :mod:`~navstack.costmap.full_update` wherever the
latter's bounds reach.
"""

from collections.abc import Sequence

import numpy as np

from navstack.costmap import inflation_kernels
from navstack.costmap.costmap import Costmap
from navstack.costmap.inflation import InflationKernel
from navstack.costmap.obstacle_cells import ObstacleCells
from navstack.costmap.window import Window, copy_window
from navstack.types import ByteArray, FloatArray, IntArray, Pose2D


class FastUpdate:
    """Keeps the master equal to the inflated map with the obstacles' kernels stamped on.

    Args:
        obstacles: the obstacle layers.
        inflated: the inflated costs of the map (height, width), with ``margin`` more cells on each side.
        shown: the same, raised to the masks that come after the inflation.
        kernel: what to stamp.
        master: the costmap to write.
        window: where it lies; cell (0, 0) of its lattice is the map's first.
        rolling: the window moves; every update then writes all of it, otherwise only what changed.
        fill: cost of what lies beyond the map.
    """

    def __init__(
        self,
        obstacles: Sequence[ObstacleCells],
        inflated: ByteArray,
        shown: ByteArray,
        margin: int,
        kernel: InflationKernel,
        master: Costmap,
        window: Window,
        rolling: bool,
        fill: int,
    ) -> None:
        self._obstacles = obstacles
        self._inflated = inflated
        self._shown = shown
        self._margin = margin
        self._kernel = kernel
        self._master = master
        self._window = window
        self._rolling = rolling
        self._fill = fill
        if not rolling:
            self._restore(self._window.cells)

    def moved(self, dx: int, dy: int) -> None:
        """The window has moved by so many cells."""
        for obstacles in self._obstacles:
            obstacles.drop_outside(self._window)

    def update(self, pose: Pose2D, footprint: FloatArray) -> None:
        """Take in the newest observations; ``pose`` and padded ``footprint`` are the robot's in the map frame."""
        for obstacles in self._obstacles:
            obstacles.update(self._window, footprint)
        self._write()

    def clear(self) -> None:
        """Forget all obstacles; the map remains."""
        for obstacles in self._obstacles:
            obstacles.clear()
        self._write()

    def clear_box(self, x0: int, xn: int, y0: int, yn: int) -> None:
        """Forget the obstacles in cells of the window (ends exclusive)."""
        left, low = self._window.cell_x, self._window.cell_y
        for obstacles in self._obstacles:
            obstacles.drop_box(np.array((x0 + left, xn + left, y0 + low, yn + low), dtype=np.int64))
        self._write()

    @property
    def obstacle_costs(self) -> list[ByteArray]:
        """The obstacle layers as grids."""
        return [obstacles.as_grid(self._window) for obstacles in self._obstacles]

    def _write(self) -> None:
        """Write the window, or where it stands still the cells that a changed obstacle can reach."""
        changed = [obstacles.take_changed() for obstacles in self._obstacles]
        region = self._window.cells
        if not self._rolling:
            region = _around(changed, self._kernel.radius, region)
            if region[0] >= region[1] or region[2] >= region[3]:
                return
        self._restore(region)
        for obstacles in self._obstacles:
            self._stamp(obstacles, region)

    def _restore(self, region: IntArray) -> None:
        """Write the map as it is shown over lattice cells x0, xn, y0, yn of the master."""
        x0, xn, y0, yn = region.tolist()
        left, low = self._window.cell_x, self._window.cell_y
        target = self._master.data[y0 - low : yn - low, x0 - left : xn - left]
        copy_window(self._shown, x0 + self._margin, y0 + self._margin, target, self._fill)

    def _stamp(self, obstacles: ObstacleCells, region: IntArray) -> None:
        """Stamp the obstacles that reach into the region, within it."""
        radius, window = self._kernel.radius, self._window
        reach = region + (-radius, radius, -radius, radius)
        runs = obstacles.runs_to_stamp(window, self._inflated, self._margin, reach)
        x0, xn, y0, yn = region.tolist()
        inflation_kernels.stamp(
            self._master.data,
            runs,
            len(runs),
            self._kernel.patterns,
            radius,
            x0 - window.cell_x,
            xn - window.cell_x,
            y0 - window.cell_y,
            yn - window.cell_y,
        )


def _around(changed: Sequence[IntArray], radius: int, whole: IntArray) -> IntArray:
    """The box of all changed cells with ``radius`` cells around it, cut to ``whole``; empty if nothing changed."""
    boxes = np.array(changed)
    lower, upper = boxes[:, ::2].min(axis=0), boxes[:, 1::2].max(axis=0)
    if (lower >= upper).any():
        return np.zeros(4, dtype=np.int64)
    lower = np.maximum(lower - radius, whole[::2])
    upper = np.minimum(upper + radius, whole[1::2])
    return np.array((lower[0], upper[0], lower[1], upper[1]), dtype=np.int64)
