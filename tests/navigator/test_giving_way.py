"""A controller that acts at rest: asked on after arrival and without a plan, as Nav2's are not."""

import math

import numpy as np
import pytest

from navstack.costmap.occupancy_grid import OCCUPIED, OccupancyGrid
from navstack.navigation_status import Status
from navstack.types import Pose2D

START = Pose2D(3.0, 4.0)
GOAL = Pose2D(7.0, 4.0)


def walker(grid: OccupancyGrid, begins: float):
    """The cells of a room with a person who walks along x at 1.2 m/s, over whatever is there."""
    rows, columns = np.indices(grid.data.shape)
    x = 0.05 * (columns + 0.5)
    y = 0.05 * (rows + 0.5)

    def solid(now: float) -> np.ndarray:
        return (grid.data == OCCUPIED) | (
            np.hypot(x - (15.0 - 1.2 * max(now - begins, 0.0)), y - 4.0) < 0.3
        )

    return solid


@pytest.mark.slow
@pytest.mark.parametrize(("name", "gives_way"), [("expected_cost", True), ("mpc", False)])
def test_only_who_acts_at_rest_gives_way_after_arrival(room, make, drive, name, gives_way) -> None:
    grid = room()
    navigator, localizer = make(grid, name)
    result = drive(navigator, localizer, START, GOAL, 16.0, walker(grid, 4.0), goes_on=True)
    assert navigator.status is Status.SUCCEEDED
    assert result.touched is not gives_way


@pytest.mark.parametrize(("name", "drives_on"), [("expected_cost", True), ("mpc", False)])
def test_only_who_acts_at_rest_drives_on_where_no_new_plan_is_found(
    room, make, drive, name, drives_on
) -> None:
    """Half-way the goal turns out to be behind a wall that no map shows."""
    grid = room()
    wall = grid.data == OCCUPIED
    closed = wall.copy()
    closed[:, 240:246] = True  # x = 12 m

    navigator, localizer = make(grid, name)
    goal = Pose2D(14.0, 4.0)
    result = drive(
        navigator, localizer, START, goal, 6.0, lambda now: closed if now > 1.0 else wall
    )
    speeds = [abs(command.linear_x) for command in result.commands[-30:]]
    assert navigator.counts.failed_plans > 0
    assert (navigator.counts.recoveries == 0) is drives_on
    assert not result.touched
    assert math.isfinite(sum(speeds))


@pytest.mark.parametrize(("name", "comes_near"), [("expected_cost", True), ("mpc", False)])
def test_only_who_acts_at_rest_drives_where_there_never_was_a_plan(
    room, make, drive, name, comes_near
) -> None:
    grid = room()
    grid.data[:, 240:246] = OCCUPIED  # a wall across the room at x = 12 m, on the map
    navigator, localizer = make(grid, name)
    result = drive(
        navigator, localizer, START, Pose2D(14.0, 4.0), 8.0, lambda now: grid.data == OCCUPIED
    )
    assert navigator.counts.plans == 0
    assert (navigator.counts.recoveries == 0) is comes_near
    assert any(command.linear_x > 0.2 for command in result.commands) is comes_near
    assert not result.touched
