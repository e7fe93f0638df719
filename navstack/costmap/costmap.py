"""A grid of traversal costs, after nav2_costmap_2d::Costmap2D."""

import math
from dataclasses import dataclass

from navstack.types import ByteArray

FREE_SPACE = 0
INSCRIBED_INFLATED_OBSTACLE = 253  # the robot's centre here means contact
LETHAL_OBSTACLE = 254
NO_INFORMATION = 255

Box = tuple[int, int, int, int]  # x0, xn, y0, yn of cells, ends exclusive
Grid = tuple[float, float, float]  # [m] x and y of a costmap's origin, [m] size of a cell


@dataclass(slots=True, eq=False)
class Costmap:
    """Costs 0..255 on a grid that is parallel to its frame.

    Cell (mx, my) covers [origin + m * resolution, origin + (m + 1) * resolution); its world
    position is its centre.
    """

    data: ByteArray  # (height, width), row 0 = lowest y, C-contiguous
    resolution: float  # [m/cell]
    origin_x: float  # [m] of the lower left corner of cell (0, 0)
    origin_y: float  # [m]
    # (height, width) costs that no update goes below; None: not known
    floor: ByteArray | None = None

    @property
    def size_x(self) -> int:
        """Cells along x."""
        return int(self.data.shape[1])

    @property
    def size_y(self) -> int:
        """Cells along y."""
        return int(self.data.shape[0])

    @property
    def grid(self) -> Grid:
        """Where the cells are, for kernels."""
        return self.origin_x, self.origin_y, self.resolution

    def world_to_map(self, x: float, y: float) -> tuple[int, int]:
        """The cell (mx, my) that holds a point.

        It may lie outside the grid (see :meth:`contains`).
        """
        mx = math.floor((x - self.origin_x) / self.resolution)
        my = math.floor((y - self.origin_y) / self.resolution)
        return mx, my

    def map_to_world(self, mx: int, my: int) -> tuple[float, float]:
        """The centre of a cell, in [m]."""
        x = self.origin_x + (mx + 0.5) * self.resolution
        y = self.origin_y + (my + 0.5) * self.resolution
        return x, y

    def contains(self, mx: int, my: int) -> bool:
        """Whether a cell lies on the grid."""
        return 0 <= mx < self.size_x and 0 <= my < self.size_y

    def cost_at(self, x: float, y: float) -> int:
        """The cost at a point; NO_INFORMATION outside the grid."""
        mx, my = self.world_to_map(x, y)
        if self.contains(mx, my):
            return int(self.data[my, mx])
        return NO_INFORMATION
