"""Inflation: costs that fall with the distance from the nearest obstacle (``inflation_layer.cpp``).

The costs are those of Nav2 Jazzy: each cell takes the cost of its exact distance to the nearest
source. Jazzy's breadth-first search may assign a cell to a source that is not its nearest (rare,
one cell in 3000 of a dense scene); this module always takes the nearest. Cost never rises with
distance, so that a cell takes the highest cost of all sources; of each column's sources only the
nearest one above or below counts (:mod:`~navstack.costmap.spread_kernels`). Nav2 main looks costs
up by a rounded distance; the parameter ``distance_steps`` does the same.
"""

import functools
import math

import numpy as np

from navstack.costmap import inflation_kernels, spread_kernels
from navstack.costmap.cell_kernels import CellArray
from navstack.costmap.costmap import (
    INSCRIBED_INFLATED_OBSTACLE,
    LETHAL_OBSTACLE,
    NO_INFORMATION,
    Box,
)
from navstack.costmap.inflation_kernels import BLOCK
from navstack.costmap.spread_kernels import DistanceArray
from navstack.errors import ParameterError
from navstack.params.costmap import InflationLayerParams
from navstack.types import ByteArray, IntArray

MOST_RADIUS = 500  # [cells] of an inflation; 25 m at 0.05 m/cell
CELLS_A_SOURCE = 64  # a map has fewer sources than one in so many cells, as a rule
# where the exponential begins, at the inscribed radius
HIGHEST_FALLING_COST = INSCRIBED_INFLATED_OBSTACLE - 1


def cell_distance(distance: float, resolution: float) -> int:
    """A distance in [m] as a whole number of cells, rounded up (``Costmap2D::cellDistance``)."""
    return max(0, math.ceil(distance / resolution))


def inflation_cost(distance: float, inscribed_radius: float, cost_scaling_factor: float) -> int:
    """The cost 0..254 at a ``distance`` [m] from an obstacle (``InflationLayer::computeCost``)."""
    if distance == 0.0:
        return LETHAL_OBSTACLE
    if distance <= inscribed_radius:
        return INSCRIBED_INFLATED_OBSTACLE
    factor = math.exp(-cost_scaling_factor * (distance - inscribed_radius))
    return int(HIGHEST_FALLING_COST * factor)


@functools.lru_cache(maxsize=16)
def cost_kernel(
    params: InflationLayerParams, resolution: float, inscribed_radius: float
) -> ByteArray:
    """The costs within ``inflation_radius`` of a cell.

    ``inscribed_radius`` [m] is that of the padded footprint.

    Returns:
        (2 radius + 1, 2 radius + 1) with the cell in the middle; read only.

    Raises:
        ParameterError: the radius has more than ``MOST_RADIUS`` cells.
    """
    radius = cell_distance(params.inflation_radius, resolution)
    if radius > MOST_RADIUS + 1:  # one that rounding adds
        raise ParameterError(
            f"inflation_radius {params.inflation_radius:g} m: at {resolution:g} m/cell at most "
            f"{MOST_RADIUS * resolution:g} m are allowed"
        )
    side = 2 * radius + 1
    costs = np.zeros((side, side), dtype=np.uint8)
    for dy in range(-radius, radius + 1):
        for dx in range(-radius, radius + 1):
            distance = math.hypot(dx, dy)  # [cells]
            if distance <= radius:
                if params.distance_steps:
                    distance = (
                        math.floor(distance * params.distance_steps + 0.5) / params.distance_steps
                    )
                cost = inflation_cost(
                    distance * resolution, inscribed_radius, params.cost_scaling_factor
                )
                costs[dy + radius, dx + radius] = cost
    costs.flags.writeable = False
    return costs


class Inflation:
    """The inflation layer: raises the costs around lethal cells of a grid or of a list."""

    def __init__(
        self, params: InflationLayerParams, resolution: float, inscribed_radius: float
    ) -> None:
        """See :func:`cost_kernel` for the arguments."""
        self.params = params
        self.costs = cost_kernel(params, resolution, inscribed_radius)
        self.radius = len(self.costs) // 2  # [cells]
        side = 2 * self.radius + 1
        distance = np.min_scalar_type(self.radius + 1)
        length = -(-side // BLOCK) * BLOCK
        self._around: DistanceArray = np.full(length, self.radius + 1, dtype=distance)
        self._around[:side] = np.abs(np.arange(-self.radius, self.radius + 1))
        self._profiles: ByteArray = np.zeros((self.radius + 1, side + 2 * BLOCK), dtype=np.uint8)
        self._profiles[:, BLOCK:-BLOCK] = self.costs[self.radius :]
        self._nearest: DistanceArray = np.empty(0, dtype=distance)
        self._ends: IntArray = np.empty((0, 2), dtype=np.int64)
        self._tile: ByteArray = np.empty(BLOCK * BLOCK, dtype=np.uint8)
        self._sources: CellArray = np.empty((4096, 2), dtype=np.int32)

    def apply(self, costs: ByteArray, x0: int, xn: int, y0: int, yn: int) -> None:
        """Inflate in place within [y0:yn, x0:xn]; sources up to the radius outside count too."""
        if self.radius == 0 or x0 >= xn or y0 >= yn:
            return
        height, width = costs.shape
        reach, box = self.radius, (x0, xn, y0, yn)
        count = self._find(
            costs,
            max(0, x0 - reach),
            min(width, xn + reach),
            max(0, y0 - reach),
            min(height, yn + reach),
        )
        if costs[y0:yn, x0:xn].max() != NO_INFORMATION:
            self.spread(costs, (0, 0), self._sources, count, box)
            return
        influence = np.zeros((yn - y0, xn - x0), dtype=np.uint8)
        self.spread(influence, (x0, y0), self._sources, count, box)
        inflation_kernels.merge(costs, influence, x0, xn, y0, yn, self.params.inflate_unknown)

    def spread(
        self, target: ByteArray, corner: tuple[int, int], cells: CellArray, count: int, box: Box
    ) -> None:
        """Raise ``target`` in a box around lattice cells (n, 2), which may lie outside.

        Args:
            target: (height, width) costs.
            corner: lattice x, y of its first cell.
            cells: lattice x, y.
            count: how many of them count.
            box: lattice x0, xn, y0, yn within the target, ends exclusive.
        """
        columns, height = box[1] - box[0] + 2 * self.radius, box[3] - box[2]
        if columns * height > self._nearest.size or columns > len(self._ends):
            self._nearest = np.empty(
                max(columns * height, self._nearest.size), dtype=self._nearest.dtype
            )
            self._ends = np.empty((max(columns, len(self._ends)), 2), dtype=np.int64)
        given = (box, self._nearest, self._ends)
        spread_kernels.measure_columns(cells, count, self._around, self.radius, *given)
        spread_kernels.spread(target, corner, self.radius, self._profiles, *given, self._tile)

    def _find(self, costs: ByteArray, x0: int, xn: int, y0: int, yn: int) -> int:
        """Put the sources into the buffer, which grows with the need, and count them."""
        find, around_unknown = inflation_kernels.find_sources, self.params.inflate_around_unknown
        likely = (xn - x0) * (yn - y0) // CELLS_A_SOURCE
        if likely > len(self._sources):
            self._sources = np.empty((likely, 2), dtype=np.int32)
        count = int(find(costs, x0, xn, y0, yn, around_unknown, self._sources))
        if count > len(self._sources):
            self._sources = np.empty((2 * count, 2), dtype=np.int32)
            count = int(find(costs, x0, xn, y0, yn, around_unknown, self._sources))
        return count
