"""What the critics know of the situation in which trajectories are scored."""

from dataclasses import dataclass, field

import numpy as np

from navstack.control.dwb.kernels import CellArray, pose_cells
from navstack.control.dwb.rollouts import Rollouts
from navstack.control.plan_handling import plan_cells
from navstack.costmap.costmap import Costmap
from navstack.types import BoolArray, FloatArray, IntArray, Pose2D, Twist2D


@dataclass(slots=True, eq=False)
class Scene:
    """One control cycle; everything in the map frame."""

    pose: Pose2D
    velocity: Twist2D  # measured, base frame
    stamp: float  # [s]
    goal: Pose2D  # the last pose of the whole plan
    plan: FloatArray  # (N, 3) the plan near the robot
    costmap: Costmap
    footprint: FloatArray  # (V, 2) [m] padded polygon in the base frame
    cells: CellArray = field(init=False)  # (K, T) flat cell index of each pose, -1 off the map; once they were located
    leaves_map: BoolArray = field(init=False)  # (K,) some pose is off the map; likewise
    _path_cells: IntArray | None = field(init=False, default=None)  # once they were asked for

    @property
    def path_cells(self) -> IntArray:
        """The cells (S, 2) of the plan as mx, my, as far as the map is known."""
        if self._path_cells is None:
            self._path_cells = plan_cells(self.plan, self.costmap)
        return self._path_cells

    def locate(self, rollouts: Rollouts) -> None:
        """Find the cells of the poses of ``rollouts``."""
        c = self.costmap
        self.cells = np.empty(rollouts.x.shape, dtype=np.int32)
        self.leaves_map = pose_cells(
            rollouts.x,
            rollouts.y,
            rollouts.lengths,
            c.size_x,
            c.size_y,
            c.origin_x,
            c.origin_y,
            c.resolution,
            self.cells,
        )
