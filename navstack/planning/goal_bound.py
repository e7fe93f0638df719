"""How far it is at least to a goal: known once per goal, it keeps NavFn's wave from going where no path can lead."""

import numpy as np

from navstack.costmap.costmap import Costmap
from navstack.planning.potential_field import PotentialField
from navstack.types import Float32Array

SLACK = 8000.0  # of potential (8 m of free cells) that a path may cost more than the bound says


class GoalBound:
    """A lower bound of NavFn's cost from every cell to one goal.

    It is NavFn's potential spread from the goal over the costmap's floor, the costs that no obstacle lowers. Potentials
    spread from the two ends of a way differ a little (each leaves out the cost of its own first cell, and the
    interpolation is not symmetric); half of ``SLACK`` is kept for that.
    """

    def __init__(self, allow_unknown: bool) -> None:
        self._field = PotentialField(allow_unknown)
        self._floor: object = None  # what the bound was made of; the same object as long as the map is the same
        self._goal = -1

    def towards(self, goal: int, robot: int, costmap: Costmap) -> tuple[Float32Array, float] | None:
        """The bound (height * width,) of the remaining cost to cell ``goal``, and the limit for a way from ``robot``.

        None where the costmap has no floor, or where not even the floor lets the robot reach the goal.
        """
        if costmap.floor is None:
            return None
        if costmap.floor is not self._floor or goal != self._goal:
            self._renew(goal, robot, costmap)
        remaining = self._field.flat[robot]
        if remaining + SLACK > self._complete_below:
            self._renew(goal, robot, costmap)
            remaining = self._field.flat[robot]
        if remaining + SLACK > self._complete_below:
            return None
        return self._field.flat, float(remaining) + SLACK

    def _renew(self, goal: int, robot: int, costmap: Costmap) -> None:
        assert costmap.floor is not None
        self._floor, self._goal = costmap.floor, goal
        floor = Costmap(costmap.floor, costmap.resolution, costmap.origin_x, costmap.origin_y)
        self._complete_below = self._field.expand(floor, goal, robot, margin=2.0 * SLACK)


def is_exact(potential: np.float32, limit: float) -> bool:
    """Whether a goal reached at ``potential`` by a wave within ``limit`` has been reached at the least cost."""
    return bool(potential <= limit - 0.5 * SLACK)
