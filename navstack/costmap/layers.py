"""The layers of a costmap, each as nav2_costmap_2d has it.

What it knows, and how it writes it into the master.

An update has two passes over the layers in their order. In the first each takes in what is new and
grows the bounds of what may have changed; in the second each writes within them
(``LayeredCostmap::updateMap``).
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from navstack.costmap import kernels
from navstack.costmap.costmap import FREE_SPACE, LETHAL_OBSTACLE, NO_INFORMATION, Box
from navstack.costmap.denoise import remove_small_groups
from navstack.costmap.field_cache import shared_array
from navstack.costmap.inflation import Inflation
from navstack.costmap.lattice_costs import DenseCosts, LatticeCosts, SampledCosts, fits
from navstack.costmap.observations import ObservationBuffer, PointObservation, SourceParams
from navstack.costmap.occupancy_grid import UNKNOWN, OccupancyGrid
from navstack.costmap.window import Window, overlap, shift
from navstack.errors import MapError
from navstack.params.costmap import (
    OVERWRITE,
    CostmapParams,
    DenoiseLayerParams,
    ObservationSourceParams,
    ObstacleLayerParams,
)
from navstack.params.spatio_temporal import SpatioTemporalLayerParams
from navstack.types import BoolArray, ByteArray, FloatArray, Pose2D

ScanSources = Sequence[ObservationBuffer[ObservationSourceParams]]
ScanObservation = tuple[ObservationSourceParams, PointObservation]

SAME_RESOLUTION = 1e-5  # [m] closer resolutions are the same (StaticLayer's EPSILON)


def static_costs(
    grid: OccupancyGrid, params: CostmapParams, keepout: BoolArray | None = None
) -> ByteArray:
    """The costs of a map's cells (``StaticLayer::interpretValue``).

    Cells of ``keepout`` are lethal.

    Raises:
        MapError: the map is rotated, or ``keepout`` has another shape.
    """
    grid.require_unrotated("map")
    occupancy = np.arange(256, dtype=np.uint8).view(np.int8).astype(np.int64)  # of each bit pattern
    threshold = min(max(params.lethal_cost_threshold, 0), 100)
    table: ByteArray = np.full(256, FREE_SPACE, dtype=np.uint8)
    if not params.trinary_costmap:
        table[:] = np.minimum(np.abs(occupancy) / max(threshold, 1), 1.0) * LETHAL_OBSTACLE
    table[(occupancy >= threshold) | (occupancy < UNKNOWN)] = LETHAL_OBSTACLE
    table[occupancy == UNKNOWN] = cost_of_unknown(params)
    if keepout is not None and keepout.shape != grid.data.shape:
        raise MapError(
            f"the keepout mask has the shape {keepout.shape}, "
            f"the map {grid.data.shape}; they must be equal"
        )

    def compute() -> ByteArray:
        costs: ByteArray = table[np.ascontiguousarray(grid.data).view(np.uint8)]
        if keepout is not None:
            costs[keepout] = LETHAL_OBSTACLE
        return costs

    forbidden: Any = 0
    if keepout is not None:
        forbidden = np.packbits(keepout)
    return shared_array(grid.data.size, compute, "static costs 1", grid.data, table, forbidden)


def cost_of_unknown(params: CostmapParams | SpatioTemporalLayerParams) -> int:
    """The cost of cells of which nothing is known."""
    if params.track_unknown_space:
        return NO_INFORMATION
    return FREE_SPACE


def resampled(costs: ByteArray, resolution: float, wanted: float) -> DenseCosts | SampledCosts:
    """Costs on a lattice of another resolution with the same corner.

    Each cell takes the one below its centre.
    """
    if abs(resolution - wanted) < SAME_RESOLUTION:
        return DenseCosts(costs)
    below = []
    for size in costs.shape:
        centres = np.arange(math.ceil(size * resolution / wanted)) + 0.5
        below.append(np.minimum((centres * wanted / resolution).astype(int), size - 1))
    rows, columns = below
    if not fits(rows, columns):
        return SampledCosts(costs, rows, columns)
    return DenseCosts(np.ascontiguousarray(costs[rows[:, None], columns]))


@dataclass(slots=True)
class Bounds:
    """What may have changed, in [m]; empty at first."""

    values: FloatArray  # (4,) min x, max x, min y, max y

    @classmethod
    def empty(cls) -> "Bounds":
        """Bounds that hold nothing."""
        return cls(np.array((math.inf, -math.inf, math.inf, -math.inf)))

    def hold_everything(self) -> None:
        """Grow without limit."""
        self.values[:] = (-math.inf, math.inf, -math.inf, math.inf)

    def join(self, other: FloatArray) -> None:
        """Grow to hold other bounds."""
        self.values[::2] = np.minimum(self.values[::2], other[::2])
        self.values[1::2] = np.maximum(self.values[1::2], other[1::2])

    def region(self, window: Window) -> Box:
        """The window's cells x0, xn, y0, yn (ends exclusive) that the bounds hold."""
        x0, y0 = window.clamped_cell(self.values[0], self.values[2])
        xn, yn = window.clamped_cell(self.values[1], self.values[3])
        return x0, min(xn + 1, window.size_x), y0, min(yn + 1, window.size_y)


class Layer(ABC):
    """One layer."""

    sources: Sequence[ObservationBuffer[SourceParams]] = ()  # what it is fed with

    @abstractmethod
    def update_bounds(
        self, window: Window, pose: Pose2D, footprint: FloatArray, bounds: Bounds
    ) -> None:
        """Take in what is new.

        ``pose`` and ``footprint`` (N, 2) [m], padded, are the robot's in the map frame.
        """

    @abstractmethod
    def update_costs(self, master: ByteArray, region: Box, margin: int) -> None:
        """Write into ``master`` within the region x0, xn, y0, yn of its cells.

        The window begins at the master's cell (margin, margin): see
        :class:`~navstack.costmap.full_update.FullUpdate`.
        """

    def clear(self) -> None:  # noqa: B027 - most layers keep nothing
        """Forget what sensors saw; the whole costmap is written anew afterwards."""

    def moved(self, dx: int, dy: int) -> None:  # noqa: B027 - most layers keep nothing
        """The window has moved by so many cells."""


class StaticLayer(Layer):
    """The map (``static_layer.cpp``)."""

    def __init__(self, costs: LatticeCosts, params: CostmapParams, window: Window) -> None:
        self._costs = costs
        self._params = params
        self._window = window
        self._is_new = True

    def update_bounds(
        self, window: Window, pose: Pose2D, footprint: FloatArray, bounds: Bounds
    ) -> None:
        """Everything, whenever the window moves with the robot, otherwise at first."""
        if self._params.rolling_window or self._is_new:
            bounds.hold_everything()
        self._is_new = False

    def update_costs(self, master: ByteArray, region: Box, margin: int) -> None:
        """Overwrite all, unknown included, or with ``use_maximum`` raise.

        Nothing beyond the map's edges. The maximum of a window that moves is that of numbers: an
        unknown cell, 255, beats all costs.
        """
        left, low = self._window.cell_x - margin, self._window.cell_y - margin
        costs, x, y = self._costs.part(region, left, low)
        if self._params.use_maximum and not self._params.rolling_window:
            kernels.combine_maximum(master, region, costs, x, y, False)
            return
        shown, own = overlap(master, region, costs, x, y)
        if self._params.use_maximum:
            own = np.maximum(shown, own)
        np.copyto(shown, own)


class ObstacleLayer(Layer):
    """What the scans show, on a dense grid (``obstacle_layer.cpp``)."""

    def __init__(
        self,
        params: ObstacleLayerParams | SpatioTemporalLayerParams,
        sources: ScanSources,
        window: Window,
        fill: int,
    ) -> None:
        self.params = params
        self.sources = self._scans = sources
        self._fill = fill  # cost of cells that were never seen
        self.grid: ByteArray = np.full((window.size_y, window.size_x), fill, dtype=np.uint8)
        self._lowest = np.empty(window.size_x, dtype=np.int64)
        self._highest = np.empty(window.size_x, dtype=np.int64)
        self._columns = (0, -1)  # of the footprint

    def moved(self, dx: int, dy: int) -> None:
        """Move the content with the window."""
        shift(self.grid, dx, dy, self._fill)

    def update_bounds(
        self, window: Window, pose: Pose2D, footprint: FloatArray, bounds: Bounds
    ) -> None:
        """Clear along all beams, then mark all returns."""
        assert isinstance(self.params, ObstacleLayerParams)
        spared = self.params.CELLS_SHORT * window.resolution
        for source, seen in clearing_observations(self._scans, spared):
            kernels.clear_rays(
                self.grid,
                seen.points,
                seen.origin_x,
                seen.origin_y,
                window.origin,
                window.resolution,
                (source.raytrace_min_range, source.raytrace_max_range),
                bounds.values,
            )
        for source, seen in marking_observations(self._scans):
            kernels.mark_points(
                self.grid,
                seen.marking,
                seen.origin_x,
                seen.origin_y,
                window.origin,
                window.resolution,
                (source.obstacle_min_range, source.obstacle_max_range),
                bounds.values,
            )
        self._place_footprint(window, footprint, bounds)

    def _place_footprint(self, window: Window, footprint: FloatArray, bounds: Bounds) -> None:
        """Note the cells under the robot, where they are to be freed."""
        if self.params.footprint_clearing_enabled:
            bounds.join(np.stack((footprint.min(axis=0), footprint.max(axis=0)), axis=1).ravel())
            self._columns = kernels.polygon_columns(
                footprint,
                window.origin,
                window.resolution,
                window.size_x,
                window.size_y,
                self._lowest,
                self._highest,
            )

    def update_costs(self, master: ByteArray, region: Box, margin: int) -> None:
        """Free the cells under the robot in this layer, then combine."""
        first, last = self._columns
        kernels.free_columns(self.grid, first, last, self._lowest, self._highest)
        if self.params.combination_method == OVERWRITE:
            target, own = overlap(master, region, self.grid, margin, margin)
            np.copyto(target, own, where=own != NO_INFORMATION)
        else:
            keep_unknown = self.params.combination_method != 1
            kernels.combine_maximum(master, region, self.grid, margin, margin, keep_unknown)

    def clear(self) -> None:
        """Forget all cells, those under the robot too: it may stand elsewhere by then."""
        self.grid[:] = self._fill
        self._columns = (0, -1)


class DenoiseLayer(Layer):
    """Frees small groups of obstacle cells that the layers before it wrote (``denoise_layer.cpp``).

    As in Nav2 a group counts with the cells that it has in the updated region. Where the map beyond
    a moving window is at hand (see :class:`~navstack.costmap.full_update.FullUpdate`), its cells
    there count too.
    """

    def __init__(self, params: DenoiseLayerParams, unknown_is_obstacle: bool) -> None:
        self._params = params
        self._unknown_is_obstacle = unknown_is_obstacle

    def update_bounds(
        self, window: Window, pose: Pose2D, footprint: FloatArray, bounds: Bounds
    ) -> None:
        """It touches only what others changed."""

    def update_costs(self, master: ByteArray, region: Box, margin: int) -> None:
        """Free the groups that are too small."""
        x0, xn, y0, yn = region
        remove_small_groups(
            master[y0:yn, x0:xn],
            self._params.minimal_group_size,
            self._params.group_connectivity_type,
            self._unknown_is_obstacle,
        )


class InflationLayer(Layer):
    """Costs around obstacles (``inflation_layer.cpp``)."""

    def __init__(self, inflation: Inflation) -> None:
        self.inflation = inflation
        self._previous = Bounds.empty()
        self._is_new = True

    def update_bounds(
        self, window: Window, pose: Pose2D, footprint: FloatArray, bounds: Bounds
    ) -> None:
        """The bounds of this and the previous update and an inflation radius around them.

        Everything at first.
        """
        current = bounds.values.copy()
        if self._is_new:
            bounds.hold_everything()
            self._is_new = False
        else:
            bounds.join(self._previous.values)
            radius = self.inflation.params.inflation_radius
            bounds.values += (-radius, radius, -radius, radius)
        self._previous = Bounds(current)

    def update_costs(self, master: ByteArray, region: Box, margin: int) -> None:
        """Inflate what the layers before have written."""
        self.inflation.apply(master, *region)


def clearing_observations(sources: ScanSources, spared: float) -> Iterator[ScanObservation]:
    """The observations of all sources that clear, their beams shorter by ``spared`` [m]."""
    for source in sources:
        if source.params.clearing:
            for observation in source.observations:
                if spared > 0.0:
                    observation = observation.shortened(spared)
                yield source.params, observation


def marking_observations(sources: ScanSources) -> Iterator[ScanObservation]:
    """The observations of all sources that mark."""
    for source in sources:
        if source.params.marking:
            for observation in source.observations:
                yield source.params, observation
