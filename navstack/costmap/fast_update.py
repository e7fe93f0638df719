"""The quick way to update a costmap of the usual layers.

Map, keepout masks and obstacles by maximum, inflation.

The map is inflated once as a whole, with the masks that come before the inflation. An update copies
what it needs of that and raises the costs around the few cells that only the scans know to be
occupied. The result is that of writing all layers over the whole costmap, hence equal to that of
:mod:`~navstack.costmap.full_update` wherever the latter's bounds reach.
"""

from collections.abc import Sequence

import numpy as np

from navstack.costmap import inflation_kernels
from navstack.costmap.costmap import Box, Costmap
from navstack.costmap.inflation import Inflation
from navstack.costmap.obstacle_cells import ObstacleCells
from navstack.costmap.window import Window
from navstack.types import ByteArray, FloatArray, IntArray, Pose2D

_LENGTH = 5  # of the array that a rolling window moves along, in windows
_MOST = 0.7  # of the window: if that much is to be written, all is


class FastUpdate:
    """Keeps the master equal to the inflated map with the obstacles inflated.

    The master of a rolling window is a part of a longer array. As the window moves, the part moves
    along it: what the window keeps stays where it is in memory, and the cells that come in take the
    places of those that go out.

    Args:
        obstacles: the obstacle layers.
        shown: the inflated costs of the map (height, width), raised to the masks that come after
            the inflation, with ``margin`` more cells on each side.
        inflation: of the obstacles.
        master: the costmap to write.
        window: where it lies; cell (0, 0) of its lattice is the map's first.
        rolling: the window moves.
        fill: cost of what lies beyond the map.
    """

    def __init__(
        self,
        obstacles: Sequence[ObstacleCells],
        shown: ByteArray,
        margin: int,
        inflation: Inflation,
        master: Costmap,
        window: Window,
        rolling: bool,
        fill: int,
    ) -> None:
        self.layers = obstacles
        self._shown = shown.view()
        self._shown.flags.writeable = False  # one compiled kernel for all
        self._margin = margin
        self._inflation = inflation
        self._master = master
        self._window = window
        self._rolling = rolling
        self._fill = fill
        self._entered: list[Box] = []  # what the window has moved over and nobody has written yet
        self._all_is_stale = True
        if rolling:
            self._strip: ByteArray = np.full(_LENGTH * master.data.size, fill, dtype=np.uint8)
            self._show_from(_LENGTH // 2 * master.data.size)
        else:
            self._write()

    def _show_from(self, start: int) -> None:
        """Let the master be the part of the strip from an index on."""
        size, shape = self._master.data.size, self._master.data.shape
        self._start = start
        self._master.data = self._strip[start : start + size].reshape(shape)

    def moved(self, dx: int, dy: int) -> None:
        """The window has moved by so many cells."""
        for obstacles in self.layers:
            obstacles.follow(self._window)
        window, size = self._window, self._master.data.size
        start = self._start + dy * window.size_x + dx
        is_elsewhere = abs(dx) >= window.size_x or abs(dy) >= window.size_y
        if is_elsewhere or not 0 <= start <= len(self._strip) - size:
            self._all_is_stale = True
            start = _LENGTH // 2 * size
        self._show_from(start)
        x0, xn, y0, yn = window.bounds
        if dx > 0:
            self._entered.append((xn - dx, xn, y0, yn))
        elif dx < 0:
            self._entered.append((x0, x0 - dx, y0, yn))
        if dy > 0:
            self._entered.append((x0, xn, yn - dy, yn))
        elif dy < 0:
            self._entered.append((x0, xn, y0, y0 - dy))

    def update(self, pose: Pose2D, footprint: FloatArray) -> None:
        """Take in the newest observations.

        ``pose`` and padded ``footprint`` are the robot's in the map frame.
        """
        for obstacles in self.layers:
            obstacles.update(self._window, footprint)
        self._write()

    def clear(self) -> None:
        """Forget all obstacles; the map remains. The window may have been put anywhere."""
        for obstacles in self.layers:
            obstacles.clear()
        self._all_is_stale = self._rolling
        self._write()

    @property
    def obstacle_costs(self) -> list[ByteArray]:
        """The obstacle layers as grids."""
        return [obstacles.as_grid(self._window) for obstacles in self.layers]

    def _write(self) -> None:
        """Write what came into the window and the cells that a changed obstacle can reach."""
        stale = self._take_stale()
        if not stale:
            return
        if sum((xn - x0) * (yn - y0) for x0, xn, y0, yn in stale) >= _MOST * self._master.data.size:
            stale = [self._window.bounds]
        boxes: IntArray = np.array(stale, dtype=np.int64)
        target, corner = self._master.data, (self._window.cell_x, self._window.cell_y)
        inflation_kernels.copy_boxes(
            self._shown, self._margin, self._fill, target, self._window.box, boxes
        )
        for obstacles in self.layers:
            if obstacles.count > 0:
                for part in stale:
                    self._inflation.spread(target, corner, obstacles.cells, obstacles.count, part)

    def _take_stale(self) -> list[Box]:
        """The boxes of lattice cells to write, which are then up to date."""
        stale, self._entered = self._entered, []
        for obstacles in self.layers:
            changed = obstacles.take_changed()
            if changed is not None:
                stale.append(_around(changed, self._inflation.radius, self._window.bounds))
        if self._all_is_stale:
            self._all_is_stale, stale = False, [self._window.bounds]
        return [box for box in stale if box[0] < box[1] and box[2] < box[3]]


def _around(changed: Box, radius: int, whole: Box) -> Box:
    """The box of all changed cells with ``radius`` cells around it, cut to ``whole``.

    It may be empty.
    """
    x0, xn, y0, yn = changed
    return (
        max(x0 - radius, whole[0]),
        min(xn + radius, whole[1]),
        max(y0 - radius, whole[2]),
        min(yn + radius, whole[3]),
    )
