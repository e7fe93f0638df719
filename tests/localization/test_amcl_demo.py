"""Global localization on real scans: MRPT's localization demo.

The map is drawn from scans at known poses; the robot starts anywhere in x -10..10 m, y -15..-5 m,
with any heading, and drives 13 m along a corridor. It has found itself when it ends within 0.5 (m
and rad together) of the known end.
"""

import os
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image, ImageDraw

from navstack.costmap.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from navstack.geometry import compose, normalize_angle
from navstack.localization.amcl import AmclLocalizer
from navstack.params.amcl import AmclParams
from navstack.types import Belief, LaserScan, Observation, Odometry, Pose2D, Twist2D

DATA = os.environ.get("NAVSTACK_DATA")
NEAR = 0.5  # [m and rad together] of the truth: it has found itself
RESOLUTION = 0.05  # [m/cell] of the demo's map
START = (-10.0, 10.0, -15.0, -5.0)  # [m] x and y between which the demo's robot starts
NO_RETURN = 80.0  # [m] from which on the demo's scanner has seen nothing
DEMO = AmclParams(
    **{f"alpha{i}": 0.05 for i in range(1, 5)},
    laser_max_range=NO_RETURN,
    min_particles=2000,
    max_particles=20_000,
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
        for i, (increment, ranges) in enumerate(
            zip(self._data["odom_increment"], self._data["ranges"], strict=True)
        ):
            pose = compose(pose, Pose2D(*increment))
            yield Observation(
                float(i), Odometry(float(i), pose, Twist2D()), scan=self._scan(float(i), ranges)
            )

    def _scan(self, stamp: float, ranges: np.ndarray) -> LaserScan:
        angles = self._data["angles"]
        increment = float(angles[1] - angles[0])
        return LaserScan(
            stamp,
            ranges.astype(float),
            float(angles[0]),
            increment,
            0.0,
            NO_RETURN,
            self._sensor,
        )

    def map(self) -> OccupancyGrid:
        """Occupied where beams ended, free where they passed, unknown elsewhere.

        Where the robot does not start is unknown, too.
        """
        scans = []
        for pose, ranges in zip(self._data["map_pose"], self._data["map_ranges"], strict=True):
            sensor, returned = compose(Pose2D(*pose), self._sensor), ranges < NO_RETURN
            angles = sensor.yaw + self._data["angles"][returned]
            directions = np.column_stack((np.cos(angles), np.sin(angles)))
            scans.append(
                (sensor.x, sensor.y) + np.vstack((np.zeros(2), ranges[returned, None] * directions))
            )
        hits = np.concatenate([scan[1:] for scan in scans])
        origin = hits.min(axis=0) - 1.0
        width, height = np.ceil((hits.max(axis=0) + 1.0 - origin) / RESOLUTION).astype(int)
        image = Image.new("1", (int(width), int(height)))
        for scan in scans:
            ImageDraw.Draw(image).polygon(
                [tuple(point) for point in (scan - origin) / RESOLUTION], fill=1
            )
        x, y = (origin[i] + RESOLUTION * np.arange(size) for i, size in enumerate((width, height)))
        starts = ((y > START[2]) & (y < START[3]))[:, None] & (x > START[0]) & (x < START[1])
        grid = np.where(np.array(image) & starts, np.int8(FREE), np.int8(UNKNOWN))
        # cells as AMCL takes them
        columns, rows = np.rint((hits - origin) / RESOLUTION).astype(int).T
        grid[rows, columns] = OCCUPIED
        return OccupancyGrid(grid, RESOLUTION, Pose2D(*origin))


def finds_itself(localizer: AmclLocalizer, demo: Demo, seed: int) -> bool:
    """Localize globally with a seed."""
    localizer.reset(Belief(Pose2D()), np.random.default_rng(seed))
    localizer.localize_globally()
    for observation in demo.observations():
        believed = localizer.update(observation).pose
    wrong = (
        believed.x - demo.end.x,
        believed.y - demo.end.y,
        normalize_angle(believed.yaw - demo.end.yaw),
    )
    return float(np.linalg.norm(wrong)) < NEAR


def localize_globally(data: Path, seeds: Iterable[int]) -> int:
    """With how many seeds AMCL finds itself in the demo's building."""
    demo = Demo(data)
    localizer = AmclLocalizer(DEMO, demo.map())
    return sum(finds_itself(localizer, demo, seed) for seed in seeds)


@pytest.mark.skipif(DATA is None, reason="NAVSTACK_DATA is unset: no real scans")
def test_it_finds_itself_in_a_real_building() -> None:
    assert localize_globally(Path(str(DATA)), range(100, 105)) == 5
