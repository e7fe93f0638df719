"""The models of people by name."""

from collections.abc import Callable

from harness.world.people.params import PedestrianParams
from harness.world.people.pedestrians import PedestrianModel, RandomWalkPedestrians
from harness.world.people.replay import ReplayPedestrians
from harness.world.people.social_force import SocialForcePedestrians
from harness.world.physics.robot import RobotParams
from navstack.costmap.occupancy_grid import OccupancyGrid

Maker = Callable[[PedestrianParams, OccupancyGrid, RobotParams], PedestrianModel]

PEDESTRIAN_MODELS: dict[str, Maker] = {
    "random_walk": lambda people, walkable, robot: RandomWalkPedestrians(people, walkable),
    "social_force": SocialForcePedestrians,
    "replay": lambda people, walkable, robot: ReplayPedestrians(people, walkable),
}


def make_pedestrians(
    people: PedestrianParams,
    walkable: OccupancyGrid,
    robot: RobotParams,
) -> PedestrianModel:
    """The people of a world, to be reset.

    Args:
        people: which model, and its parameters.
        walkable: FREE where people may be.
        robot: among whom they walk.

    Raises:
        InputError: nothing is walkable, or a recording cannot be used.
    """
    return PEDESTRIAN_MODELS[people.model](people, walkable, robot)
