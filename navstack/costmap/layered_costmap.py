"""A costmap made of layers: the map, what the scans show, and costs around both (nav2_costmap_2d).

Costmaps live in the map frame. In Nav2 the local one lives in the odom frame, which differs by the
localizer's correction; here a jump of the believed pose moves the window and leaves marked
obstacles where they were marked. The cells of a rolling window coincide with the map's cells, as if
both lattices were aligned.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from navstack.costmap import kernels
from navstack.costmap.costmap import NO_INFORMATION, Box, Costmap
from navstack.costmap.fast_update import FastUpdate
from navstack.costmap.field_cache import content_key, shared_array
from navstack.costmap.filters import FilterMask, KeepoutLayer, KeepoutMask, SpeedLimitReceiver
from navstack.costmap.full_update import FullUpdate
from navstack.costmap.inflation import Inflation
from navstack.costmap.lattice_costs import DenseCosts, SampledCosts
from navstack.costmap.layer_list import BoundLayer, FastParts, join_layers, with_world_mask
from navstack.costmap.layers import (
    DenoiseLayer,
    InflationLayer,
    Layer,
    ObstacleLayer,
    StaticLayer,
    cost_of_unknown,
    resampled,
    static_costs,
)
from navstack.costmap.observations import ObservationBuffer, PointObservation, ScanProjector, Source
from navstack.costmap.obstacle_cells import ObstacleCells
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.costmap.spatio_temporal import SpatioTemporalLayer
from navstack.costmap.window import make_window
from navstack.errors import MapError
from navstack.geometry import footprint_radii, pad_footprint
from navstack.params.costmap import (
    CostmapParams,
    DenoiseLayerParams,
    InflationLayerParams,
    ObstacleLayerParams,
    StaticLayerParams,
    robot_footprint,
)
from navstack.params.spatio_temporal import SpatioTemporalLayerParams
from navstack.types import BoolArray, ByteArray, FloatArray, LaserScan, Pose2D

_KEPT_MAPS = 4  # inflated maps that a process keeps: two costmaps on each of two maps
_inflated_maps: dict[str, ByteArray] = {}  # by content; read only


class LayeredCostmap:
    """A costmap that follows the scans.

    :attr:`master` is updated in place and stays the same object.
    """

    def __init__(
        self,
        params: CostmapParams,
        static: OccupancyGrid | None = None,
        keepout: BoolArray | None = None,
        masks: Mapping[str, FilterMask] | None = None,
        prefer_fast: bool = True,
    ) -> None:
        """Build the layers.

        Args:
            params: all parameters.
            static: the map of the static layer.
            keepout: cells of the map that the robot must not enter, (height, width): the mask of
                keepout filters that have none in ``masks``; where no keepout filter is listed, the
                static layer makes them lethal.
            masks: the masks of filters by their names.
            prefer_fast: False: use :class:`FullUpdate` even where the layers allow a quicker way.

        Raises:
            MapError: a static layer is wanted and no map given, the map is rotated, or the mask
                does not fit it.
        """
        self.params = params
        self.footprint = pad_footprint(robot_footprint(params), params.footprint_padding)
        # [m] of the padded one
        self.inscribed_radius, self.circumscribed_radius = footprint_radii(self.footprint)
        self._placed = np.empty_like(self.footprint)  # where the robot is at the update, map frame
        self.stamp = 0.0  # [s] of the last update
        # updated since it was last cleared, with scans as young as its sources expect
        self.is_current = False
        self._fill = cost_of_unknown(params)
        masks = masks or {}
        if params.has_keepout_filter:
            masks, keepout = with_world_mask(params, masks, static, keepout), None
        if not _lists_static_layer(params):
            static = None
        # a static layer that is disabled gives the size, too (``static_layer.cpp``, ``processMap``)
        self._window = make_window(params, static, [mask.grid for mask in masks.values()])
        self._is_of_map = static is not None and not params.rolling_window
        if not _has_static_layer(params):
            static = None
        self._layers = join_layers(params, masks, self._window)
        self._receivers: list[SpeedLimitReceiver] = []
        self._map = self._map_costs(static, keepout)
        window = self._window
        data: ByteArray = np.full((window.size_y, window.size_x), self._fill, dtype=np.uint8)
        self.master = Costmap(data, window.resolution, window.origin_x, window.origin_y)
        self._projector = ScanProjector()
        self._updater = self._make_updater(prefer_fast)
        self._sources = [source for layer in self._updater.layers for source in layer.sources]

    @property
    def is_fast(self) -> bool:
        """Whether the map is inflated once, see :mod:`~navstack.costmap.fast_update`."""
        return isinstance(self._updater, FastUpdate)

    @property
    def obstacle_costs(self) -> list[ByteArray]:
        """Each obstacle layer's own costs on the master's grid."""
        return self._updater.obstacle_costs

    @property
    def region(self) -> Box | None:
        """Cells x0, xn, y0, yn (ends exclusive) within which the last update wrote.

        None where it knows no bounds.
        """
        if isinstance(self._updater, FastUpdate):
            return None
        return self._updater.region

    def update(self, robot_pose: Pose2D, scan: LaserScan | None, stamp: float) -> None:
        """Take in a scan taken at ``robot_pose`` (map frame), and write the master anew.

        Without a new scan the previous one is applied again, as Nav2 does: obstacles stay where it
        saw them.
        """
        if scan is not None:
            self.observe_scan(robot_pose, scan)
        if self.params.rolling_window:
            moved = self._window.centre_on(robot_pose.x, robot_pose.y)
            if moved != (0, 0):
                self._updater.moved(*moved)
                self._place_master()
        self.stamp = stamp
        kernels.transform(self.footprint, robot_pose.x, robot_pose.y, robot_pose.yaw, self._placed)
        self._updater.update(robot_pose, self._placed)
        for speed_filter in self._layers.speed_filters:
            speed_filter.update(robot_pose, self._tell)
        self.is_current = all(source.is_current(stamp) for source in self._sources)

    def on_speed_limit(self, receiver: SpeedLimitReceiver) -> None:
        """Call ``receiver`` whenever the limit of a speed filter changes (topic speed_limit)."""
        self._receivers.append(receiver)

    def observe_scan(self, robot_pose: Pose2D, scan: LaserScan) -> None:
        """Keep a scan for the next update; every source of every layer is fed with it.

        A planar scan says nothing about heights: min_obstacle_height and max_obstacle_height do not
            apply to it.
        """
        projected: dict[bool, PointObservation] = {}
        for source in self._sources:
            inf_is_valid = source.params.inf_is_valid
            if inf_is_valid not in projected:
                projected[inf_is_valid] = self._projector.project(scan, robot_pose, inf_is_valid)
            source.add(projected[inf_is_valid])

    def observe_points(
        self, points: FloatArray, sensor_x: float, sensor_y: float, stamp: float
    ) -> None:
        """Keep points (n, 3) [m] of the map frame for the obstacle layers.

        Only those at their heights mark.
        """
        flat = np.ascontiguousarray(points[:, :2], dtype=np.float64)
        for layer in self._updater.layers:
            params = getattr(layer, "params", None)
            if not isinstance(params, ObstacleLayerParams):
                continue
            heights = points[:, 2]
            low, high = params.min_obstacle_height, params.max_obstacle_height
            marking = flat[(heights >= low) & (heights <= high)]
            for source in layer.sources:
                source.add(PointObservation(stamp, sensor_x, sensor_y, lambda: flat, marking))

    def clear_entirely(self) -> None:
        """Forget all obstacles; those that the newest scan shows come back with the next update."""
        self._updater.clear()
        self.is_current = False

    def reset(self) -> None:
        """Forget all obstacles and all scans, for a new episode."""
        for source in self._sources:
            source.clear()
        self._window.reset()
        self._place_master()
        self._updater.clear()
        for speed_filter in self._layers.speed_filters:
            speed_filter.reset(self._tell)
        self.stamp = 0.0
        self.is_current = False

    def _place_master(self) -> None:
        """Put the master where the window is."""
        self.master.origin_x = self._window.origin_x
        self.master.origin_y = self._window.origin_y

    def _tell(self, limit: float, is_percentage: bool) -> None:
        for receiver in self._receivers:
            receiver(limit, is_percentage)

    def _map_costs(
        self, static: OccupancyGrid | None, keepout: BoolArray | None
    ) -> DenseCosts | SampledCosts | None:
        if static is not None:
            costs = static_costs(static, self.params, keepout)
            return resampled(costs, static.resolution, self._window.resolution)
        if _has_static_layer(self.params):
            raise MapError(
                "the costmap has a static layer, but no map was given; give one or remove the layer"
            )
        return None

    def _make_updater(self, prefer_fast: bool) -> FastUpdate | FullUpdate:
        parts = self._fast_parts()
        if parts is None or not prefer_fast:
            return self._full_update()
        return self._fast_update(parts)

    def _fast_parts(self) -> FastParts | None:
        """What the quick way needs, if it leads to the same costmap.

        No unknown cells, no mask beyond the map, and a map that fits into memory.
        """
        parts = self._layers.fast_parts()
        if not isinstance(self._map, DenseCosts) or parts is None:
            return None
        may_have_unknown = self.params.track_unknown_space
        if self.params.rolling_window:
            height, width = self._map.costs.shape
            masks = (*parts.before, *parts.after)
            if may_have_unknown or not all(mask.acts_within(width, height) for mask in masks):
                return None
        elif may_have_unknown and int(self._map.costs.max()) == NO_INFORMATION:
            return None
        return parts

    def _inflation(self, params: InflationLayerParams) -> Inflation:
        resolution = self._window.resolution
        if self._is_of_map:
            # that of the map's message (nav_msgs/MapMetaData), in single precision
            resolution = float(np.float32(resolution))
        return Inflation(params, resolution, self.inscribed_radius)

    def _fast_update(self, parts: FastParts) -> FastUpdate:
        assert isinstance(self._map, DenseCosts)
        costs, inflation = self._map.costs, self._inflation(parts.inflation)
        margin = inflation.radius if self.params.rolling_window else 0
        inflated = inflated_map(_raised(costs, parts.before, 0), margin, self._fill, inflation)
        shown = _raised(inflated, parts.after, margin)
        if not self.params.rolling_window:
            self.master.floor = shown  # obstacles only ever raise it
        obstacles = [
            ObstacleCells(layer, _buffers(layer.active_sources), self._window, inflated, margin)
            for layer in self._layers.plugins
            if isinstance(layer, ObstacleLayerParams)
        ]
        return FastUpdate(
            obstacles,
            shown,
            margin,
            # another one: the buffers for the whole map are freed
            self._inflation(parts.inflation),
            self.master,
            self._window,
            self.params.rolling_window,
            self._fill,
        )

    def _full_update(self) -> FullUpdate:
        return FullUpdate(
            [self._make_layer(layer) for layer in self._layers.plugins],
            [self._make_layer(layer) for layer in self._layers.filters],
            self.master,
            self._window,
            self.params.rolling_window,
            self._fill,
        )

    def _make_layer(self, layer: BoundLayer) -> Layer:
        if isinstance(layer, ObstacleLayerParams):
            return ObstacleLayer(layer, _buffers(layer.active_sources), self._window, self._fill)
        if isinstance(layer, SpatioTemporalLayerParams):
            buffers = _buffers(layer.active_sources)
            return SpatioTemporalLayer(layer, buffers, self._window, lambda: self.stamp)
        if isinstance(layer, InflationLayerParams):
            return InflationLayer(self._inflation(layer))
        if isinstance(layer, DenoiseLayerParams):
            return DenoiseLayer(layer, unknown_is_obstacle=not self.params.track_unknown_space)
        if isinstance(layer, KeepoutMask):
            return KeepoutLayer(layer, self._window, self.params.rolling_window)
        assert self._map is not None
        return StaticLayer(self._map, self.params, self._window)


def _buffers(sources: Sequence[Source]) -> list[ObservationBuffer[Source]]:
    return [ObservationBuffer(source) for source in sources]


def _lists_static_layer(params: CostmapParams) -> bool:
    listed = (params.layers[name] for name in (*params.plugins, *params.filters))
    return any(isinstance(layer, StaticLayerParams) for layer in listed)


def _has_static_layer(params: CostmapParams) -> bool:
    layers = params.enabled_layers((*params.plugins, *params.filters)).values()
    return any(isinstance(layer, StaticLayerParams) for layer in layers)


def _raised(costs: ByteArray, masks: Sequence[KeepoutMask], margin: int) -> ByteArray:
    """Costs of the map, with ``margin`` more cells on each side, raised to the masks."""
    if not masks:
        return costs
    raised = costs.copy()
    for mask in masks:
        mask.raise_costs(raised, (0, costs.shape[1], 0, costs.shape[0]), -margin, -margin)
    return raised


def inflated_map(costs: ByteArray, margin: int, fill: int, inflation: Inflation) -> ByteArray:
    """A map's costs, inflated, with ``margin`` more cells of cost ``fill`` on each side.

    Kept for the next caller.
    """
    name, parts = "inflated-map-1", (costs, margin, fill, inflation.costs)
    key = content_key(name, *parts)

    def inflate() -> ByteArray:
        inflated = np.pad(costs, margin, constant_values=fill)
        inflation.apply(inflated, 0, inflated.shape[1], 0, inflated.shape[0])
        return inflated

    if key not in _inflated_maps:
        inflated = shared_array(costs.size, inflate, name, *parts)
        inflated.flags.writeable = False
        while len(_inflated_maps) >= _KEPT_MAPS:
            del _inflated_maps[next(iter(_inflated_maps))]
        _inflated_maps[key] = inflated
    return _inflated_maps[key]
