"""Inflation: costs that fall with the distance from the nearest obstacle (nav2_costmap_2d's ``inflation_layer``).

The costs are those of Nav2 Jazzy: each cell takes the cost of its exact distance to the nearest source. Where Jazzy's
breadth-first search assigns a cell to a source that is not its nearest (rare, one cell in 3000 of a dense scene), this
module gives the nearest. Because cost never rises with distance, "cost of the nearest source" equals "highest of all
sources' costs", so a precomputed kernel is stamped with the maximum on each source: no distance field is needed.
Nav2 main looks costs up by a rounded distance; the parameter ``distance_steps`` does the same.
"""

import math
from dataclasses import dataclass

import numpy as np

from navstack.costmap import inflation_kernels, spread_kernels
from navstack.costmap.cell_kernels import CellArray
from navstack.costmap.costmap import INSCRIBED_INFLATED_OBSTACLE, LETHAL_OBSTACLE, NO_INFORMATION
from navstack.costmap.inflation_kernels import BLOCK, RUN
from navstack.costmap.spread_kernels import DistanceArray
from navstack.costmap.window import Box, Window
from navstack.errors import ParameterError
from navstack.params.costmap import InflationLayerParams
from navstack.types import ByteArray, IntArray

MOST_RADIUS = 500  # [cells] of an inflation; 25 m at 0.05 m/cell
HIGHEST_FALLING_COST = INSCRIBED_INFLATED_OBSTACLE - 1  # where the exponential begins, at the inscribed radius


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


@dataclass(frozen=True, slots=True, eq=False)
class InflationKernel:
    """The costs around one obstacle cell, and around patterns of neighbouring ones."""

    costs: ByteArray  # (2 radius + 1, 2 radius + 1) around one cell
    radius: int  # [cells]
    patterns: ByteArray  # (16, 2 radius + 1, w), see inflation_kernels.stamp


def make_kernel(params: InflationLayerParams, resolution: float, inscribed_radius: float) -> InflationKernel:
    """The costs within ``inflation_radius`` of a cell, for the *padded* footprint's ``inscribed_radius`` [m].

    Raises:
        ParameterError: the radius has more than ``MOST_RADIUS`` cells.
    """
    if params.inflation_radius > MOST_RADIUS * resolution:
        raise ParameterError(
            f"inflation_radius {params.inflation_radius:g} m: at {resolution:g} m/cell at most "
            f"{MOST_RADIUS * resolution:g} m are allowed"
        )
    radius = cell_distance(params.inflation_radius, resolution)
    side = 2 * radius + 1
    costs = np.zeros((side, side), dtype=np.uint8)
    for dy in range(-radius, radius + 1):
        for dx in range(-radius, radius + 1):
            distance = math.hypot(dx, dy)  # [cells]
            if distance <= radius:
                if params.distance_steps:
                    distance = math.floor(distance * params.distance_steps + 0.5) / params.distance_steps
                cost = inflation_cost(distance * resolution, inscribed_radius, params.cost_scaling_factor)
                costs[dy + radius, dx + radius] = cost
    return InflationKernel(costs, radius, _patterns(costs))


def _patterns(costs: ByteArray) -> ByteArray:
    """The highest costs of all patterns of cells in a row; rows are filled up with zeros to whole blocks."""
    side = len(costs)
    patterns = np.zeros((1 << RUN, side, -(-(side + RUN - 1) // BLOCK) * BLOCK), dtype=np.uint8)
    for pattern in range(1 << RUN):
        for j in range(RUN):
            if pattern >> j & 1:
                part = patterns[pattern, :, j : j + side]
                np.maximum(part, costs, out=part)
    return patterns


class Inflation:
    """The inflation layer: raises the costs around the lethal cells of a grid."""

    def __init__(self, params: InflationLayerParams, resolution: float, inscribed_radius: float) -> None:
        """See :func:`make_kernel` for the arguments."""
        self.params = params
        self.kernel = make_kernel(params, resolution, inscribed_radius)
        self._runs = np.empty((4096, 3), dtype=np.int32)

    def apply(self, costs: ByteArray, x0: int, xn: int, y0: int, yn: int) -> None:
        """Inflate in place within [y0:yn, x0:xn]; sources up to the radius outside count too."""
        kernel = self.kernel
        if kernel.radius == 0 or x0 >= xn or y0 >= yn:
            return
        height, width = costs.shape
        reach = kernel.radius
        count = self._find(
            costs, max(0, x0 - reach), min(width, xn + reach), max(0, y0 - reach), min(height, yn + reach)
        )
        if costs[y0:yn, x0:xn].max() != NO_INFORMATION:
            inflation_kernels.stamp(costs, self._runs, count, kernel.patterns, reach, x0, xn, y0, yn)
            return
        influence = np.zeros((yn - y0, xn - x0), dtype=np.uint8)
        relative = self._runs[:count] - np.array((x0, y0, 0), dtype=np.int32)
        inflation_kernels.stamp(influence, relative, count, kernel.patterns, reach, 0, xn - x0, 0, yn - y0)
        inflation_kernels.merge(costs, influence, x0, xn, y0, yn, self.params.inflate_unknown)

    def _find(self, costs: ByteArray, x0: int, xn: int, y0: int, yn: int) -> int:
        """Put the sources into the buffer, which grows with the need, and count them."""
        around_unknown = self.params.inflate_around_unknown
        count = int(inflation_kernels.find_sources(costs, x0, xn, y0, yn, around_unknown, self._runs))
        if count > len(self._runs):
            self._runs = np.empty((2 * count, 3), dtype=np.int32)
            count = int(inflation_kernels.find_sources(costs, x0, xn, y0, yn, around_unknown, self._runs))
        return count


class CellInflation:
    """Raises costs to an inflation kernel around each of some cells: quick where they are few and stand in lines."""

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
