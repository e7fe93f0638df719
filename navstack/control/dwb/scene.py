"""What the critics know of the situation in which trajectories are scored."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from navstack.control.dwb.kernels import CellArray
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

    @cached_property
    def cells(self) -> CellArray:
        """Flat cell index (K, T) of each pose, -1 off the map."""
        assert self.rollouts is not None
        return cells_of(self.rollouts.x, self.rollouts.y, self.costmap)

    @property
    def leaves_map(self) -> BoolArray:
        """Whether some pose of a trajectory (K,) is off the map."""
        leaves: BoolArray = np.any(self.cells < 0, axis=1)
        return leaves


def cells_of(x: FloatArray, y: FloatArray, costmap: Costmap) -> CellArray:
    """Index of the cell of each point in the flattened costmap.

    -1 off the map (``Costmap2D::worldToMap``).
    """
    fx, fy = (
        (x - costmap.origin_x) / costmap.resolution,
        (y - costmap.origin_y) / costmap.resolution,
    )
    inside = (fx >= 0.0) & (fy >= 0.0) & (fx < costmap.size_x) & (fy < costmap.size_y)
    mx, my = (np.where(inside, each, 0.0).astype(np.int32) for each in (fx, fy))
    return np.where(inside, my * np.int32(costmap.size_x) + mx, np.int32(-1))
