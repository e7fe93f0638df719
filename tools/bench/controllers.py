"""A control cycle of DWB on the scenes on which Nav2's was timed."""

from collections.abc import Sequence
from functools import partial

import numpy as np

from harness.storage.shipped import shipped
from navstack.control.controller import Surroundings
from navstack.control.dwb.dwb_controller import DwbController
from navstack.control.plan_handling import PlanWindow
from navstack.costmap.costmap import Costmap
from navstack.params.dwb import DwbParams
from navstack.params.nav2_file.file import load_nav2
from navstack.params.nav2_file.views import read_dwb
from navstack.types import FloatArray, Path, Pose2D, RobotState, Twist2D
from tools.bench import twin_dwb
from tools.bench.component import Component, Prepared, golden, require_agreement

RESOLUTION = 0.05  # [m]
FREQUENCY = 30.0  # [Hz]
FOOTPRINT = ((0.19, 0.3), (0.19, -0.3), (-0.657, -0.3), (-0.657, 0.3))  # [m]
STATES = [  # of the robot; the first is timed
    RobotState(
        Pose2D(0.02 + 0.03 * k, 0.03 - 0.02 * k, 0.1 - 0.04 * k),
        Twist2D(1.0 + 0.2 * k, 0.0, 0.1 - 0.07 * k),
    )
    for k in range(8)
]


def cycle(file: str, costs: str, path: str) -> Prepared:
    """A cycle with 419 samples, the plan pruned to 2 m ahead as in Jazzy."""
    vectors, params = golden(file), read_dwb(load_nav2(shipped("params") / "nav2" / "tuned.yaml"))
    grid, plan = vectors[costs], Path(vectors[path])
    half = grid.shape[0] * RESOLUTION / 2.0
    surroundings = Surroundings(Costmap(grid, RESOLUTION, -half, -half))
    controller = DwbController(params, np.array(FOOTPRINT), FREQUENCY)

    def given(state: RobotState) -> tuple[DwbParams, RobotState, FloatArray, FloatArray, Costmap]:
        window = PlanWindow(
            params.prune_plan,
            params.prune_distance,
            params.forward_prune_distance,
            params.shorten_transformed_plan,
        )
        near = window.near(plan, state.pose, surroundings.costmap).copy()
        return params, state, near, plan.poses[-1], surroundings.costmap

    for state in STATES:
        controller.reset()
        command = controller.compute_velocity(state, plan, surroundings)
        samples, totals = twin_dwb.commands_of(params, state), twin_dwb.totals(*given(state))
        chosen = (
            np.abs(samples - (command.linear_x, command.linear_y, command.angular_z))
            .sum(axis=1)
            .argmin()
        )
        # 32-bit sums there
        require_agreement("DWB cycle: the least sum", totals[chosen], totals.min(), 1e-6)
    controller.reset()
    twin = partial(twin_dwb.best_command, *given(STATES[0]))
    return Prepared(lambda: controller.compute_velocity(STATES[0], plan, surroundings), twin)


COMPONENTS: Sequence[Component] = (
    Component("DWB cycle, 480 x 480", partial(cycle, "dwb_c", "costmap480", "path480"), 22.0, 0.02),
    Component(
        "DWB cycle, 160 x 160",
        partial(cycle, "dwb_jazzy", "curve_costmap", "curve_path"),
        3.57,
        0.1,
    ),
)
