"""DWB's critics by the names of Nav2, one file each."""

from collections.abc import Callable
from typing import Any

from navstack.control.dwb.critics.align import GoalAlignCritic, PathAlignCritic
from navstack.control.dwb.critics.base_obstacle import BaseObstacleCritic
from navstack.control.dwb.critics.critic import Critic
from navstack.control.dwb.critics.dist import GoalDistCritic, PathDistCritic
from navstack.control.dwb.critics.obstacle_footprint import ObstacleFootprintCritic
from navstack.control.dwb.critics.oscillation import OscillationCritic
from navstack.control.dwb.critics.prefer_forward import PreferForwardCritic
from navstack.control.dwb.critics.rotate_to_goal import RotateToGoalCritic
from navstack.control.dwb.critics.twirling import TwirlingCritic
from navstack.errors import UnknownNameError
from navstack.params.dwb import DwbParams
from navstack.params.extensions import with_extensions

CRITICS: dict[str, Callable[[Any, DwbParams], Critic]] = {
    "BaseObstacle": BaseObstacleCritic,
    "GoalAlign": GoalAlignCritic,
    "GoalDist": GoalDistCritic,
    "ObstacleFootprint": ObstacleFootprintCritic,
    "Oscillation": OscillationCritic,
    "PathAlign": PathAlignCritic,
    "PathDist": PathDistCritic,
    "PreferForward": PreferForwardCritic,
    "RotateToGoal": RotateToGoalCritic,
    "Twirling": TwirlingCritic,
}


def build_critics(params: DwbParams) -> dict[str, Critic]:
    """The critics that ``params.critics`` names, in its order.

    A name may carry one of the default namespaces and the suffix ``Critic``, as in ``dwb_critics::PathDistCritic``, or
    be one of ``params.named_critics``.

    Raises:
        UnknownNameError: a name stands for no critic.
    """
    critics, table = {}, with_extensions("dwb_critics", CRITICS)
    for given in params.critics:
        if given in params.named_critics:
            named = params.named_critics[given]
            critics[given] = table[named.type](named.params, params)
            continue
        namespace, _, bare = given.rpartition("::")
        name = bare.removesuffix("Critic")
        if name not in CRITICS or (namespace and namespace not in params.default_critic_namespaces):
            raise UnknownNameError("critic", given, CRITICS)
        critics[name] = CRITICS[name](getattr(params, name), params)
    return critics
