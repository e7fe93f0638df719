"""How far it is to a goal from everywhere at once: NavFn's potential as metres."""

import numpy as np

from navstack.costmap.costmap import Costmap
from navstack.planning.navfn_kernels import COST_NEUTRAL, LEAST_OBSTACLE, POT_HIGH
from navstack.planning.potential_field import NOWHERE, PotentialField
from navstack.types import FloatArray, Pose2D

# cells that the wave may keep waiting; NavFn's own limit drops cells on maps of this size
_WAITING = 200_000


def cost_to_go(costmap: Costmap, goal: Pose2D, allow_unknown: bool = True) -> FloatArray:
    """The cost [m] of the way from each cell (height, width) to a goal, higher near obstacles.

    Infinite where no way leads, through unknown cells only if these are allowed. A goal in an
    obstacle counts as the nearest free cell.
    """
    field = PotentialField(allow_unknown, buffer_size=_WAITING)
    field.expand(costmap, _free_cell(costmap, goal), NOWHERE)
    metres = field.potential.astype(np.float64) * (costmap.resolution / float(COST_NEUTRAL))
    metres[field.potential >= POT_HIGH] = np.inf
    return metres


def _free_cell(costmap: Costmap, goal: Pose2D) -> int:
    """The number of the free cell nearest to a goal; the goal's own where none is free."""
    mx, my = costmap.world_to_map(goal.x, goal.y)
    mx = min(max(mx, 0), costmap.size_x - 1)
    my = min(max(my, 0), costmap.size_y - 1)
    if costmap.data[my, mx] >= LEAST_OBSTACLE:
        rows, columns = np.nonzero(costmap.data < LEAST_OBSTACLE)
        if len(rows):
            nearest = int(np.argmin((rows - my) ** 2 + (columns - mx) ** 2))
            my = int(rows[nearest])
            mx = int(columns[nearest])
    return my * costmap.size_x + mx
