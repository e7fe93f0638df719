"""NavFn's potential over a costmap, in arrays that outlive a plan."""

import numpy as np

from navstack.costmap.costmap import Costmap
from navstack.planning.navfn_descent import EXHAUSTED, descend
from navstack.planning.navfn_kernels import (
    BLOCK_SHIFT,
    BUFFER_SIZE,
    POT_HIGH,
    clear_potential,
    cost_tables,
    nearest_reachable,
    propagate,
)
from navstack.types import ByteArray, Float32Array, FloatArray, Pose2D

NOWHERE = -1  # a target that is never reached: the wave goes on until nothing is left


class PotentialField:
    """The potential of every cell: the cost of the way from a source, in NavFn's units (a free cell costs 50).

    The arrays are as large as the map and are written only where the wave comes: a plan on a map of 16 million cells
    of which it needs two costs what the two cost.
    """

    def __init__(self, allow_unknown: bool) -> None:
        self._crossing, self._gain = cost_tables(allow_unknown)
        self._buffers = np.empty((3, BUFFER_SIZE), dtype=np.uint32)
        self._path = np.empty((4096, 2), dtype=np.float32)
        self._resize((0, 0))

    @property
    def potential(self) -> Float32Array:
        """(height, width) cost of the way from the source; POT_HIGH where the wave has not been."""
        return self._flat.reshape(self._shape)

    def expand(self, costmap: Costmap, source: int, target: int, use_astar: bool = False) -> None:
        """Spread the potential anew from cell ``source`` until cell ``target`` (or NOWHERE) is reached."""
        if costmap.data.shape != self._shape:
            self._resize((costmap.size_y, costmap.size_x))
        clear_potential(self._flat, self._dirty)
        propagate(
            self._flat,
            self._dirty,
            np.ascontiguousarray(costmap.data).reshape(-1),
            self._crossing,
            self._gain,
            costmap.size_x,
            source,
            target,
            use_astar,
            self._buffers,
            -np.inf,
        )

    def nearest_reached(self, goal: Pose2D, costmap: Costmap, tolerance: float) -> Pose2D | None:
        """The goal, or the reached point nearest to it within ``tolerance`` [m] per axis, with the goal's yaw."""
        x, y = nearest_reachable(
            self._flat,
            self._shape[1],
            goal.x,
            goal.y,
            tolerance,
            costmap.resolution,
            costmap.origin_x,
            costmap.origin_y,
        )
        return None if np.isnan(x) else Pose2D(float(x), float(y), goal.yaw)

    def descend(self, start: int, source: int) -> FloatArray | None:
        """Points (N, 2) in [cells] from cell ``start`` down to cell ``source``; None where the gradient leads nowhere."""
        count = EXHAUSTED
        while (count := descend(self._flat, self._shape[1], start, source, self._path)) == EXHAUSTED:
            self._path = np.empty((2 * len(self._path), 2), dtype=np.float32)
        return self._path[:count].astype(np.float64) if count > 0 else None

    def _resize(self, shape: tuple[int, int]) -> None:
        self._shape = shape
        cells = shape[0] * shape[1]
        self._flat: Float32Array = np.full(cells, POT_HIGH)
        self._dirty: ByteArray = np.zeros((cells >> int(BLOCK_SHIFT)) + 1, dtype=np.uint8)
