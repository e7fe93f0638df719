"""Does AMCL find itself? On a real building's scans, and after it was carried away in our world.

Usage: python benchmarks/check_amcl.py demo|kidnapped [--seeds N]

``demo`` (needs NAVSTACK_DATA): MRPT's localization demo. The map is drawn from scans at known poses; the robot starts
anywhere in x -10..10 m, y -15..-5 m, with any heading, and drives 13 m along a corridor. It has found itself when it
ends within 0.5 m (and rad) of the known end.

``kidnapped``: in our world, AMCL localizes along a delivery driven by a robot that knows where it is. Part of the way
it is made to believe firmly in another pose, anywhere free on the map, as if somebody had carried it; recovery by
random particles is on. It has found itself when it ends within 0.5 m of the truth.
"""

import argparse
import dataclasses
import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from navstack.costmap.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from navstack.geometry import compose, normalize_angle
from navstack.localization.amcl import AmclLocalizer
from navstack.params.amcl import AmclParams
from navstack.types import Belief, LaserScan, Observation, Odometry, Pose2D, Twist2D

RESOLUTION = 0.05  # [m/cell] of the demo's map
START_X, START_Y = (-10.0, 10.0), (-15.0, -5.0)  # [m] of the demo
NEAR = 0.5  # [m, rad]
NO_RETURN = 80.0  # [m] from which on the demo's scanner has seen nothing
DEMO = AmclParams(
    alpha1=0.05,
    alpha2=0.05,
    alpha3=0.05,
    alpha4=0.05,
    laser_max_range=NO_RETURN,
    max_beams=60,
    min_particles=2000,
    max_particles=40_000,
    update_min_d=0.0,
    update_min_a=0.0,
)


class Demo:
    """The demo's data as observations, and its map."""

    def __init__(self, folder: Path) -> None:
        self._data = np.load(folder / "mrpt_localization" / "localization_demo.npz")
        self.end = Pose2D(*self._data["expected_final"])
        self._sensor = Pose2D(*self._data["sensor_pose"][:2], self._data["sensor_pose"][3])

    def observations(self) -> Iterator[Observation]:
        """Odometry and a scan for each increment, a second apart."""
        pose = Pose2D()
        for i, (increment, ranges) in enumerate(zip(self._data["odom_increment"], self._data["ranges"], strict=True)):
            pose = compose(pose, Pose2D(*increment))
            yield Observation(float(i), Odometry(float(i), pose, Twist2D()), scan=self._scan(float(i), ranges))

    def _scan(self, stamp: float, ranges: np.ndarray) -> LaserScan:
        angles = self._data["angles"]
        increment = float(angles[1] - angles[0])
        return LaserScan(stamp, ranges.astype(float), float(angles[0]), increment, 0.0, NO_RETURN, self._sensor)

    def map(self) -> OccupancyGrid:
        """Occupied where beams ended, free where they passed, unknown elsewhere and where the robot does not start."""
        sensors = [compose(Pose2D(*pose), self._sensor) for pose in self._data["map_pose"]]
        places, ends = [], []
        for sensor, ranges in zip(sensors, self._data["map_ranges"], strict=True):
            returned = ranges < NO_RETURN
            angles = sensor.yaw + self._data["angles"][returned]
            directions = np.column_stack((np.cos(angles), np.sin(angles)))
            ends.append((sensor.x, sensor.y) + ranges[returned, None] * directions)
            for share in np.arange(0.0, 1.0, 0.002):
                places.append((sensor.x, sensor.y) + share * ranges[returned, None] * directions)
        hits, passed = np.concatenate(ends), np.concatenate(places)
        origin = hits.min(axis=0) - 1.0
        width, height = np.ceil((hits.max(axis=0) + 1.0 - origin) / RESOLUTION).astype(int)
        grid = np.full((height, width), UNKNOWN, dtype=np.int8)
        inside = (passed[:, 0] > START_X[0]) & (passed[:, 0] < START_X[1])
        inside &= (passed[:, 1] > START_Y[0]) & (passed[:, 1] < START_Y[1])
        for points, value in ((passed[inside], FREE), (hits, OCCUPIED)):
            columns, rows = np.rint((points - origin) / RESOLUTION).astype(int).T  # cells as AMCL takes them
            grid[rows, columns] = value
        return OccupancyGrid(grid, RESOLUTION, Pose2D(*origin))


def finds_itself(localizer: AmclLocalizer, demo: Demo, seed: int) -> bool:
    """Localize globally with a seed."""
    localizer.reset(Belief(Pose2D()), np.random.default_rng(seed))
    localizer.localize_globally()
    for observation in demo.observations():
        believed = localizer.update(observation).pose
    wrong = (believed.x - demo.end.x, believed.y - demo.end.y, normalize_angle(believed.yaw - demo.end.yaw))
    return float(np.linalg.norm(wrong)) < NEAR
