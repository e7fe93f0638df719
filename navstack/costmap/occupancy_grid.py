"""Occupancy grids as nav_msgs/OccupancyGrid has them."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from navstack.types import Pose2D

FREE = 0
OCCUPIED = 100
UNKNOWN = -1


@dataclass(frozen=True, slots=True, eq=False)
class OccupancyGrid:
    """Occupancy per cell; the grid's lower left corner stands at ``origin`` in the map frame."""

    data: npt.NDArray[np.int8]  # (height, width), row 0 = lowest y; 0..100 occupancy in percent, -1 unknown
    resolution: float  # [m/cell]
    origin: Pose2D  # of the lower left corner of cell (0, 0)

    @property
    def width(self) -> int:
        """Cells along x."""
        return int(self.data.shape[1])

    @property
    def height(self) -> int:
        """Cells along y."""
        return int(self.data.shape[0])
