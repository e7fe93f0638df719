"""Whoever walks about reaches the controllers that ask for it."""

import math

import numpy as np
import pytest

from navstack.control.controller import Surroundings
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.types import Belief, Generators, LaserScan, Observation, Odometry, Pose2D, Twist2D

START = Pose2D(3.0, 2.0)
GOAL = Pose2D(13.0, 2.0)


def walker(grid: OccupancyGrid):
    """The cells of the room with a person in it who walks along the x axis at 1 m/s."""
    rows, columns = np.indices(grid.data.shape)
    x = 0.05 * (columns + 0.5)
    y = 0.05 * (rows + 0.5)

    def solid(now: float) -> np.ndarray:
        return (grid.data > 0) | (np.hypot(x - (4.0 + now), y - 5.0) < 0.3)

    return solid


@pytest.mark.parametrize(("name", "is_seen"), [("mpc", True), ("tuned", False)])
def test_a_walking_person_is_tracked_where_the_controller_asks_for_it(
    room, make, drive, name, is_seen
) -> None:
    grid = room()
    navigator, localizer = make(grid, name)
    drive(navigator, localizer, START, GOAL, 2.0, walker(grid))
    moving = [track for track in navigator.tracks if math.hypot(track.vx, track.vy) > 0.5]
    if not is_seen:
        assert navigator.tracks == ()
        return
    (track,) = moving
    assert math.hypot(track.x - 6.0, track.y - 5.0) < 0.3
    assert math.hypot(track.vx - 1.0, track.vy) < 0.3
    drive(navigator, localizer, START, GOAL, 0.05)
    assert navigator.tracks == ()  # a new goal forgets


def test_the_controller_is_told_of_them(room, make, drive, monkeypatch) -> None:
    seen = []
    monkeypatch.setattr(
        "navstack.behavior_tree.Surroundings",
        lambda *given: seen.append(given[1]) or Surroundings(*given),
    )
    grid = room()
    navigator, localizer = make(grid, "mpc")
    drive(navigator, localizer, START, GOAL, 2.0, walker(grid))
    assert any(math.hypot(track.vx, track.vy) > 0.5 for track in seen[-1])


def test_a_late_scan_counts_from_where_it_was_taken(room, make) -> None:
    """The robot turns; its scan of a post arrives 0.2 s late."""
    navigator, localizer = make(room())
    navigator.reset(
        GOAL, Belief(START), Generators(*(np.random.default_rng(seed) for seed in range(3)))
    )
    ranges = np.full(360, math.inf)
    ranges[180] = 2.0  # straight ahead
    for k in range(31):
        now = k / 30.0
        localizer.pose = Pose2D(START.x, START.y, now)  # 1 rad/s
        scan = (
            LaserScan(now - 0.2, ranges, -math.pi, math.pi / 180.0, 0.05, 30.0) if k == 30 else None
        )
        navigator.tick(
            Observation(now, odometry=Odometry(now, localizer.pose, Twist2D()), scan=scan)
        )
    costmap = navigator._costmaps[0][0].master
    assert costmap.cost_at(START.x + 2.0 * math.cos(0.8), START.y + 2.0 * math.sin(0.8)) == 254
    assert costmap.cost_at(START.x + 2.0 * math.cos(1.0), START.y + 2.0 * math.sin(1.0)) < 254
