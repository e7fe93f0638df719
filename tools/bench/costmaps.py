"""Costmap updates and inflation."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from itertools import cycle
from typing import TypeVar

import numpy as np

from harness.storage.shipped import shipped
from navstack.costmap.costmap import FREE_SPACE, LETHAL_OBSTACLE
from navstack.costmap.inflation import Inflation
from navstack.costmap.layered_costmap import LayeredCostmap
from navstack.costmap.layers import static_costs
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.geometry import compose
from navstack.params.costmap import CostmapParams, InflationLayerParams, ObstacleLayerParams
from navstack.params.nav2_file.file import load_nav2
from navstack.params.nav2_file.views import read_costmap
from navstack.types import ByteArray, FloatArray, LaserScan, Pose2D
from tools.bench import twins
from tools.bench.component import Component, Prepared, require_agreement, shipped_map

LayerKind = TypeVar("LayerKind", ObstacleLayerParams, InflationLayerParams)

BEAMS = 360
REACH = 30.0  # [m] of the lidar
NOISE = 0.01  # [m] of its ranges
SENSOR = Pose2D(-0.2, 0.0, 0.0)  # in the base frame
START = Pose2D(-42.8, -8.8, 1.67)  # a crossing on the sidewalk map
# updates forwards, then back again; [m] between two of them, as at 3 m/s and 30 Hz
STEPS, STRIDE = 12, 0.1
# windows [cells]: with walls, of all of a map
WALLS, WHOLE = np.s_[1700:2180, 900:1380], np.s_[:, :]
PEOPLE = 6  # who stand about, within 8 m


@dataclass(frozen=True, slots=True)
class View:
    """What one update takes in."""

    pose: Pose2D  # of the robot
    scan: LaserScan

    @property
    def sensor(self) -> Pose2D:
        """Of the lidar."""
        return compose(self.pose, SENSOR)

    @property
    def points(self) -> FloatArray:
        """Where the beams end (n, 2) [m]; those without return just below the greatest range."""
        sensor = self.sensor
        angles = sensor.yaw + self.scan.angle_min + np.arange(BEAMS) * self.scan.angle_increment
        ranges = np.where(np.isinf(self.scan.ranges), REACH - 1e-4, self.scan.ranges)
        ends: FloatArray = (sensor.x, sensor.y) + ranges[:, None] * twins.unit(angles)
        return ends


def drive_by(grid: OccupancyGrid) -> list[View]:
    """Scans along a straight way on a map, past people who stand there."""
    angles = -np.pi + np.arange(BEAMS) * (2.0 * np.pi / BEAMS)
    rng = np.random.default_rng(0)
    people = (START.x, START.y) + rng.uniform(1.5, 8.0, (PEOPLE, 1)) * twins.unit(
        rng.uniform(-np.pi, np.pi, PEOPLE)
    )
    occupied = grid.data > 0
    for x, y in people:
        column, row = (
            int((x - grid.origin.x) / grid.resolution),
            int((y - grid.origin.y) / grid.resolution),
        )
        occupied[row - 6 : row + 7, column - 6 : column + 7] = True
    views = []
    for k in range(STEPS):
        pose = compose(START, Pose2D(STRIDE * k, 0.0, 0.0))
        sensor = compose(pose, SENSOR)
        x, y = (
            (sensor.x - grid.origin.x) / grid.resolution,
            (sensor.y - grid.origin.y) / grid.resolution,
        )
        ranges = (
            twins.cast(occupied, x, y, twins.unit(angles + sensor.yaw), REACH / grid.resolution)
            * grid.resolution
        )
        # else beams end on the borders of cells, where rounding decides
        ranges += rng.normal(scale=NOISE, size=BEAMS)
        views.append(
            View(pose, LaserScan(0.0, ranges, -np.pi, 2.0 * np.pi / BEAMS, 0.0, REACH, SENSOR))
        )
    return views + views[-2:0:-1]


@dataclass(slots=True)
class PlainCostmap:
    """The twin of a rolling costmap: an obstacle grid and, if there is a map, its cells.

    Inflated anew each time.
    """

    params: CostmapParams
    inscribed: float  # [m]
    map_costs: ByteArray | None
    map_origin: FloatArray  # (2,) [m]
    origin: FloatArray  # (2,) [m] of the window
    grid: ByteArray  # what the scans show

    def update(self, view: View, origin: tuple[float, float]) -> ByteArray:
        """Take in a scan, in a window with its corner at ``origin``."""
        resolution = self.params.resolution
        moved = np.rint((np.array(origin) - self.origin) / resolution).astype(int)
        self.grid = twins.shifted(self.grid, *moved)
        self.origin = np.array(origin)
        sensor = np.array((view.sensor.x, view.sensor.y))
        layer = _layer(self.params, ObstacleLayerParams)
        longest = layer.active_sources[0].raytrace_max_range
        twins.clear_and_mark(self.grid, self.origin, resolution, sensor, view.points, longest)
        inflation = _layer(self.params, InflationLayerParams)
        margin = (
            Inflation(inflation, resolution, self.inscribed).radius
            if self.map_costs is not None
            else 0
        )
        costs = np.maximum(np.pad(self.grid, margin), self._map(margin))
        given = (
            resolution,
            self.inscribed,
            inflation.inflation_radius,
            inflation.cost_scaling_factor,
        )
        whole = twins.inflate(costs, *given)
        return whole[margin : len(whole) - margin, margin : whole.shape[1] - margin]

    def _map(self, margin: int) -> ByteArray:
        """The map's costs in the window and around it; the window lies well within the map."""
        if self.map_costs is None:
            return np.zeros_like(self.grid)
        x, y = (
            np.rint((self.origin - self.map_origin) / self.params.resolution).astype(int) - margin
        )
        height, width = self.grid.shape
        return self.map_costs[y : y + height + 2 * margin, x : x + width + 2 * margin]


def _layer(params: CostmapParams, kind: type[LayerKind]) -> LayerKind:
    return next(layer for layer in params.layers.values() if isinstance(layer, kind))


def update(with_map: bool) -> Prepared:
    """A cycle of updates of the published local costmap, with or without the map in it."""
    grid = shipped_map("sidewalk_navmesh")
    params = read_costmap(load_nav2(shipped("params") / "nav2" / "gps_ekf.yaml"), "local_costmap")
    if not with_map:
        plugins = ("obstacle_layer", "inflation_layer")
        params = dataclasses.replace(
            params, plugins=plugins, layers={name: params.layers[name] for name in plugins}
        )
    costmap = LayeredCostmap(params, grid if with_map else None)
    origin = np.array((costmap.master.origin_x, costmap.master.origin_y))
    twin = PlainCostmap(
        params,
        costmap.inscribed_radius,
        static_costs(grid, params) if with_map else None,
        np.array((grid.origin.x, grid.origin.y)),
        origin,
        np.zeros_like(costmap.master.data),
    )
    views = drive_by(shipped_map("sidewalk"))
    origins = []
    for view in views:
        costmap.update(view.pose, view.scan, 0.0)
        origins.append((costmap.master.origin_x, costmap.master.origin_y))
        plain = twin.update(view, origins[-1])
        require_agreement("local costmap update", costmap.master.data, plain)
    coming, known = cycle(views), cycle(zip(views, origins, strict=True))

    def ours() -> None:
        view = next(coming)
        costmap.update(view.pose, view.scan, 0.0)

    return Prepared(ours, lambda: twin.update(*next(known)))


def inflation_of(
    name: str,
    window: tuple[slice, slice],
    radius: float,
    scaling: float,
    inscribed: float,
) -> Prepared:
    """The inflation of a window of a shipped map of 0.05 m, which is set back before each."""
    costs = np.ascontiguousarray(_lethal(name)[window])
    inflation = Inflation(
        InflationLayerParams(inflation_radius=radius, cost_scaling_factor=scaling), 0.05, inscribed
    )
    height, width = costs.shape
    inflated = np.empty_like(costs)

    def ours() -> None:
        np.copyto(inflated, costs)
        inflation.apply(inflated, 0, width, 0, height)

    twin = partial(twins.inflate, costs, 0.05, inscribed, radius, scaling)
    ours()
    require_agreement("inflation", inflated, twin())
    return Prepared(ours, twin)


def _lethal(name: str) -> ByteArray:
    return np.where(shipped_map(name).data > 0, LETHAL_OBSTACLE, FREE_SPACE).astype(np.uint8)


COMPONENTS: Sequence[Component] = (
    Component("local costmap update, 480 x 480", partial(update, False), 2.02, 0.1),
    Component("local costmap update with the map, 480 x 480", partial(update, True), 2.02, 0.1),
    # main's rule; Jazzy's took 3.20 and 869
    Component(
        "inflation, 480 x 480, 1.5 m",
        partial(inflation_of, "sidewalk", WALLS, 1.5, 3.0, 0.19),
        2.29,
    ),
    Component(
        "inflation, 4000 x 4000, 1 m",
        partial(inflation_of, "sidewalk_navmesh", WHOLE, 1.0, 0.3, 0.39),
        191.0,
    ),
)
