"""What two rules claim, measured with the planner and the controller that the file configures."""

from dataclasses import replace
from pathlib import Path as FilePath

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt

from navstack.control.controller import Surroundings
from navstack.control.dwb.dwb_controller import DwbController
from navstack.costmap.costmap import Costmap
from navstack.params.nav2_file.file import load_nav2
from navstack.params.nav2_file.views import read_controller_server, read_dwb
from navstack.params.planners import NavfnParams
from navstack.planning.navfn import NavfnPlanner
from navstack.types import Path, Pose2D, RobotState, Twist2D

SHIPPED = FilePath(__file__).parents[2] / "params" / "nav2"
FOOTPRINT = np.array(((0.19, 0.3), (0.19, -0.3), (-0.66, -0.3), (-0.66, 0.3)))
CELL = 0.05  # [m]


def cruising_speed(name, half_window, **changes):
    """The speed in [m/s] that DWB settles at on an endless straight plan.

    Its drive does as it is told.
    """
    nav2 = load_nav2(SHIPPED / f"{name}.yaml")
    params, frequency = (
        replace(read_dwb(nav2), **changes),
        read_controller_server(nav2).controller_frequency,
    )
    controller = DwbController(params, FOOTPRINT, frequency)
    poses = np.zeros((1000, 3))
    poses[:, 0] = np.arange(1000) * CELL
    plan, free = Path(poses), np.zeros((int(2 * half_window / CELL),) * 2, dtype=np.uint8)
    x, speeds = 0.0, [0.0]
    for _ in range(int(5.0 * frequency)):
        state = RobotState(Pose2D(x, 0.0, 0.0), Twist2D(speeds[-1]))
        costmap = Costmap(free, CELL, x - half_window, -half_window)
        wanted = controller.compute_velocity(state, plan, Surroundings(costmap)).linear_x
        speeds.append(min(wanted, speeds[-1] + params.acc_lim_x / frequency))
        x += speeds[-1] / frequency
    return float(np.mean(speeds[-int(frequency) :]))


def test_beyond_the_plan_caps_the_speed_and_the_advice_frees_it():
    """The linter says: at most about 2.00 m/s (tuned) and 1.18 m/s (stock)."""
    assert cruising_speed("tuned", 4.0) == pytest.approx(1.89, abs=0.02)
    assert cruising_speed("tuned", 4.0, sim_time=0.66) > 2.95  # of 3.0
    assert cruising_speed("tuned", 4.0, forward_prune_distance=3.0) > 2.85
    assert cruising_speed("stock", 3.0) == pytest.approx(1.16, abs=0.02)
    assert cruising_speed("stock", 3.0, sim_time=1.0) > 1.9  # of 2.0


def corner_clearance(cost_scaling_factor, inflation_radius=1.0, inscribed=0.39, width=1.6):
    """Least distance [m] from a wall of NavFn's path around the corner of an L-shaped corridor."""
    free, cells = np.zeros((280, 280), dtype=bool), int(width / CELL)
    free[20 : 20 + cells, 20:260] = free[20:260, 260 - cells : 260] = True
    distance = distance_transform_edt(free) * CELL
    soft = np.floor(252.0 * np.exp(-cost_scaling_factor * (distance - inscribed)))
    zones = [distance <= 0.0, distance <= inscribed, distance <= inflation_radius]
    costs = np.select(zones, [254.0, 253.0, soft], 0.0).astype(np.uint8)
    middle = width / 2.0
    start, goal = Pose2D(1.0 + middle, 1.0 + middle, 0.0), Pose2D(13.0 - middle, 12.0, 1.57)
    poses = NavfnPlanner(NavfnParams()).plan(start, goal, Costmap(costs, CELL, 0.0, 0.0)).poses
    return float(distance[tuple((poses[:, 1::-1] / CELL).astype(int).T)].min())


def test_flat_inflation_cuts_corners_and_the_advice_keeps_clear():
    """The global costmap of tuned and stock: 0.3/m, where the linter advises 4.9/m."""
    assert corner_clearance(0.3) < 0.39 + CELL
    assert corner_clearance(4.9) > 0.7
