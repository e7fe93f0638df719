"""What a critic's raw score comes to, where the ends of the trajectories tell it."""

from typing import NamedTuple

# Kinds of scores, and what the number that goes with them means. Those from CELL_COST to
# GOAL_ALIGNMENT look at a cell.
NOTHING = 0  # 0 for every trajectory
GIVEN = 1  # the critic's raw costs; the number is their row among those given
CELL_COST = 2  # the cost under the last pose; illegal if any pose is off the map or in an obstacle
PATH_DISTANCE = 3  # [cells] from the last pose to the plan; illegal if any pose is off the map
# [cells] from the last pose to the plan's end; illegal if any pose is off the map
GOAL_DISTANCE = 4
PATH_ALIGNMENT = 5  # [cells] from the point ``number`` [m] ahead of the last pose to the plan
# the same to the plan's end, moved ``number`` [m] ahead along the bearing of the goal
GOAL_ALIGNMENT = 6
# the greatest cost under the outline at the last pose; illegal if any pose's meets an obstacle
OUTLINE_COST = 7


class EndScore(NamedTuple):
    """A score in short, exactly what :meth:`~navstack.control.dwb.critics.critic.Critic.raw_costs` would answer."""

    kind: int
    number: float = 0.0


NO_SCORE = EndScore(NOTHING)
