"""A costmap made of layers: the map, what the scans show, and costs around both (nav2_costmap_2d).

Costmaps live in the map frame. In Nav2 the local one lives in the odom frame, which differs by the localizer's
correction; here a jump of the believed pose moves the window and leaves marked obstacles where they were marked. The
cells of a rolling window coincide with the map's cells, as if both lattices were aligned.
"""

import math

import numpy as np

from navstack.costmap.costmap import FREE_SPACE, NO_INFORMATION, Costmap
from navstack.costmap.fast_update import FastUpdate
from navstack.costmap.field_cache import content_key
from navstack.costmap.full_update import FullUpdate
from navstack.costmap.inflation import Inflation
from navstack.costmap.layers import InflationLayer, Layer, ObstacleLayer, StaticLayer, resampled, static_costs
from navstack.costmap.observations import Observation, ObservationBuffer, ScanProjector
from navstack.costmap.obstacle_cells import ObstacleCells
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.costmap.window import Window
from navstack.errors import MapError
from navstack.geometry import footprint_radii, pad_footprint, transform_points
from navstack.params.costmap import (
    OVERWRITE,
    CostmapParams,
    InflationLayerParams,
    LayerParams,
    ObstacleLayerParams,
    StaticLayerParams,
    robot_footprint,
)
from navstack.types import BoolArray, ByteArray, FloatArray, LaserScan, Pose2D

MOST_CELLS = 400_000_000  # of a costmap, or of the map at its resolution; 1 km x 1 km at 0.05 m
_KEPT_MAPS = 4  # inflated maps that a process keeps: two costmaps on each of two maps
_inflated_maps: dict[str, ByteArray] = {}  # by content; read only


class LayeredCostmap:
    """A costmap that follows the scans; :attr:`master` is updated in place and stays the same object."""

    def __init__(
        self,
        params: CostmapParams,
        static: OccupancyGrid | None = None,
        footprint: FloatArray | None = None,
        keepout: BoolArray | None = None,
        prefer_fast: bool = True,
    ) -> None:
        """Build the layers.

        Args:
            params: all parameters.
            static: the map of the static layer.
            footprint: unpadded polygon (N, 2) [m], base frame; None: the one of ``params``.
            keepout: cells of the map that the static layer makes lethal, (height, width).
            prefer_fast: False: use :class:`FullUpdate` even where the layers allow :class:`FastUpdate`.

        Raises:
            MapError: a static layer is wanted and no map given, the map is rotated, or the mask does not fit it.
        """
        self.params = params
        self.footprint = pad_footprint(
            robot_footprint(params) if footprint is None else footprint, params.footprint_padding
        )
        self.inscribed_radius, self.circumscribed_radius = footprint_radii(self.footprint)  # [m] of the padded one
        self.stamp = 0.0  # [s] of the last update
        self.is_current = False  # updated since it was last cleared; before that it shows the map alone
        self._layers = params.ordered_layers
        self._fill = NO_INFORMATION if params.track_unknown_space else FREE_SPACE
        static = static if any(isinstance(layer, StaticLayerParams) for layer in self._layers) else None
        self._window = _make_window(params, static)
        _check_size(self._window, static)
        self._map = self._map_costs(static, keepout)
        data: ByteArray = np.full((self._window.size_y, self._window.size_x), self._fill, dtype=np.uint8)
        self.master = Costmap(data, self._window.resolution, self._window.origin_x, self._window.origin_y)
        self._buffers = [
            (layer, [ObservationBuffer(source) for source in layer.active_sources])
            for layer in self._layers
            if isinstance(layer, ObstacleLayerParams)
        ]
        self._projector = ScanProjector()
        self._updater: FastUpdate | FullUpdate = (
            self._fast_update() if prefer_fast and self._allows_fast() else self._full_update()
        )

    @property
    def is_fast(self) -> bool:
        """Whether the map is inflated once and for all (see :mod:`~navstack.costmap.fast_update`)."""
        return isinstance(self._updater, FastUpdate)

    @property
    def obstacle_costs(self) -> list[ByteArray]:
        """Each obstacle layer's own costs on the master's grid."""
        return self._updater.obstacle_costs

    def update(self, robot_pose: Pose2D, scan: LaserScan | None, stamp: float) -> None:
        """Take in a scan taken at ``robot_pose`` (map frame), if there is one, and write the master anew.

        Without a new scan the previous one is applied again, as Nav2 does: obstacles stay where it saw them.
        """
        if scan is not None:
            self.observe_scan(robot_pose, scan)
        if self.params.rolling_window:
            moved = self._window.centre_on(robot_pose.x, robot_pose.y)
            if moved != (0, 0):
                self._updater.moved(*moved)
                self.master.origin_x, self.master.origin_y = self._window.origin_x, self._window.origin_y
        self._updater.update(transform_points(robot_pose, self.footprint))
        self.stamp = stamp
        self.is_current = True

    def observe_scan(self, robot_pose: Pose2D, scan: LaserScan) -> None:
        """Keep a scan for the next update; every source of every obstacle layer is fed with it.

        A planar scan says nothing about heights: min_obstacle_height and max_obstacle_height do not apply to it.
        """
        projected: dict[bool, Observation] = {}
        for _, sources in self._buffers:
            for source in sources:
                inf_is_valid = source.params.inf_is_valid
                if inf_is_valid not in projected:
                    projected[inf_is_valid] = self._projector.project(scan, robot_pose, inf_is_valid)
                source.add(projected[inf_is_valid])

    def observe_points(self, points: FloatArray, sensor_x: float, sensor_y: float, stamp: float) -> None:
        """Keep points (n, 3) [m] of the map frame for the next update; only those at the layers' heights mark."""
        flat = np.ascontiguousarray(points[:, :2], dtype=np.float64)
        for layer, sources in self._buffers:
            is_right = (points[:, 2] >= layer.min_obstacle_height) & (points[:, 2] <= layer.max_obstacle_height)
            observation = Observation(stamp, flat, flat[is_right], sensor_x, sensor_y)
            for source in sources:
                source.add(observation)

    def clear_entirely(self) -> None:
        """Forget all obstacles; those that the newest scan shows come back with the next update."""
        self._updater.clear()
        self.is_current = False

    def clear_around(self, pose: Pose2D, distance: float) -> None:
        """Forget the obstacles in the square of side ``distance`` [m] around a pose (``ClearAroundRobot``)."""
        half, window = distance / 2.0, self._window
        x0 = int((pose.x - half - window.origin_x) / window.resolution)
        y0 = int((pose.y - half - window.origin_y) / window.resolution)
        xn = int((pose.x + half - window.origin_x) / window.resolution)
        yn = int((pose.y + half - window.origin_y) / window.resolution)
        self._updater.clear_box(x0 + 1, xn, y0 + 1, yn)

    def reset(self) -> None:
        """Forget all obstacles and all scans, for a new episode."""
        for _, sources in self._buffers:
            for source in sources:
                source.clear()
        self._window.reset()
        self.master.origin_x, self.master.origin_y = self._window.origin_x, self._window.origin_y
        self._updater.clear()
        self.stamp = 0.0
        self.is_current = False

    def _map_costs(self, static: OccupancyGrid | None, keepout: BoolArray | None) -> ByteArray | None:
        if static is None:
            if any(isinstance(layer, StaticLayerParams) for layer in self._layers):
                raise MapError("the costmap has a static layer, but no map was given; give one or remove the layer")
            return None
        return resampled(static_costs(static, self.params, keepout), static.resolution, self._window.resolution)

    def _allows_fast(self) -> bool:
        """Whether the layers are a map without unknown cells, then obstacles by maximum, then at most one inflation."""
        rest: list[LayerParams] = list(self._layers)
        if self._map is None or not isinstance(rest.pop(0), StaticLayerParams):
            return False
        if rest and isinstance(rest[-1], InflationLayerParams):
            rest.pop()
        if not all(isinstance(layer, ObstacleLayerParams) and layer.combination_method != OVERWRITE for layer in rest):
            return False
        if not self.params.track_unknown_space:
            return True
        return not self.params.rolling_window and int(self._map.max()) != NO_INFORMATION

    def _inflation(self, params: InflationLayerParams) -> Inflation:
        return Inflation(params, self._window.resolution, self.inscribed_radius)

    def _fast_update(self) -> FastUpdate:
        assert self._map is not None
        last = self._layers[-1]
        nothing = InflationLayerParams(inflation_radius=0.0)
        inflation = self._inflation(last if isinstance(last, InflationLayerParams) else nothing)
        margin = inflation.kernel.radius if self.params.rolling_window else 0
        obstacles = [ObstacleCells(layer, sources, self._window) for layer, sources in self._buffers]
        inflated = inflated_map(self._map, margin, self._fill, inflation)
        if inflated.shape == self.master.data.shape:
            self.master.floor = inflated  # obstacles only ever raise it
        return FastUpdate(
            obstacles,
            inflated,
            margin,
            inflation.kernel,
            self.master,
            self._window,
            self.params.rolling_window,
            self._fill,
        )

    def _full_update(self) -> FullUpdate:
        layers: list[Layer] = []
        buffers = iter(self._buffers)
        for params in self._layers:
            if isinstance(params, ObstacleLayerParams):
                layers.append(ObstacleLayer(params, next(buffers)[1], self._window, self._fill))
            elif isinstance(params, InflationLayerParams):
                layers.append(InflationLayer(self._inflation(params)))
            elif self._map is not None:
                layers.append(StaticLayer(self._map, self.params, self._window))
        return FullUpdate(layers, self.master, self._window, self.params.rolling_window, self._fill)


def inflated_map(costs: ByteArray, margin: int, fill: int, inflation: Inflation) -> ByteArray:
    """A map's costs, inflated, with ``margin`` more cells of cost ``fill`` on each side; kept for the next caller."""
    key = content_key("inflated-map-1", costs, margin, fill, inflation.kernel.costs)
    if key not in _inflated_maps:
        inflated = np.pad(costs, margin, constant_values=fill)
        inflation.apply(inflated, 0, inflated.shape[1], 0, inflated.shape[0])
        inflated.flags.writeable = False
        while len(_inflated_maps) >= _KEPT_MAPS:
            del _inflated_maps[next(iter(_inflated_maps))]
        _inflated_maps[key] = inflated
    return _inflated_maps[key]


def _check_size(window: Window, static: OccupancyGrid | None) -> None:
    cells = [window.size_x * window.size_y]
    if static is not None:
        scale = static.resolution / window.resolution
        cells.append(int(static.width * scale) * int(static.height * scale))
    if max(cells) > MOST_CELLS:
        raise MapError(
            f"a costmap of {window.resolution:g} m/cell would have {max(cells):,} cells here; at most {MOST_CELLS:,} "
            "are allowed: check the resolutions of map and costmap"
        )


def _make_window(params: CostmapParams, static: OccupancyGrid | None) -> Window:
    """Fixed costmaps with a map take over its grid; rolling ones lie on its lattice."""
    if static is not None and not params.rolling_window:
        return Window(static.origin.x, static.origin.y, static.resolution, static.width, static.height)
    resolution = params.resolution
    if static is not None and math.isclose(static.resolution, resolution, abs_tol=1e-5):
        resolution = static.resolution
    base_x, base_y = (params.origin_x, params.origin_y) if static is None else (static.origin.x, static.origin.y)
    size_x, size_y = round(params.width / params.resolution), round(params.height / params.resolution)
    return Window(base_x, base_y, resolution, size_x, size_y)
