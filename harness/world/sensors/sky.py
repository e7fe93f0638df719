"""How much of the sky tall obstacles hide from a satellite antenna."""

import math
from collections.abc import Sequence

import numpy as np

from harness.world.map.scene import Obstacle
from harness.world.map.shapes import Rect, window_of
from navstack.jit import njit
from navstack.types import Float32Array, FloatArray

CELL = 0.5  # [m] of the heights
MOST_CELLS = 4_000_000  # beyond which they are coarser: 1 km x 1 km
ANTENNA = 1.0  # [m] height of the antenna above the ground
TALL = 3.0  # [m] height from which an obstacle counts
# elevation below which satellites are not used (u-blox F9: CFG-NAVSPG-INFIL_MINELEV, 10)
MASK = math.radians(10.0)
_AZIMUTHS = 36


class Sky:
    """What hides the sky: the tall obstacles of a scene, their heights on a grid.

    Satellites are taken as spread evenly over the sky above the mask. Of each azimuth the share
    (sin(horizon) - sin(mask)) / (1 - sin(mask)) is hidden: the solid angle below the highest
    obstacle, by that of all. The share is that at the middle of each cell, worked out when first
    asked for.
    """

    def __init__(self, obstacles: Sequence[Obstacle], area: Rect) -> None:
        """Raise the tall obstacles on a grid.

        Args:
            obstacles: of the scene.
            area: of its map; what stands outside hides nothing.
        """
        self._area = area
        self._cell = max(CELL, math.sqrt(area.width * area.depth / MOST_CELLS))
        shape = math.ceil(area.depth / self._cell), math.ceil(area.width / self._cell)
        self._heights = np.zeros(shape, dtype=np.float32)  # [m] above the antenna
        for obstacle in obstacles:
            if obstacle.height >= TALL:
                window, inside = window_of(obstacle.polygon, shape, self._cell, area.x0, area.y0)
                part = self._heights[window]
                part[inside] = np.maximum(part[inside], obstacle.height - ANTENNA)
        azimuths = 2.0 * np.pi * np.arange(_AZIMUTHS) / _AZIMUTHS
        self._directions = np.column_stack((np.cos(azimuths), np.sin(azimuths)))
        self._highest = float(self._heights.max(initial=0.0))
        self._known: dict[tuple[int, int], float] = {}

    def hidden(self, x: float, y: float) -> float:
        """The share [0, 1] of the sky that is hidden at a point of the map frame, [m]."""
        if self._highest == 0.0:
            return 0.0
        cell = (
            math.floor((x - self._area.x0) / self._cell),
            math.floor((y - self._area.y0) / self._cell),
        )
        share = self._known.get(cell)
        if share is None:
            middle = cell[0] + 0.5, cell[1] + 0.5
            share = float(
                hidden_share(
                    self._heights, *middle, self._directions, self._highest, self._cell, MASK
                )
            )
            self._known[cell] = share
        return share


@njit()
def hidden_share(
    heights: Float32Array,
    x: float,
    y: float,
    directions: FloatArray,
    highest: float,
    cell: float,
    mask: float,
) -> float:
    """The share of the sky above ``mask`` that heights hide, by rays in steps of one cell.

    Args:
        heights: (H, W) [m] above the antenna, 0 where nothing stands.
        x: antenna in [cells] from the grid's lower left corner.
        y: the same along y.
        directions: (n, 2) unit vectors of the azimuths.
        highest: [m] of all heights.
        cell: [m].
        mask: [rad] elevation below which nothing counts.

    Returns:
        0 under open sky, 1 where all of it is hidden.
    """
    rows, columns = heights.shape
    lowest = math.tan(mask)
    total = 0.0
    for i in range(len(directions)):
        slope, steps = lowest, 1
        while highest > slope * steps * cell:  # farther away nothing can stand higher
            column = math.floor(x + steps * directions[i, 0])
            row = math.floor(y + steps * directions[i, 1])
            if 0 <= row < rows and 0 <= column < columns:
                slope = max(slope, heights[row, column] / (steps * cell))
            steps += 1
        total += slope / math.sqrt(1.0 + slope * slope)
    floor = math.sin(mask)
    return max(0.0, (total / len(directions) - floor) / (1.0 - floor))
