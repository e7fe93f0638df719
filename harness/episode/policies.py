"""What a policy of the user's needs around it: a localizer, a planned route, people if it is told of them."""

import numpy as np

from harness.policy.brain import PolicyBrain
from harness.policy.process import PolicyProcess
from harness.policy.senses import MakeRoute, Senses
from harness.policy.waypoints import WaypointFollower
from harness.task.stack import Stack
from harness.world.world import World
from navstack.build import build_global_costmap, build_planner
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.errors import PlanningError
from navstack.localization.localizer import Localizer
from navstack.params.nav2_file.file import Nav2File
from navstack.types import BoolArray, FloatArray, Path, Pose2D

Planned = tuple[OccupancyGrid, BoolArray | None]  # the map that is planned on, and its mask


def senses_on(world: World, stack: Stack, localizer: Localizer, nav2: Nav2File, planned: Planned) -> Senses:
    """What a policy of a stack sees in a world."""

    def people() -> tuple[Pose2D, FloatArray]:
        return world.truth.pose, world.truth.pedestrians

    return Senses(localizer, _route(nav2, *planned), people if stack.policy.sees_people else None)


def policy_brain_on(stack: Stack, senses: Senses) -> PolicyBrain:
    """A stack's policy at work, loaded.

    Raises:
        PolicyError: it cannot be loaded.
    """
    policy = PolicyProcess(stack.navigator, stack.policy)
    policy.start()
    return PolicyBrain(senses, stack.policy.rate, policy, WaypointFollower(stack.policy.speed))


def _route(nav2: Nav2File, static_map: OccupancyGrid, keepout: BoolArray | None) -> MakeRoute:
    """Plans with the file's planner on its global costmap, without scans; where that fails, straight to the goal."""
    costmap = build_global_costmap(nav2, static_map, keepout)
    planner = build_planner(nav2, costmap)

    def make_route(start: Pose2D, goal: Pose2D, rng: np.random.Generator) -> Path:
        costmap.reset()
        costmap.update(start, None, 0.0)
        planner.reset(rng)
        try:
            return planner.plan(start, goal, costmap.master)
        except PlanningError:
            return Path(np.array((start.as_array(), goal.as_array())))

    return make_route
