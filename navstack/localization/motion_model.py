"""AMCL's motion models: where particles may be after the odometry reports a motion."""

import math
from collections.abc import Callable

from navstack.jit import njit
from navstack.params.amcl import MOTION_MODELS, AmclParams
from navstack.types import FloatArray, FloatMatrix, Pose2D

# [m] of a motion that has a direction; below it the robot is taken to turn on the spot
SHORTEST_BEARING = 0.01

Alphas = tuple[float, float, float, float, float]
MotionModel = Callable[[FloatArray, Pose2D, Pose2D, FloatArray], None]  # see motion_model_of


@njit(inline="always")
def _wrap(angle: float) -> float:
    """The same angle in [-pi, pi)."""
    return (angle + math.pi) % (2.0 * math.pi) - math.pi


@njit(inline="always")
def _off_axis(angle: float) -> float:
    """How far an angle is from straight ahead or straight back, whichever is nearer, in [rad]."""
    ahead = abs(_wrap(angle))
    return min(ahead, math.pi - ahead)


@njit(ahead=True)
def move_differential(
    poses: FloatMatrix,
    yaw: float,
    dx: float,
    dy: float,
    yaw_after: float,
    alphas: Alphas,
    draws: FloatMatrix,
) -> None:
    """Move particles (N, 3) by noisy rotation, translation, rotation, in place.

    As ``differential_motion_model.cpp``.
    Driving backwards is as noisy as driving forwards. ``alpha5`` is not used.

    Args:
        poses: x, y [m], yaw [rad] in the map frame.
        yaw: [rad] of the robot in the odom frame before the motion.
        dx: [m] that it moved in the odom frame.
        dy: [m].
        yaw_after: [rad].
        alphas: of the noise.
        draws: (N, 3) standard normal numbers: first rotation, translation, second rotation.
    """
    distance = math.sqrt(dx * dx + dy * dy)
    first = 0.0
    if distance >= SHORTEST_BEARING:
        first = _wrap(math.atan2(dy, dx) - yaw)
    second = _wrap(_wrap(yaw_after - yaw) - first)
    squared = distance * distance
    off_first, off_second = _off_axis(first) ** 2, _off_axis(second) ** 2
    first_std = math.sqrt(alphas[0] * off_first + alphas[1] * squared)
    distance_std = math.sqrt(alphas[2] * squared + alphas[3] * off_first + alphas[3] * off_second)
    second_std = math.sqrt(alphas[0] * off_second + alphas[1] * squared)
    for j in range(len(poses)):
        turn = _wrap(first - first_std * draws[j, 0])
        length = distance - distance_std * draws[j, 1]
        poses[j, 0] += length * math.cos(poses[j, 2] + turn)
        poses[j, 1] += length * math.sin(poses[j, 2] + turn)
        poses[j, 2] += turn + _wrap(second - second_std * draws[j, 2])


@njit()
def move_omni(
    poses: FloatArray,
    yaw: float,
    dx: float,
    dy: float,
    yaw_after: float,
    alphas: Alphas,
    draws: FloatArray,
) -> None:
    """Move particles (N, 3) by noisy translation and rotation in place (``omni_motion_model.cpp``).

    Args:
        poses: x, y [m], yaw [rad] in the map frame.
        yaw: [rad] of the robot in the odom frame before the motion.
        dx: [m] that it moved in the odom frame.
        dy: [m].
        yaw_after: [rad].
        alphas: of the noise.
        draws: (N, 3) standard normal numbers: along the translation, rotation, across the
            translation.
    """
    turn = _wrap(yaw_after - yaw)
    distance, bearing = math.sqrt(dx * dx + dy * dy), _wrap(math.atan2(dy, dx) - yaw)
    squared, turned = distance * distance, turn * turn
    along_std = math.sqrt(alphas[2] * squared + alphas[3] * turned)
    turn_std = math.sqrt(alphas[0] * turned + alphas[1] * squared)
    across_std = math.sqrt(alphas[3] * turned + alphas[4] * squared)
    for j in range(len(poses)):
        cos, sin = math.cos(bearing + poses[j, 2]), math.sin(bearing + poses[j, 2])
        along, across = distance + along_std * draws[j, 0], across_std * draws[j, 2]
        poses[j, 0] += along * cos + across * sin
        poses[j, 1] += along * sin - across * cos
        poses[j, 2] += turn + turn_std * draws[j, 1]


_KERNELS = {
    "nav2_amcl::DifferentialMotionModel": move_differential,
    "nav2_amcl::OmniMotionModel": move_omni,
}
_KERNELS |= {older: _KERNELS[name] for name, older in MOTION_MODELS.items()}


def motion_model_of(params: AmclParams) -> MotionModel:
    """The motion model that the parameters name.

    It moves particles (N, 3) of the map frame in place, given the robot's pose in the odom frame
    before and now, and standard normal numbers (N, 3); each particle has an error of its own.
    """
    alphas = (params.alpha1, params.alpha2, params.alpha3, params.alpha4, params.alpha5)
    kernel = _KERNELS[params.robot_model_type]

    def move(poses: FloatArray, before: Pose2D, after: Pose2D, draws: FloatArray) -> None:
        kernel(poses, before.yaw, after.x - before.x, after.y - before.y, after.yaw, alphas, draws)

    return move
