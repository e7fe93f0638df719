"""A flat world for the navigator: an ideal robot, a laser scanner, walls that its map may lack."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import pytest

from harness.storage.shipped import shipped
from navstack.build import build_navigator
from navstack.costmap.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from navstack.localization.localizer import Localizer
from navstack.navigation_status import Status
from navstack.navigator import Navigator
from navstack.params.nav2_file.file import load_nav2
from navstack.types import Belief, Generators, LaserScan, Observation, Odometry, Pose2D, Twist2D

TICK = 1.0 / 60.0  # [s]
SCAN_PERIOD = 6  # [ticks]
BEAMS = 240
RANGE = 8.0  # [m]
RESOLUTION = 0.05  # [m]
# [m] of the shipped files, unpadded
FOOTPRINT = ((0.14, 0.25), (0.14, -0.25), (-0.607, -0.25), (-0.607, 0.25))

Solids = Callable[[float], np.ndarray]  # cells (height, width) that stop a beam at a time


class Knows(Localizer):
    """Believes what the test tells it."""

    pose = Pose2D()

    def reset(self, belief: Belief, rng: np.random.Generator) -> None:
        self.pose = belief.pose

    def update(self, observation: Observation) -> Belief:
        return Belief(self.pose, stamp=observation.stamp)


@dataclass
class Drive:
    """What a drive was like."""

    pose: Pose2D  # at its end
    seconds: float
    commands: list[Twist2D] = field(default_factory=list)  # one per tick
    poses: list[Pose2D] = field(default_factory=list)
    touched: bool = False  # whether the robot's outline met something solid at any tick


@pytest.fixture
def room() -> Callable[..., OccupancyGrid]:
    """Makes an empty room with walls; its lower left corner is the origin."""

    def _room(width: float = 16.0, height: float = 8.0) -> OccupancyGrid:
        cells = np.full(
            (round(height / RESOLUTION), round(width / RESOLUTION)), FREE, dtype=np.int8
        )
        cells[:2] = cells[-2:] = OCCUPIED
        cells[:, :2] = cells[:, -2:] = OCCUPIED
        return OccupancyGrid(cells, RESOLUTION, Pose2D())

    return _room


@pytest.fixture
def make() -> Callable[..., tuple[Navigator, Knows]]:
    """Builds the navigator of a shipped Nav2 file, with parameters changed, over a map."""

    def _make(grid: OccupancyGrid, name: str = "tuned", **changes) -> tuple[Navigator, Knows]:
        localizer = Knows()
        nav2 = load_nav2(shipped("params") / "nav2" / f"{name}.yaml")
        if changes:
            nav2 = nav2.with_values(
                {key.replace("__", "."): value for key, value in changes.items()}
            )
        return build_navigator(nav2, localizer, grid, None), localizer

    return _make


@pytest.fixture
def drive() -> Callable[..., Drive]:
    """Closes the loop over a robot that does at once as it is told."""
    return _drive


def _drive(
    navigator: Navigator,
    localizer: Knows,
    start: Pose2D,
    goal: Pose2D,
    seconds: float,
    solid: Solids | np.ndarray | None = None,
    goes_on: bool = False,  # after arrival
) -> Drive:
    navigator.reset(
        goal, Belief(start), Generators(*(np.random.default_rng(seed) for seed in range(3)))
    )
    pose = start
    twist = Twist2D()
    result = Drive(start, seconds)
    for k in range(round(seconds / TICK)):
        now = k * TICK
        cells = solid(now) if callable(solid) else solid
        scan = None
        if k % SCAN_PERIOD == 0:
            ranges = np.full(BEAMS, math.inf) if cells is None else cast(cells, pose)
            scan = LaserScan(now, ranges, -math.pi, 2.0 * math.pi / BEAMS, 0.05, 30.0)
        localizer.pose = pose
        twist = navigator.tick(Observation(now, odometry=Odometry(now, pose, twist), scan=scan))
        result.commands.append(twist)
        step = twist.linear_x * TICK
        yaw = pose.yaw + twist.angular_z * TICK
        pose = Pose2D(pose.x + step * math.cos(yaw), pose.y + step * math.sin(yaw), yaw)
        result.poses.append(pose)
        result.touched = result.touched or (cells is not None and _touches(cells, pose))
        if navigator.status is not Status.RUNNING and not goes_on:
            result.seconds = now
            break
    result.pose = pose
    return result


def cast(cells: np.ndarray, pose: Pose2D) -> np.ndarray:
    """Ranges (BEAMS,) of a scanner in the robot's origin among solid cells.

    Inf: nothing within reach.
    """
    angles = pose.yaw - math.pi + 2.0 * math.pi / BEAMS * np.arange(BEAMS)
    along = np.arange(0.1, RANGE, 0.5 * RESOLUTION)
    columns = (
        ((pose.x + np.cos(angles)[:, None] * along) / RESOLUTION)
        .astype(int)
        .clip(0, cells.shape[1] - 1)
    )
    rows = (
        ((pose.y + np.sin(angles)[:, None] * along) / RESOLUTION)
        .astype(int)
        .clip(0, cells.shape[0] - 1)
    )
    hits = cells[rows, columns]
    return np.where(hits.any(axis=1), along[hits.argmax(axis=1)], math.inf)


def _touches(cells: np.ndarray, pose: Pose2D) -> bool:
    """Whether a point of the outline lies in a solid cell."""
    corners = np.array(FOOTPRINT)
    t = np.linspace(0.0, 1.0, 12, endpoint=False)[:, None, None]
    outline = (corners * (1.0 - t) + np.roll(corners, -1, axis=0) * t).reshape(-1, 2)
    cos = math.cos(pose.yaw)
    sin = math.sin(pose.yaw)
    columns = ((pose.x + outline[:, 0] * cos - outline[:, 1] * sin) / RESOLUTION).astype(int)
    rows = ((pose.y + outline[:, 0] * sin + outline[:, 1] * cos) / RESOLUTION).astype(int)
    return bool(cells[rows.clip(0, cells.shape[0] - 1), columns.clip(0, cells.shape[1] - 1)].any())
