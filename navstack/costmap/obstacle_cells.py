"""The obstacle layer as the list of its lethal cells: quick where little is occupied.

Equal to :class:`~navstack.costmap.layers.ObstacleLayer` but for unknown space, which a list of lethal cells cannot tell
from free space.
"""

from collections.abc import Sequence

import numpy as np

from navstack.costmap import cell_kernels, inflation_kernels, kernels
from navstack.costmap.cell_kernels import CellArray
from navstack.costmap.costmap import LETHAL_OBSTACLE
from navstack.costmap.layers import each_observation
from navstack.costmap.observations import ObservationBuffer
from navstack.costmap.window import Window
from navstack.params.costmap import ObstacleLayerParams
from navstack.types import ByteArray, FloatArray, IntArray

# How far the centre of a line's cell can lie from the beam, in [cells]: half a diagonal for the cell of the sensor or
# of the end point, half a cell for the rounding across; a line from a least range on starts in a truncated cell.
_LATERAL = 1.5
_LATERAL_FROM_MIN_RANGE = 3.0
_NOTHING = (1 << 40, -(1 << 40), 1 << 40, -(1 << 40))  # an empty box x0, xn, y0, yn


class ObstacleCells:
    """What the scans show to be occupied, in cells of the window's lattice."""

    def __init__(self, params: ObstacleLayerParams, sources: Sequence[ObservationBuffer], window: Window) -> None:
        self._params = params
        self._sources = sources
        self.cells: CellArray = np.empty((1024, 2), dtype=np.int32)  # (x, y); the first ``count`` count
        self.count = 0
        self._runs: CellArray = np.empty((1024, 3), dtype=np.int32)
        self._present: ByteArray = np.zeros((window.size_y, window.size_x), dtype=np.uint8)
        self._changed: IntArray = np.array(_NOTHING, dtype=np.int64)
        self._lowest = np.empty(window.size_x, dtype=np.int64)
        self._highest = np.empty(window.size_x, dtype=np.int64)

    def update(self, window: Window, footprint: FloatArray) -> None:
        """Clear along all beams, mark all returns, free the cells under the robot."""
        self._clear_beams(window)
        self._mark(window)
        if self._params.footprint_clearing_enabled:
            self._free_footprint(window, footprint)

    def take_changed(self) -> IntArray:
        """The box x0, xn, y0, yn (ends exclusive) of cells that came or went since the last call."""
        changed, self._changed = self._changed, np.array(_NOTHING, dtype=np.int64)
        return changed

    def clear(self) -> None:
        """Forget everything."""
        self.drop_box(np.array((-(1 << 40), 1 << 40, -(1 << 40), 1 << 40), dtype=np.int64))

    def drop_box(self, box: IntArray) -> None:
        """Forget the cells in the box x0, xn, y0, yn (ends exclusive)."""
        self.count = cell_kernels.drop_box(self.cells, self.count, self._present, box, True, self._changed)

    def drop_outside(self, window: Window) -> None:
        """Forget the cells that the window has left behind."""
        self.count = cell_kernels.drop_box(self.cells, self.count, self._present, window.cells, False, self._changed)

    def runs_to_stamp(self, window: Window, background: ByteArray, margin: int, box: IntArray) -> CellArray:
        """The cells in the box x0, xn, y0, yn that ``background`` does not have; see ``inflation_kernels``."""
        if self.count > len(self._runs):
            self._runs = np.empty((len(self.cells), 3), dtype=np.int32)
        number = inflation_kernels.runs_to_stamp(
            self.cells, self.count, self._present, window.box, background, margin, box, self._runs
        )
        return self._runs[:number]

    def as_grid(self, window: Window) -> ByteArray:
        """The layer's costs on the window's grid: lethal or free."""
        grid = np.zeros((window.size_y, window.size_x), dtype=np.uint8)
        x, y = self.cells[: self.count].T
        grid[y - window.cell_y, x - window.cell_x] = LETHAL_OBSTACLE
        return grid

    def _clear_beams(self, window: Window) -> None:
        origin, resolution, box = window.origin, window.resolution, window.box
        for source, seen in each_observation(self._sources, clearing=True):
            limits = np.array((source.raytrace_min_range, source.raytrace_max_range))
            index = seen.bearings
            lines = cell_kernels.trace_rays(
                seen.points, index.order, seen.origin_x, seen.origin_y, origin, resolution, box, limits
            )
            sensor = np.array(
                (
                    (seen.origin_x - origin[0]) / resolution + window.cell_x,
                    (seen.origin_y - origin[1]) / resolution + window.cell_y,
                    (limits[0] + limits[1]) / resolution + 5.0,  # no cell of a line is farther away
                    _LATERAL if limits[0] == 0.0 else _LATERAL_FROM_MIN_RANGE,
                )
            )
            self.count = cell_kernels.drop_hit(
                self.cells, self.count, self._present, sensor, lines, index.starts, self._changed
            )

    def _mark(self, window: Window) -> None:
        for source, seen in each_observation(self._sources, clearing=False):
            self._make_room(len(seen.marking))
            self.count = cell_kernels.mark_cells(
                self.cells,
                self.count,
                self._present,
                seen.marking,
                seen.origin_x,
                seen.origin_y,
                window.origin,
                window.resolution,
                window.box,
                np.array((source.obstacle_min_range, source.obstacle_max_range)),
                self._changed,
            )

    def _free_footprint(self, window: Window, footprint: FloatArray) -> None:
        columns = kernels.polygon_columns(
            footprint, window.origin, window.resolution, window.size_x, window.size_y, self._lowest, self._highest
        )
        self.count = cell_kernels.drop_columns(
            self.cells, self.count, self._present, window.box, columns, self._lowest, self._highest, self._changed
        )

    def _make_room(self, more: int) -> None:
        if self.count + more > len(self.cells):
            grown = np.empty((2 * (self.count + more), 2), dtype=np.int32)
            grown[: self.count] = self.cells[: self.count]
            self.cells = grown
