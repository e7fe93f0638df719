"""Where a costmap lies: whole cells of a fixed lattice (``Costmap2D::updateOrigin``)."""

import math
from collections.abc import Sequence

import numpy as np

from navstack.costmap.costmap import Box
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.errors import MapError
from navstack.params.costmap import MOST_CELLS, CostmapParams
from navstack.types import ByteArray, FloatArray, IntArray


class Window:
    """A grid of ``size_x`` x ``size_y`` cells on a lattice with a corner at (base_x, base_y)."""

    def __init__(
        self, base_x: float, base_y: float, resolution: float, size_x: int, size_y: int
    ) -> None:
        self.resolution = resolution  # [m/cell]
        self.size_x = size_x  # [cells]
        self.size_y = size_y  # [cells]
        self.base = (base_x, base_y)  # [m] the lattice's corner
        self.reset()

    def reset(self) -> None:
        """Go back to the lattice's corner."""
        # [m] lower left corner, summed up move by move as Nav2 does
        self.origin_x, self.origin_y = self.base
        self.cell_x = 0  # lattice x of the first cell
        self.cell_y = 0  # lattice y of the first cell
        self._refresh()

    def centre_on(self, x: float, y: float) -> tuple[int, int]:
        """Move so that (x, y) [m] is the centre, but for the part of a cell.

        Returns the cells moved.

        The number of cells is truncated towards zero, counted from where the window was.
        """
        dx = int((x - self.size_x * self.resolution / 2 - self.origin_x) / self.resolution)
        dy = int((y - self.size_y * self.resolution / 2 - self.origin_y) / self.resolution)
        self.origin_x += dx * self.resolution
        self.origin_y += dy * self.resolution
        self.cell_x += dx
        self.cell_y += dy
        if dx or dy:
            self._refresh()
        return dx, dy

    def _refresh(self) -> None:
        """What kernels take, made once per move."""
        x, y = self.cell_x, self.cell_y
        self.origin: FloatArray = np.array((self.origin_x, self.origin_y))  # lower left corner [m]
        # lattice x, y, width, height
        self.box: IntArray = np.array((x, y, self.size_x, self.size_y), dtype=np.int64)
        # lattice x0, xn, y0, yn; ends exclusive
        self.bounds = (x, x + self.size_x, y, y + self.size_y)

    def clamped_cell(self, x: float, y: float) -> tuple[int, int]:
        """The cell of a point, drawn onto the grid (``worldToMapEnforceBounds``).

        Takes infinite coordinates.
        """
        mx = self._clamp(x, self.origin_x, self.size_x)
        my = self._clamp(y, self.origin_y, self.size_y)
        return mx, my

    def _clamp(self, value: float, origin: float, size: int) -> int:
        if value < origin:
            return 0
        if value > self.resolution * size + origin:
            return size - 1
        return int((value - origin) / self.resolution)


def make_window(
    params: CostmapParams, static: OccupancyGrid | None, masks: Sequence[OccupancyGrid]
) -> Window:
    """A costmap's window: of a fixed one the map's grid, a rolling one lies on its lattice.

    Of map and masks a rolling one samples what it shows, so that their size does not matter.

    Raises:
        MapError: the costmap, or of a fixed one map or a mask, would have too many cells.
    """
    window = _window_of(params, static)
    cells = [window.size_x * window.size_y]
    grids = [*masks]
    if static is not None:
        grids.append(static)
    if params.rolling_window:
        grids = []
    for grid in grids:
        scale = grid.resolution / window.resolution
        cells.append(int(grid.width * scale) * int(grid.height * scale))
    if max(cells) > MOST_CELLS:
        raise MapError(
            f"a costmap of {window.resolution:g} m/cell would have {max(cells):,} cells here; "
            f"at most {MOST_CELLS:,} are allowed: check the resolutions of map, masks and costmap"
        )
    return window


def _window_of(params: CostmapParams, static: OccupancyGrid | None) -> Window:
    if static is not None and not params.rolling_window:
        return Window(
            static.origin.x, static.origin.y, static.resolution, static.width, static.height
        )
    size_x = int(params.width / params.resolution)
    size_y = int(params.height / params.resolution)
    if static is None:
        return Window(params.origin_x, params.origin_y, params.resolution, size_x, size_y)
    resolution = params.resolution
    if math.isclose(static.resolution, resolution, abs_tol=1e-5):
        resolution = static.resolution
    return Window(static.origin.x, static.origin.y, resolution, size_x, size_y)


def overlap(
    master: ByteArray, region: Box, grid: ByteArray, x: int, y: int
) -> tuple[ByteArray, ByteArray]:
    """Views of ``master`` within a region and of ``grid``, where both have cells.

    The region is x0, xn, y0, yn, ends exclusive. The grid's first cell lies on the master's cell
    (x, y).
    """
    x0, y0 = max(region[0], x), max(region[2], y)
    xn, yn = max(x0, min(region[1], x + grid.shape[1])), max(y0, min(region[3], y + grid.shape[0]))
    return master[y0:yn, x0:xn], grid[y0 - y : yn - y, x0 - x : xn - x]


def shift(grid: ByteArray, dx: int, dy: int, fill: int) -> None:
    """Move the content of a contiguous grid in place, as its window moves by (dx, dy) cells."""
    height, width = grid.shape
    if abs(dx) >= width or abs(dy) >= height:
        grid[:] = fill
        return
    cells, by = grid.view(), dy * width + dx
    cells.shape = (grid.size,)  # raises where only a copy would do
    if by > 0:
        cells[:-by] = cells[by:]
    elif by < 0:
        cells[-by:] = cells[:by].copy()  # towards the end in place takes seven times as long
    # what has come in; nothing where the distance is 0
    if dy > 0:
        grid[height - dy :] = fill
    else:
        grid[:-dy] = fill
    if dx > 0:
        grid[:, width - dx :] = fill
    else:
        grid[:, :-dx] = fill
