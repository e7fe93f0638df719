"""The critics that a parameter file names."""

from collections.abc import Callable

from navstack.control.mppi.critic import Critic
from navstack.control.mppi.motion_critics import (
    ConstraintCritic,
    PreferForwardCritic,
    TwirlingCritic,
    VelocityDeadbandCritic,
)
from navstack.control.mppi.obstacle_critics import CostCritic, ObstaclesCritic
from navstack.control.mppi.path_critics import (
    GoalAngleCritic,
    GoalCritic,
    PathAlignCritic,
    PathAngleCritic,
    PathFollowCritic,
)
from navstack.params.mppi import MppiParams
from navstack.types import FloatArray

_BY_PARAMS: dict[str, Callable[[str, MppiParams], Critic]] = {
    "ConstraintCritic": ConstraintCritic,
    "GoalAngleCritic": GoalAngleCritic,
    "GoalCritic": GoalCritic,
    "PathAlignCritic": PathAlignCritic,
    "PathAngleCritic": PathAngleCritic,
    "PathFollowCritic": PathFollowCritic,
    "PreferForwardCritic": PreferForwardCritic,
    "VelocityDeadbandCritic": VelocityDeadbandCritic,
}


def build_critics(params: MppiParams, footprint: FloatArray, xy_goal_tolerance: float) -> list[Critic]:
    """The enabled critics in the file's order.

    Args:
        params: which critics, and theirs.
        footprint: padded polygon (V, 2) in [m], base frame.
        xy_goal_tolerance: of the goal checker in [m].
    """
    critics: list[Critic] = []
    for name in params.critics:
        if not getattr(params, name).enabled:
            continue
        if name == "CostCritic":
            critics.append(CostCritic(name, params, footprint))
        elif name == "ObstaclesCritic":
            critics.append(ObstaclesCritic(name, params, footprint))
        elif name == "TwirlingCritic":
            critics.append(TwirlingCritic(name, params, xy_goal_tolerance))
        else:
            critics.append(_BY_PARAMS[name](name, params))
    return critics
