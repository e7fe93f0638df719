"""NavFn's potential over a costmap, in arrays that outlive a plan."""

import numpy as np

from navstack.costmap.costmap import Costmap
from navstack.costmap.field_cache import give_back, shared_array
from navstack.planning.incremental_kernels import respread
from navstack.planning.navfn_descent import EXHAUSTED, descend, nearest_reachable
from navstack.planning.navfn_kernels import (
    BLOCK_SIZE,
    BUFFER_SIZE,
    NO_BOUND,
    POT_HIGH,
    NavfnField,
    clear_potential,
    cost_tables,
)
from navstack.planning.navfn_wave import propagate
from navstack.types import ByteArray, Float32Array, FloatArray, Pose2D

NOWHERE = -1  # a target that is never reached: the wave goes on until nothing is left


def flat_costs(costmap: Costmap) -> ByteArray:
    """The costs (height * width,) of a costmap, a view where it is C-contiguous.

    It cannot be written to, whatever the costmap, so that numba compiles the kernels for one kind
    of arrays.
    """
    flat = np.ascontiguousarray(costmap.data).reshape(-1).view()
    flat.flags.writeable = False
    return flat


def _nothing_reached(cells: int) -> Float32Array:
    """So many potentials.

    Of a large map what is never written to stands in memory once for all processes.
    """
    return shared_array(cells, lambda: np.full(cells, POT_HIGH), "potentials-1", cells)


class PotentialField:
    """The potential of every cell: the cost of the way from a source (a free cell costs 50).

    The arrays are as large as the map and are written only where the wave comes: a plan on a map of
    16 million cells of which it needs two costs what the two cost.
    """

    def __init__(self, allow_unknown: bool, buffer_size: int = BUFFER_SIZE) -> None:
        """``buffer_size`` is how many cells may wait at once; more are dropped."""
        self._crossing, self._gain = cost_tables(allow_unknown)
        self._buffers = np.empty((3, buffer_size), dtype=np.uint32)
        self._path = np.empty((4096, 2), dtype=np.float32)
        self._resize((0, 0))

    @property
    def potential(self) -> Float32Array:
        """(height, width) cost of the way from the source; POT_HIGH where the wave has not been."""
        return self.flat.reshape(self._shape)

    def expand(
        self,
        costmap: Costmap,
        source: int,
        target: int,
        use_astar: bool = False,
        margin: float = -np.inf,
        ahead: Float32Array = NO_BOUND,
        limit: float = np.inf,
    ) -> float:
        """Spread the potential anew from cell ``source`` until ``target`` (or NOWHERE) is reached.

        ``margin``, ``ahead``, ``limit`` and what is returned: see :func:`run_wave`.
        """
        if costmap.data.shape != self._shape:
            self._resize((costmap.size_y, costmap.size_x))
        clear_potential(self.flat, self._dirty)
        return float(
            propagate(self._field(costmap), source, target, use_astar, margin, ahead, limit)
        )

    def resume(
        self,
        costmap: Costmap,
        source: int,
        target: int,
        level: float,
        margin: float,
        limit: float = np.inf,
    ) -> float:
        """Forget potentials of ``level`` and above, and spread anew from those below."""
        return float(
            respread(self._field(costmap), self._tops, source, target, level, margin, limit)
        )

    def _field(self, costmap: Costmap) -> NavfnField:
        """What the kernels take, with the costs of a costmap."""
        return NavfnField(
            self.flat,
            self._dirty,
            flat_costs(costmap),
            self._crossing,
            self._gain,
            costmap.size_x,
            self._buffers,
        )

    def nearest_reached(self, goal: Pose2D, costmap: Costmap, tolerance: float) -> Pose2D | None:
        """The goal, or the nearest reached point within ``tolerance`` [m] per axis."""
        x, y = nearest_reachable(
            self.flat, self._shape[1], (goal.x, goal.y), tolerance, costmap.grid
        )
        if np.isnan(x):
            return None
        return Pose2D(float(x), float(y), goal.yaw)

    def descend(self, start: int, source: int, most_points: int = 0) -> FloatArray | None:
        """Points (N, 2) in [cells] from cell ``start`` down to ``source``.

        None where the gradient leads nowhere, or, as upstream, where the path is longer than
        ``most_points`` (0: no limit).
        """
        path = self._path
        gives_up = most_points > 0
        if gives_up:
            path = np.empty((most_points, 2), dtype=np.float32)
        count = descend(self.flat, self._shape[1], start, source, gives_up, path)
        while count == EXHAUSTED and not gives_up:
            path = self._path = np.empty((2 * len(path), 2), dtype=np.float32)
            count = descend(self.flat, self._shape[1], start, source, gives_up, path)
        if count <= 0:
            return None
        return path[:count].astype(np.float64)

    def forget(self) -> None:
        """Forget every potential, and give back the memory that they took."""
        if give_back(self.flat):
            self._dirty[:] = 0
        else:
            clear_potential(self.flat, self._dirty)

    def _resize(self, shape: tuple[int, int]) -> None:
        self._shape = shape
        cells = shape[0] * shape[1]
        self.flat = _nothing_reached(cells)  # (height * width,) the potential by cell number
        blocks = -(-(cells // BLOCK_SIZE + 1) // 8) * 8  # whole words
        self._dirty: ByteArray = np.zeros(blocks, dtype=np.uint8)
        self._tops: Float32Array = np.zeros(self._dirty.size, dtype=np.float32)
