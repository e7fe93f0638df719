"""Scans of boxes, from true poses."""

import math

import numpy as np

from navstack.costmap.occupancy_grid import OCCUPIED, OccupancyGrid
from navstack.geometry import compose
from navstack.types import LaserScan, Pose2D

BEAMS = 360
INCREMENT = 2.0 * math.pi / BEAMS
CELL = 0.05
HALF = 20.0  # [m] of the map's side
MOUNT = Pose2D(-0.23, 0.0, 0.0)
NOISE = 0.02  # [m] of a range
# x, y of two opposite corners [m]
SQUARE = (
    (-8.0, 6.0, 8.0, 7.0),
    (-8.0, -7.0, 8.0, -6.0),
    (8.0, -7.0, 9.0, 7.0),
    (3.0, 2.0, 4.0, 3.0),
)
CORRIDOR = ((-20.0, 2.0, 20.0, 3.0), (-20.0, -3.0, 20.0, -2.0))


def map_of(boxes) -> OccupancyGrid:
    """A map of boxes about the origin."""
    cells = round(2.0 * HALF / CELL)
    data = np.zeros((cells, cells), dtype=np.int8)
    for box in boxes:
        left, low, right, high = (round((each + HALF) / CELL) for each in box)
        data[low:high, left:right] = OCCUPIED
    return OccupancyGrid(data, CELL, Pose2D(-HALF, -HALF, 0.0))


def scan_of(boxes, base: Pose2D, rng=None, people=(), stamp: float = 0.0) -> LaserScan:
    """What a lidar sees of boxes and of people of 0.3 m radius, from a true pose."""
    sensor = compose(base, MOUNT)
    angles = sensor.yaw - math.pi + INCREMENT * np.arange(BEAMS)
    along, across = np.cos(angles), np.sin(angles)
    ranges = np.full(BEAMS, np.inf)
    for left, low, right, high in boxes:
        with np.errstate(divide="ignore", invalid="ignore"):
            x = np.sort((np.array(((left,), (right,))) - sensor.x) / along, axis=0)
            y = np.sort((np.array(((low,), (high,))) - sensor.y) / across, axis=0)
        enters, leaves = np.maximum(x[0], y[0]), np.minimum(x[1], y[1])
        is_hit = (enters < leaves) & (enters > 0.0)
        ranges = np.where(is_hit, np.minimum(ranges, enters), ranges)
    for px, py in people:
        ahead = (px - sensor.x) * along + (py - sensor.y) * across
        aside = (py - sensor.y) * along - (px - sensor.x) * across
        reach = ahead - np.sqrt(np.maximum(0.3**2 - aside**2, 0.0))
        is_hit = (np.abs(aside) < 0.3) & (ahead > 0.0)
        ranges = np.where(is_hit, np.minimum(ranges, reach), ranges)
    if rng is not None:
        ranges = ranges + NOISE * rng.standard_normal(BEAMS)
    return LaserScan(stamp, ranges, -math.pi, INCREMENT, 0.05, 30.0, MOUNT)
