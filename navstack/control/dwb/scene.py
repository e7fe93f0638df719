"""What the critics know of the situation in which trajectories are scored."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from navstack.control.dwb.kernels import CellArray, pose_cells
from navstack.control.dwb.rollouts import Rollouts
from navstack.control.plan_handling import plan_cells
from navstack.costmap.costmap import Costmap
from navstack.types import BoolArray, FloatArray, IntArray, Pose2D, Track, Twist2D


@dataclass(eq=False)
class Scene:
    """One control cycle; everything in the map frame."""

    pose: Pose2D
    velocity: Twist2D  # measured, base frame
    stamp: float  # [s]
    goal: Pose2D  # the last pose of the whole plan
    plan: FloatArray  # (N, 3) the plan near the robot
    costmap: Costmap
    footprint: FloatArray  # (V, 2) [m] padded polygon in the base frame
    tracks: tuple[Track, ...] = ()  # of what moves about
    rollouts: Rollouts | None = field(init=False, default=None)  # of this scene, once there are any

    @cached_property
    def path_cells(self) -> IntArray:
        """The cells (S, 2) of the plan as mx, my, as far as the map is known."""
        return plan_cells(self.plan, self.costmap)

    @property
    def cells(self) -> CellArray:
        """Flat cell index (K, T) of each pose, -1 off the map."""
        return self._located[0]

    @property
    def leaves_map(self) -> BoolArray:
        """Whether some pose of a trajectory (K,) is off the map."""
        return self._located[1]

    @cached_property
    def _located(self) -> tuple[CellArray, BoolArray]:
        assert self.rollouts is not None
        r, c = self.rollouts, self.costmap
        cells = np.empty(r.x.shape, dtype=np.int32)
        return cells, pose_cells(r.x, r.y, r.lengths, c.data.shape, c.grid, cells)
