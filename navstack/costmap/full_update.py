"""The general way to update a costmap: any layers in any order, within Nav2's bounds."""

import numpy as np

from navstack.costmap.costmap import Costmap
from navstack.costmap.filters import KeepoutLayer
from navstack.costmap.layers import Bounds, InflationLayer, Layer, ObstacleLayer, StaticLayer
from navstack.costmap.window import Window, shift
from navstack.types import ByteArray, FloatArray, Pose2D


class FullUpdate:
    """Runs all layers over the cells that may have changed (``LayeredCostmap::updateMap``).

    The bounds are Nav2's, and so is what they miss: now and then a cell at their edge (beams are
    bounded by their end points, not by their cells) keeps its old cost until the bounds reach it.

    Where the map is inflated in a moving window, the layers work on a grid with a margin of one
    inflation radius, so that obstacles of the map just outside the window spread into it; in Nav2
    they do so only once they are inside.

    The layers of the list ``filters`` write into the master only, unseen by the others in later
    updates.
    """

    def __init__(
        self,
        layers: list[Layer],
        filters: list[Layer],
        master: Costmap,
        window: Window,
        rolling: bool,
        fill: int,
    ) -> None:
        self._layers = layers
        self._filters = filters
        self._master = master
        self._window = window
        self._fill = fill
        self._margin = 0
        if rolling:
            self._margin = _map_margin(layers)
        size = (window.size_y + 2 * self._margin, window.size_x + 2 * self._margin)
        self._work = master.data
        if self._margin > 0 or filters:
            self._work = np.full(size, fill, dtype=np.uint8)
        self.region = (0, 0, 0, 0)  # cells x0, xn, y0, yn of the last update

    @property
    def layers(self) -> list[Layer]:
        """All of them in their order, filters last."""
        return [*self._layers, *self._filters]

    def moved(self, dx: int, dy: int) -> None:
        """The window has moved by so many cells."""
        shift(self._master.data, dx, dy, self._fill)
        if self._work is not self._master.data:
            shift(self._work, dx, dy, self._fill)
        for layer in self.layers:
            layer.moved(dx, dy)

    def update(self, pose: Pose2D, footprint: FloatArray) -> None:
        """Take in the newest observations.

        ``pose`` and padded ``footprint`` are the robot's in the map frame.
        """
        bounds = Bounds.empty()
        for layer in self.layers:
            layer.update_bounds(self._window, pose, footprint, bounds)
        if bounds.values[0] > bounds.values[1]:
            return
        self.region = bounds.region(self._window)
        self._write(*self.region)

    def clear(self) -> None:
        """Forget all obstacles; the map remains."""
        for layer in self.layers:
            layer.clear()
        self._write(0, self._window.size_x, 0, self._window.size_y)

    @property
    def obstacle_costs(self) -> list[ByteArray]:
        """The grids of the obstacle layers."""
        return [layer.grid for layer in self.layers if isinstance(layer, ObstacleLayer)]

    def _write(self, x0: int, xn: int, y0: int, yn: int) -> None:
        margin = self._margin
        region = (x0, xn + 2 * margin, y0, yn + 2 * margin)
        self._work[region[2] : region[3], region[0] : region[1]] = self._fill
        for layer in self._layers:
            layer.update_costs(self._work, region, margin)
        if self._work is not self._master.data:
            shown = self._work[y0 + margin : yn + margin, x0 + margin : xn + margin]
            np.copyto(self._master.data[y0:yn, x0:xn], shown)
        for layer in self._filters:
            layer.update_costs(self._master.data, (x0, xn, y0, yn), 0)


def _map_margin(layers: list[Layer]) -> int:
    """Cells by which obstacles of maps and masks outside the window can matter.

    The radius of inflations after them.
    """
    margin, has_map = 0, False
    for layer in layers:
        has_map = has_map or isinstance(layer, StaticLayer | KeepoutLayer)
        if has_map and isinstance(layer, InflationLayer):
            margin = max(margin, layer.inflation.radius)
    return margin
