"""What algorithms answer, checked where it is taken: those of other packages may answer anything.

What is no answer would else drive on as standstill, or as a cost that no trajectory undercuts.
"""

import math
from typing import TypeGuard

import numpy as np

from navstack.errors import NoPathFoundError, PluginError
from navstack.types import Belief, FloatArray, Path, Twist2D


def is_command(command: object) -> TypeGuard[Twist2D]:
    """Whether something is a Twist2D of finite numbers."""
    if not isinstance(command, Twist2D):
        return False
    try:
        return all(map(math.isfinite, (command.linear_x, command.linear_y, command.angular_z)))
    except TypeError:
        return False


def checked_command(command: object, controller: object) -> Twist2D:
    """A controller's command.

    Raises:
        PluginError: it is no Twist2D of finite numbers.
    """
    if is_command(command):
        return command
    raise PluginError(_refusal(controller, command, "a Twist2D of finite numbers"))


def checked_costs(costs: object, count: int, critic: object) -> FloatArray:
    """A critic's raw costs of ``count`` trajectories, (count,).

    Raises:
        PluginError: they are not as many numbers of 0 or more.
    """
    numbers = np.asarray(costs)
    if numbers.shape == (count,) and numbers.dtype.kind in "fiu" and (numbers >= 0.0).all():
        return numbers
    what = f"{count} numbers of 0 or more, inf where a trajectory is not allowed"
    raise PluginError(_refusal(critic, costs, what))


def checked_belief(belief: object, localizer: object) -> Belief:
    """A localizer's belief.

    Raises:
        PluginError: it is no Belief of finite numbers.
    """
    if isinstance(belief, Belief):
        pose, covariance = belief.pose, np.asarray(belief.covariance)
        is_place = all(map(math.isfinite, (pose.x, pose.y, pose.yaw)))
        if is_place and covariance.shape == (3, 3) and covariance.dtype.kind in "fiu":
            flat = covariance.ravel()
            if math.isfinite(flat.dot(flat)):  # every tick: a third of what np.isnan takes
                return belief
    raise PluginError(_refusal(localizer, belief, "a Belief of finite numbers, covariance (3, 3)"))


def checked_plan(plan: object, planner: object) -> Path:
    """A planner's path.

    Raises:
        NoPathFoundError: it has no poses.
        PluginError: it is no Path of finite poses (N, 3).
    """
    if isinstance(plan, Path):
        poses = np.asarray(plan.poses)
        if poses.ndim == 2 and poses.shape[1] == 3 and np.isfinite(poses).all():
            if len(poses) == 0:
                raise NoPathFoundError(f"{type(planner).__name__} answered a path without poses")
            return plan
    raise PluginError(_refusal(planner, plan, "a Path of finite poses (N, 3)"))


def _refusal(source: object, answer: object, what: str) -> str:
    given = " ".join(repr(answer).split())
    return f"{type(source).__name__} answered {given[:200]}; it has to answer {what}"
