"""What the costmap filters of nav2_costmap_2d make of their masks.

Forbidden ground and speed limits.

Masks live in the map frame, as the costmaps here do; they may have any resolution and place.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from navstack.costmap import kernels
from navstack.costmap.costmap import FREE_SPACE, LETHAL_OBSTACLE, NO_INFORMATION, Box
from navstack.costmap.field_cache import shared_array
from navstack.costmap.lattice_costs import DenseCosts, LatticeCosts, Part, SampledCosts, fits
from navstack.costmap.layers import Bounds, Layer
from navstack.costmap.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from navstack.costmap.window import Window, overlap
from navstack.params.filters import KEEPOUT, SPEED_PERCENT, KeepoutFilterParams
from navstack.types import ByteArray, FloatArray, IntArray, Pose2D

NO_SPEED_LIMIT = 0.0

# limit [m/s, or % of the largest speed], whether it is in percent
SpeedLimitReceiver = Callable[[float, bool], None]


@dataclass(frozen=True, slots=True, eq=False)
class FilterMask:
    """A mask, and how a speed filter reads it (``nav2_msgs/CostmapFilterInfo``)."""

    grid: OccupancyGrid
    type: int = KEEPOUT  # see navstack.params.filters
    base: float = 0.0
    multiplier: float = 1.0


class KeepoutMask:
    """A keepout filter's mask as costs on the cells of a costmap's lattice."""

    def __init__(
        self, params: KeepoutFilterParams, mask: FilterMask, window: Window, rolling: bool
    ) -> None:
        """Give each cell the cost that the mask has at its centre.

        As in Nav2, one that is not ``rolling``, which has the mask's frame, gets none within half
        a cell of the mask from its left and its lower edge.

        Raises:
            MapError: the mask is rotated.
        """
        grid = mask.grid
        grid.require_unrotated("keepout mask")
        base_x, base_y = window.base
        self._grid = grid
        self.params = params
        left_out = 0.5 * grid.resolution
        if rolling:
            left_out = 0.0
        # lattice x and y of the first cell
        self.x, columns = _cells_below(
            base_x, window.resolution, grid.origin.x, grid.resolution, grid.width, left_out
        )
        self.y, rows = _cells_below(
            base_y, window.resolution, grid.origin.y, grid.resolution, grid.height, left_out
        )

        self._on_lattice: LatticeCosts
        if fits(rows, columns):
            self._on_lattice = DenseCosts(_costs_on(grid, rows, columns), self.x, self.y)
        else:
            self._on_lattice = SampledCosts(mask_costs(grid), rows, columns, self.x, self.y)
        self._shape = (rows.size, columns.size)

    def is_lethal_at(self, pose: Pose2D) -> bool:
        """Whether a pose is forbidden: only the highest occupancy costs 253 or more."""
        return self._grid.value_at(pose.x, pose.y) == OCCUPIED

    def raise_costs(self, costs: ByteArray, region: Box, left: int, low: int) -> None:
        """Raise costs to the mask's within a region x0, xn, y0, yn of their cells.

        The first lies at (left, low).

        Unknown cells take any known cost; unknown cells of the mask change nothing.
        """
        kernels.combine_maximum(costs, region, *self.part(region, left, low), False)

    def part(self, region: Box, left: int, low: int) -> Part:
        """See :class:`~navstack.costmap.lattice_costs.LatticeCosts`."""
        return self._on_lattice.part(region, left, low)

    def acts_within(self, width: int, height: int) -> bool:
        """Whether all its costs but zero lie on lattice cells 0 <= x < width, 0 <= y < height."""
        own_height, own_width = self._shape
        is_inside_x = 0 <= self.x <= width - own_width
        is_inside_y = 0 <= self.y <= height - own_height
        if is_inside_x and is_inside_y:
            return True
        if not isinstance(self._on_lattice, DenseCosts):
            return False
        outside = self._on_lattice.costs.copy()
        left, low = max(-self.x, 0), max(-self.y, 0)
        outside[low : max(height - self.y, 0), left : max(width - self.x, 0)] = FREE_SPACE
        return bool(np.isin(outside, (FREE_SPACE, NO_INFORMATION)).all())


class KeepoutLayer(Layer):
    """The keepout filter (``keepout_filter.cpp``): costs of the mask that are higher win.

    The whole costmap is written when the mask is new, when a moving window shows new ground, and
    while a robot inside the mask's lethal zone is let out (Nav2 writes what comes into its bounds
    by and by).
    """

    def __init__(self, mask: KeepoutMask, window: Window, rolling: bool) -> None:
        self._mask = mask
        self._window = window
        self._rolling = rolling
        self._is_new = True
        self._lets_out = False  # the robot is inside and may leave

    def update_bounds(
        self, window: Window, pose: Pose2D, footprint: FloatArray, bounds: Bounds
    ) -> None:
        """See whether the robot is inside, where that matters."""
        was_letting_out = self._lets_out
        self._lets_out = self._mask.params.override_lethal_cost and self._mask.is_lethal_at(pose)
        if self._is_new or self._rolling or was_letting_out or self._lets_out:
            bounds.hold_everything()
        self._is_new = False

    def update_costs(self, master: ByteArray, region: Box, margin: int) -> None:
        """Raise the master to the mask.

        What would be raised takes the override cost while the robot is let out.
        """
        left, low = self._window.cell_x - margin, self._window.cell_y - margin
        if not self._lets_out:
            self._mask.raise_costs(master, region, left, low)
            return
        target, own = overlap(master, region, *self._mask.part(region, left, low))
        is_raised = (own != NO_INFORMATION) & ((own > target) | (target == NO_INFORMATION))
        target[is_raised] = self._mask.params.lethal_override_cost

    def clear(self) -> None:
        """The robot may be elsewhere next time."""
        self._lets_out = False


class SpeedFilter:
    """The speed filter (``speed_filter.cpp``): a limit from the mask's value below the robot."""

    def __init__(self, mask: FilterMask) -> None:
        mask.grid.require_unrotated("speed mask")
        self._mask = mask
        self._is_percentage = mask.type == SPEED_PERCENT
        self._limit = NO_SPEED_LIMIT

    def update(self, pose: Pose2D, receiver: SpeedLimitReceiver) -> None:
        """Tell the receiver when the limit has changed.

        Beyond the mask and where it is unknown the last one holds.
        """
        limit = self._limit_at(pose)
        if limit is not None and limit != self._limit:
            self._limit = limit
            receiver(limit, self._is_percentage)

    def reset(self, receiver: SpeedLimitReceiver) -> None:
        """Take the limit back."""
        if self._limit != NO_SPEED_LIMIT:
            self._limit = NO_SPEED_LIMIT
            receiver(NO_SPEED_LIMIT, self._is_percentage)

    def _limit_at(self, pose: Pose2D) -> float | None:
        value = self._mask.grid.value_at(pose.x, pose.y)
        if value == UNKNOWN:
            return None
        limit = self._mask.base + self._mask.multiplier * value
        if value == FREE or limit < 0.0 or (self._is_percentage and limit > 100.0):
            return NO_SPEED_LIMIT
        return limit


def mask_costs(grid: OccupancyGrid) -> ByteArray:
    """The costs of a mask's cells: 0..100 become 0..254 (``CostmapFilter::getMaskCost``)."""
    table = np.full(256, NO_INFORMATION, dtype=np.uint8)  # by the occupancy's bit pattern
    table[: OCCUPIED + 1] = np.floor(np.arange(OCCUPIED + 1) * LETHAL_OBSTACLE / OCCUPIED + 0.5)
    costs: ByteArray = table[np.ascontiguousarray(grid.data).view(np.uint8)]
    return costs


def _costs_on(grid: OccupancyGrid, rows: IntArray, columns: IntArray) -> ByteArray:
    """The costs of a mask's cells below lattice cells, kept for the next caller."""

    def compute() -> ByteArray:
        return mask_costs(grid).take(rows, axis=0).take(columns, axis=1)

    return shared_array(grid.data.size, compute, "mask costs 1", grid.data, rows, columns)


def _cells_below(
    base: float,
    resolution: float,
    origin: float,
    mask_resolution: float,
    size: int,
    left_out: float,
) -> tuple[int, IntArray]:
    """The first lattice cell, along one axis, with its centre on the mask.

    The mask's cells below it and the next. Cells that end within ``left_out`` [m] of the mask's
    edge do not count.
    """
    begin = math.floor((origin + left_out - base) / resolution)
    end = math.ceil((origin + size * mask_resolution - base) / resolution)
    centres = base + (np.arange(begin, end) + 0.5) * resolution
    below = np.floor((centres - origin) / mask_resolution).astype(np.int64)
    is_inside = (below >= 0) & (below < size)
    return begin + int(is_inside.argmax()), below[is_inside]
