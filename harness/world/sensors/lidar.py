"""A planar lidar: rays on the occupancy grid of the geometry, people as circles."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from harness.world.map.scene import Obstacle
from harness.world.physics.body_state import BodyState
from harness.world.ranges import Latency, Rate
from harness.world.sensors.glass import Glass
from harness.world.sensors.lidar_kernels import (
    cast_circles,
    cast_grid,
    clearance_field,
    finish_scan,
)
from harness.world.sensors.sensor import Sensor
from navstack.costmap.occupancy_grid import SOLID_FROM, OccupancyGrid
from navstack.errors import ParameterError
from navstack.geometry import compose, relative_to
from navstack.ranges import NotNegative, Parameters, Share, up_to, within
from navstack.types import FloatArray, LaserScan, Pose2D

MAX_BEAMS = 20_000  # ten times the densest planar lidars
_FULL_TURN = 6.2832  # [rad] 2 pi as a file may write it


@dataclass(frozen=True, slots=True)
class SelfFilter:
    """A box in the base frame; points inside are taken for the robot and removed."""

    x_min: float  # [m]
    x_max: float  # [m]
    y_min: float  # [m]
    y_max: float  # [m]


@dataclass(frozen=True, slots=True)
class LidarParams(Parameters, whose="lidar"):
    """What a lidar measures and how well."""

    rate: Rate  # [Hz]
    beams: Annotated[
        int, within(1, MAX_BEAMS)
    ]  # evenly over field_of_view, the first at -field_of_view / 2
    field_of_view: Annotated[float, up_to(_FULL_TURN)]  # [rad] at most a full turn
    range_min: float  # [m]; nearer returns read inf
    range_max: float  # [m]; farther returns read inf
    noise_std: NotNegative  # [m] of one range, white
    mount: Pose2D  # of the sensor in the base frame
    self_filter: SelfFilter
    dropout: Share = 0.0  # [-] probability that a beam which meets something returns nothing
    # [-] probability that a beam which meets glass obliquely passes through
    glass_transmission: Share = 0.0
    # [rad] from the normal of a pane; nearer to it glass always returns
    glass_visible_angle: NotNegative = 0.0
    latency: Latency = 0.0  # [s] from measurement to delivery
    # false: beams go through them, as where a simulator's animated bodies have no surface
    sees_people: bool = True

    def _check_together(self) -> None:
        if not 0.0 <= self.range_min < self.range_max:
            raise ParameterError(
                f"lidar: range_min {self.range_min} m, range_max {self.range_max} m; "
                "allowed is 0 <= range_min < range_max"
            )
        box = self.self_filter
        if box.x_min > box.x_max or box.y_min > box.y_max:
            raise ParameterError(
                f"lidar: self_filter x {box.x_min} to {box.x_max} m, y {box.y_min} to "
                f"{box.y_max} m holds nothing; allowed is min <= max"
            )


class Lidar(Sensor[LaserScan]):
    """Casts scans. The robot itself is in no map, so it never sees itself.

    Simplifications: the whole scan is taken at one instant (no distortion by motion), every surface
    but glass reflects, and what the scan plane does not cut is not seen. A sensor outside the grid
    sees people only.
    """

    def __init__(
        self,
        params: LidarParams,
        geometry: OccupancyGrid,
        pedestrian_radius: float,
        obstacles: Sequence[Obstacle] = (),
    ) -> None:
        """Prepare the clearance field of ``geometry``.

        Args:
            params: of the sensor.
            geometry: what the lidar can hit: solid cells (occupancy 65 and more); unknown ones are
                transparent.
            pedestrian_radius: [m].
            obstacles: the glass among them is found in ``geometry``, should the lidar see through
                any.
        """
        self._params = params
        self._glass: Glass | None = None
        if params.glass_transmission:
            self._glass = Glass(geometry, obstacles)
        self._origin = geometry.origin
        self._resolution = geometry.resolution
        self._radius = pedestrian_radius
        occupied = geometry.data >= SOLID_FROM
        self._field = clearance_field(occupied)  # 0.03 s for 4000 x 4000 cells: not worth a file
        self._increment = params.field_of_view / params.beams
        self._angle_min = -0.5 * params.field_of_view
        angles = self._angle_min + self._increment * np.arange(params.beams)
        self._directions = np.column_stack((np.cos(angles), np.sin(angles)))
        in_base = angles + params.mount.yaw
        self._directions_base = np.column_stack((np.cos(in_base), np.sin(in_base)))
        box = params.self_filter
        self._box = np.array((box.x_min, box.x_max, box.y_min, box.y_max))

    def reset(self, body: BodyState, rng: np.random.Generator) -> None:
        """Start an episode whose noise comes from ``rng``."""
        self._dropout_rng, self._glass_rng = rng.spawn(2)
        self._rng = rng

    def measure(self, body: BodyState, pedestrians: FloatArray, stamp: float) -> LaserScan:
        """One scan with noise and filters."""
        params = self._params
        sensor = compose(Pose2D(body.x, body.y, body.yaw), params.mount)
        ranges = self._meet_geometry(sensor)
        if self._glass:
            self._glass.see_through(
                relative_to(self._origin, sensor),
                self._directions,
                ranges,
                self._glass_rng.random(params.beams),
                params.glass_transmission,
                params.glass_visible_angle,
                params.range_max,
            )
        if params.sees_people:
            self._meet_people(sensor, pedestrians, ranges)
        if params.dropout:
            ranges[self._dropout_rng.random(params.beams) < params.dropout] = math.inf
        finish_scan(
            ranges,
            self._rng.standard_normal(params.beams) * params.noise_std,
            params.range_min,
            params.range_max,
            self._directions_base,
            params.mount.x,
            params.mount.y,
            self._box,
        )
        return LaserScan(
            stamp,
            ranges,
            self._angle_min,
            self._increment,
            params.range_min,
            params.range_max,
            params.mount,
        )

    def exact_ranges(self, base: Pose2D, pedestrians: FloatArray) -> FloatArray:
        """Distances (n,) in [m] to what each beam meets first, without errors and filters.

        Inf where nothing is.

        Args:
            base: true pose of the robot, map frame.
            pedestrians: (n, >= 2) their x, y in the map frame, [m].
        """
        sensor = compose(base, self._params.mount)
        ranges = self._meet_geometry(sensor)
        self._meet_people(sensor, pedestrians, ranges)
        return ranges

    def _meet_geometry(self, sensor: Pose2D) -> FloatArray:
        """Distances (n,) in [m] to what stands still; glass is solid."""
        on_grid = relative_to(self._origin, sensor)
        scale, reach = 1.0 / self._resolution, self._params.range_max
        ranges = np.empty(self._params.beams)
        cos, sin = math.cos(on_grid.yaw), math.sin(on_grid.yaw)
        cast_grid(
            self._field,
            on_grid.x * scale,
            on_grid.y * scale,
            cos,
            sin,
            self._directions,
            reach * scale,
            ranges,
        )
        ranges *= self._resolution
        return ranges

    def _meet_people(self, sensor: Pose2D, pedestrians: FloatArray, ranges: FloatArray) -> None:
        """Shorten the beams that meet somebody, in place."""
        if len(pedestrians):
            cast_circles(
                pedestrians,
                self._radius,
                sensor.x,
                sensor.y,
                sensor.yaw,
                self._directions,
                self._angle_min,
                self._increment,
                self._params.range_max,
                ranges,
            )
