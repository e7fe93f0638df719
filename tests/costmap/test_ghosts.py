"""What somebody who walks through the scan leaves in the costmap: nothing, where beams clear.

Else what Nav2 leaves.
"""

import math

import numpy as np
import pytest

from navstack.costmap.layered_costmap import LayeredCostmap
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.params.costmap import (
    CostmapParams,
    InflationLayerParams,
    ObservationSourceParams,
    ObstacleLayerParams,
    StaticLayerParams,
)
from navstack.types import LaserScan, Pose2D

RESOLUTION = 0.05  # [m]
BEAMS = 1080
RADIUS = 0.3  # [m] of who walks
OBSTACLE_RANGE = 4.0  # [m]
STEP = 0.1  # [s]

Wall = tuple[tuple[float, float], tuple[float, float]]

OPEN: list[Wall] = []
# Somebody walks along y = 1.5 m.
BEHIND: list[Wall] = [((-18.0, 3.0), (18.0, 3.0))]
CLOSE: list[Wall] = [((-18.0, 1.85), (18.0, 1.85))]  # 5 cm beside the shoulder
# seen through a gap of 1.4 m
PASSAGE: list[Wall] = [*CLOSE, ((-18.0, 1.1), (-0.7, 1.1)), ((0.7, 1.1), (18.0, 1.1))]


def cast(robot: Pose2D, walls: list[Wall], person: tuple[float, float]) -> np.ndarray:
    """Ranges (BEAMS,) [m] of a lidar in the robot's origin; inf: the beam meets nothing."""
    angles = robot.yaw - math.pi + 2.0 * math.pi / BEAMS * np.arange(BEAMS)
    ux, uy = np.cos(angles), np.sin(angles)
    dx, dy = person[0] - robot.x, person[1] - robot.y
    along = dx * ux + dy * uy
    inside = RADIUS**2 - (dx**2 + dy**2 - along**2)
    ranges = np.where(
        (inside > 0.0) & (along > 0.0), along - np.sqrt(np.maximum(inside, 0.0)), math.inf
    )
    for (ax, ay), (bx, by) in walls:
        wx, wy = bx - ax, by - ay
        across = ux * wy - uy * wx
        with np.errstate(divide="ignore", invalid="ignore"):
            distance = ((ax - robot.x) * wy - (ay - robot.y) * wx) / across
            share = ((ax - robot.x) * uy - (ay - robot.y) * ux) / across
        meets = (distance > 0.0) & (share >= 0.0) & (share <= 1.0)
        ranges = np.where(meets, np.minimum(ranges, distance), ranges)
    return ranges


def walk_by(
    walls: list[Wall],
    rolling: bool,
    prefer_fast: bool,
    speed: float,
    **source: object,
) -> tuple[np.ndarray, np.ndarray]:
    """Centres (n, 2) [m] of cells on the walk that are marked.

    First while somebody passes, then when nobody is there any more. The robot looks on, at
    ``speed`` [m/s] along the walk. On the map there is nothing.
    """
    given = {
        "clearing": True,
        "obstacle_max_range": OBSTACLE_RANGE,
        "raytrace_max_range": 4.5,
        **source,
    }
    layers = {
        "static_layer": StaticLayerParams(),
        "obstacle_layer": ObstacleLayerParams(
            observation_sources=("scan",),
            sources={"scan": ObservationSourceParams(**given)},  # type: ignore[arg-type]
        ),
        "inflation_layer": InflationLayerParams(inflation_radius=0.5, cost_scaling_factor=3.0),
    }
    params = CostmapParams(
        width=10.0,
        height=10.0,
        resolution=RESOLUTION,
        robot_radius=0.2,
        rolling_window=rolling,
        plugins=tuple(layers),
        layers=layers,
    )
    static = OccupancyGrid(
        np.zeros((360, 480), dtype=np.int8), RESOLUTION, Pose2D(-12.01, -9.02, 0.0)
    )
    costmap = LayeredCostmap(params, static, prefer_fast=prefer_fast)
    during: set[tuple[float, float]] = set()
    for step in range(100):
        robot = Pose2D(speed * STEP * (step - 50), 0.0, 0.2)
        person = (-7.0 + 1.4 * STEP * step, 1.5)  # from beyond the obstacle range to beyond it
        scan = LaserScan(
            STEP * step,
            cast(robot, walls, person),
            -math.pi,
            2.0 * math.pi / BEAMS,
            0.05,
            20.0,
        )
        costmap.update(robot, scan, STEP * step)
        during.update(map(tuple, marked_on_walk(costmap, walls)))
    assert math.hypot(person[0] - robot.x, person[1] - robot.y) - RADIUS > OBSTACLE_RANGE
    return np.array(sorted(during)), marked_on_walk(costmap, walls)


def marked_on_walk(costmap: LayeredCostmap, walls: list[Wall]) -> np.ndarray:
    """Centres (n, 2) [m] of the marked cells where people walk; a wall's own cells do not count."""
    rows, columns = np.nonzero(costmap.obstacle_costs[0])
    x = costmap.master.origin_x + (columns + 0.5) * RESOLUTION
    y = costmap.master.origin_y + (rows + 0.5) * RESOLUTION
    of_walls = np.zeros(len(x), dtype=bool)
    for (ax, ay), (bx, _) in walls:  # all of them run along x
        near_its_ends = (x > min(ax, bx) - RESOLUTION) & (x < max(ax, bx) + RESOLUTION)
        of_walls |= (np.abs(y - ay) < 0.8 * RESOLUTION) & near_its_ends
    centres = np.column_stack((x, y))[(np.abs(y - 1.5) < RADIUS + RESOLUTION) & ~of_walls]
    return np.round(centres, 6)


ways = pytest.mark.parametrize("prefer_fast", [True, False], ids=["fast", "full"])
windows = pytest.mark.parametrize("rolling", [True, False], ids=["rolling", "fixed"])
speeds = pytest.mark.parametrize("speed", [0.0, 0.3], ids=["standing", "driving"])


@ways
@windows
@speeds
@pytest.mark.parametrize(
    ("walls", "inf_is_valid"),
    [(OPEN, True), (BEHIND, True), (BEHIND, False), (CLOSE, True), (CLOSE, False)],
    ids=["open-inf", "behind-inf", "behind", "close-inf", "close"],
)
def test_nothing_stays_where_beams_clear(
    walls: list[Wall],
    inf_is_valid: bool,
    speed: float,
    rolling: bool,
    prefer_fast: bool,
) -> None:
    during, after = walk_by(walls, rolling, prefer_fast, speed, inf_is_valid=inf_is_valid)
    assert len(during) > 15  # they were seen
    assert len(after) == 0


@ways
@windows
@speeds
def test_at_the_edge_of_a_shadow_a_single_cell_may_stay(
    speed: float,
    rolling: bool,
    prefer_fast: bool,
) -> None:
    """The beam along the edge marked it.

    Its line of cells to the wall behind rounds past it (as in Nav2).
    """
    during, after = walk_by(PASSAGE, rolling, prefer_fast, speed, inf_is_valid=True)
    assert len(during) > 100
    assert len(after) <= 1
    eye = speed * STEP * 49  # [m] where the robot ends up
    for x, y in after:
        # of what is seen through the gap, at y
        edges = [eye + (edge - eye) * y / 1.1 for edge in (-0.7, 0.7)]
        assert min(abs(x - edge) for edge in edges) < 2 * RESOLUTION or not edges[0] < x < edges[1]


@ways
@windows
def test_beams_without_return_clear_nothing_by_nav2s_default(
    rolling: bool, prefer_fast: bool
) -> None:
    """In the open only the walker's own returns clear.

    All that lies behind the last of them stays.
    """
    during, after = walk_by(OPEN, rolling, prefer_fast, 0.0, inf_is_valid=False)
    assert len(after) > 0.5 * len(during)
    assert set(map(tuple, after)) <= set(map(tuple, during))


@ways
@windows
def test_what_was_marked_beyond_the_raytrace_range_stays(rolling: bool, prefer_fast: bool) -> None:
    """With obstacle_max_range > raytrace_max_range, beams mark a ring and never clear it."""
    during, after = walk_by(
        BEHIND,
        rolling,
        prefer_fast,
        0.0,
        inf_is_valid=True,
        raytrace_max_range=2.5,
    )
    assert len(after) > 10
    assert np.hypot(*after.T).min() > 2.5 - 2 * RESOLUTION
    inside = during[np.hypot(*during.T) < 2.4]
    assert len(inside) > 15


@ways
@windows
def test_a_source_that_only_marks_never_forgets(rolling: bool, prefer_fast: bool) -> None:
    during, after = walk_by(BEHIND, rolling, prefer_fast, 0.0, inf_is_valid=True, clearing=False)
    np.testing.assert_array_equal(np.array(sorted(map(tuple, after))), during)
