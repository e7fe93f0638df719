"""The obstacle layer as the list of its lethal cells: quick where little is occupied.

Equal to :class:`~navstack.costmap.layers.ObstacleLayer` but for what is lethal in the map anyway,
which is left out, and for unknown space, which a list of lethal cells cannot tell from free space.
"""

from collections.abc import Sequence

import numpy as np

from navstack.costmap import cell_kernels
from navstack.costmap.beam_kernels import LineArray
from navstack.costmap.cell_kernels import CellArray, Listed
from navstack.costmap.costmap import LETHAL_OBSTACLE, Box
from navstack.costmap.layers import clearing_observations, marking_observations
from navstack.costmap.observations import ObservationBuffer
from navstack.costmap.window import Window
from navstack.params.costmap import ObservationSourceParams, ObstacleLayerParams
from navstack.types import ByteArray, FloatArray, IntArray

# How far the centre of a line's cell can lie from the beam, in [cells]: half a diagonal for the
# cell of the sensor or of the end point, half a cell for the rounding across; a line from a least
# range on starts in a truncated cell.
_LATERAL = 1.5
_LATERAL_FROM_MIN_RANGE = 3.0
_NOTHING = (1 << 40, -(1 << 40), 1 << 40, -(1 << 40))  # an empty box
_NO_MAP: ByteArray = np.zeros((1, 1), dtype=np.uint8)


class ObstacleCells:
    """What the scans show to be occupied and the map does not, in cells of the window's lattice."""

    def __init__(
        self,
        params: ObstacleLayerParams,
        sources: Sequence[ObservationBuffer[ObservationSourceParams]],
        window: Window,
        background: ByteArray = _NO_MAP,
        margin: int = 0,
    ) -> None:
        """An empty layer.

        Args:
            params: of the layer.
            sources: what it sees.
            window: where it lies.
            background: costs of the map, the lattice cell (x, y) at [y + margin, x + margin]; cells
                that are lethal there are left out, for they make no difference: most of what a scan
                shows is on the map.
            margin: see ``background``.
        """
        self.params = params
        self.sources = sources
        self._background = background.view()
        self._background.flags.writeable = False  # one compiled kernel for all
        self._margin = margin
        # (x, y); the first ``count`` count
        self.cells: CellArray = np.empty((1024, 2), dtype=np.int32)
        self.count = 0
        self._box = window.box  # of the window that the cells lie in
        self._lines: LineArray = np.empty((512, 8), dtype=np.int32)
        self._present: ByteArray = np.zeros((window.size_y, window.size_x), dtype=np.uint8)
        self._changed: IntArray = np.array(_NOTHING, dtype=np.int64)
        self._columns: IntArray = np.empty((2, window.size_x), dtype=np.int64)

    def update(self, window: Window, footprint: FloatArray) -> None:
        """Clear along all beams, mark all returns, free the cells under the robot."""
        self._box = window.box
        self._clear_beams(window)
        self._mark(window)
        if self.params.footprint_clearing_enabled:
            place = (window.origin, window.resolution, self._columns, self._changed)
            self.count = cell_kernels.drop_polygon(self._listed, footprint, *place)
        else:
            self.count = cell_kernels.drop_doubted(self._listed, self._changed)

    def take_changed(self) -> Box | None:
        """The box of cells that came or went since the last call, if any did."""
        x0, xn, y0, yn = self._changed.tolist()
        if x0 >= xn:
            return None
        self._changed[:] = _NOTHING
        return x0, xn, y0, yn

    def clear(self) -> None:
        """Forget everything."""
        self._drop_outside(_NOTHING)

    def follow(self, window: Window) -> None:
        """Forget the cells that the window has left behind."""
        self._drop_outside(window.bounds)
        self._box = window.box

    def _drop_outside(self, box: Box) -> None:
        if self.count > 0:
            self.count = cell_kernels.drop_outside(self._listed, box, self._changed)

    @property
    def _listed(self) -> Listed:
        return Listed(self.cells, self.count, self._present, self._box)

    def as_grid(self, window: Window) -> ByteArray:
        """The layer's costs on the window's grid: lethal or free."""
        grid = np.zeros((window.size_y, window.size_x), dtype=np.uint8)
        x, y = self.cells[: self.count].T
        grid[y - window.cell_y, x - window.cell_x] = LETHAL_OBSTACLE
        return grid

    def _clear_beams(self, window: Window) -> None:
        spared = self.params.CELLS_SHORT * window.resolution
        for source, seen in clearing_observations(self.sources, spared):
            ordered, starts = seen.bearings
            if len(ordered) > len(self._lines):
                self._lines = np.empty((2 * len(ordered), 8), dtype=np.int32)
            lateral = _LATERAL
            if source.raytrace_min_range > 0.0:
                lateral = _LATERAL_FROM_MIN_RANGE
            cell_kernels.clear_hit(
                self._listed,
                ordered,
                starts,
                (seen.origin_x, seen.origin_y),
                window.origin,
                window.resolution,
                (source.raytrace_min_range, source.raytrace_max_range),
                lateral,
                self._lines,
            )

    def _mark(self, window: Window) -> None:
        for source, seen in marking_observations(self.sources):
            self._make_room(len(seen.marking))
            self.count = cell_kernels.mark_cells(
                self._listed,
                seen.marking,
                (seen.origin_x, seen.origin_y),
                window.origin,
                window.resolution,
                (source.obstacle_min_range, source.obstacle_max_range),
                self._background,
                self._margin,
                self._changed,
            )

    def _make_room(self, more: int) -> None:
        if self.count + more > len(self.cells):
            grown = np.empty((2 * (self.count + more), 2), dtype=np.int32)
            grown[: self.count] = self.cells[: self.count]
            self.cells = grown
