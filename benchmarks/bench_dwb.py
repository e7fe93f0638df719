"""One DWB cycle on Nav2's own benchmark scenes, against the recorded C++."""

import dataclasses
import os
import time
from pathlib import Path as FilePath

import numpy as np

from navstack.control.controller import Surroundings
from navstack.control.dwb.dwb_controller import DwbController
from navstack.costmap.costmap import Costmap
from navstack.params.dwb import AlignParams, DistParams, DwbParams, ObstacleParams, RotateToGoalParams
from navstack.types import Path, Pose2D, RobotState, Twist2D

CYCLES = 300
NAV2_CPP_MS = {480: 22.0, 160: 3.57}  # recorded medians
RESOLUTION = 0.05  # [m]

TUNED = DwbParams(
    critics=("RotateToGoal", "Oscillation", "BaseObstacle", "GoalAlign", "PathAlign", "PathDist", "GoalDist"),
    max_vel_x=3.0,
    max_speed_xy=3.0,
    max_vel_theta=1.2,
    min_speed_theta=0.3,
    acc_lim_x=4.0,
    decel_lim_x=-4.0,
    acc_lim_theta=3.5,
    decel_lim_theta=-3.5,
    sim_time=1.0,
    linear_granularity=0.05,
    xy_goal_tolerance=1.8,
    RotateToGoal=RotateToGoalParams(scale=32.0),
    BaseObstacle=ObstacleParams(scale=0.05),
    GoalAlign=AlignParams(scale=12.0, forward_point_distance=0.1),
    PathAlign=AlignParams(scale=16.0, forward_point_distance=0.1),
    PathDist=DistParams(scale=16.0),
    GoalDist=DistParams(scale=12.0),
)


def median_cycle_ms(params: DwbParams, costs: np.ndarray, path: np.ndarray) -> float:
    footprint = np.array(((0.19, 0.3), (0.19, -0.3), (-0.657, -0.3), (-0.657, 0.3)))
    controller = DwbController(params, footprint, 30.0)
    half = costs.shape[0] * RESOLUTION / 2.0
    surroundings = Surroundings(Costmap(costs, RESOLUTION, -half, -half))
    plan = Path(path)
    state = RobotState(Pose2D(0.02, 0.03, 0.1), Twist2D(1.0, 0.0, 0.1))
    times = []
    for _ in range(CYCLES):
        begin = time.perf_counter()
        controller.compute_velocity(state, plan, surroundings)
        times.append(time.perf_counter() - begin)
    return 1e3 * float(np.median(times))


def main() -> None:
    golden = FilePath(os.environ.get("NAVSTACK_GOLDEN", "tests/golden"))
    dwb_c = np.load(golden / "dwb_c.npz")
    jazzy = np.load(golden / "dwb_jazzy.npz")
    whole_plan = dataclasses.replace(TUNED, prune_plan=False, shorten_transformed_plan=False)
    rows = (
        ("480 x 480, plan pruned to 2 m", 480, TUNED, dwb_c["costmap480"], dwb_c["path480"]),
        ("480 x 480, whole plan", 480, whole_plan, dwb_c["costmap480"], dwb_c["path480"]),
        ("160 x 160, plan pruned to 2 m", 160, TUNED, jazzy["curve_costmap"], jazzy["curve_path"]),
        ("160 x 160, whole plan", 160, whole_plan, jazzy["curve_costmap"], jazzy["curve_path"]),
    )
    print(f"{'DWB cycle, 419 samples':34s} {'ms':>8s} {'Nav2 C++ ms':>12s} {'ratio':>7s}")
    for title, cells, params, costs, path in rows:
        ours = median_cycle_ms(params, costs, path)
        print(f"{title:34s} {ours:8.3f} {NAV2_CPP_MS[cells]:12.2f} {NAV2_CPP_MS[cells] / ours:6.1f}x")


if __name__ == "__main__":
    main()
