"""Keep the robot's centre near the plan (PathDist) and drive it to the plan's end (GoalDist)."""

from navstack.control.dwb.critics.map_grid import MapGridCritic
from navstack.control.dwb.pose_score import GOAL_DISTANCE, PATH_DISTANCE


class PathDistCritic(MapGridCritic):
    """After ``path_dist.cpp``: distance to the plan. Every pose must be on the map."""

    kind = PATH_DISTANCE


class GoalDistCritic(MapGridCritic):
    """After ``goal_dist.cpp``: distance to where the plan ends or leaves the known map."""

    kind = GOAL_DISTANCE
