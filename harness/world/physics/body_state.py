"""The true motion of the robot's body, which the physics hands to the sensors."""

from typing import NamedTuple


class BodyState(NamedTuple):
    """True motion of the robot's base frame at one instant; made every tick, hence a tuple."""

    x: float = 0.0  # [m] map frame
    y: float = 0.0  # [m] map frame
    yaw: float = 0.0  # [rad] map frame
    vx: float = 0.0  # [m/s] base frame, forward
    vy: float = 0.0  # [m/s] base frame, to the left; nonzero while the robot slides
    yaw_rate: float = 0.0  # [rad/s]
    ax: float = 0.0  # [m/s2] base frame, of the base origin, without gravity
    ay: float = 0.0  # [m/s2] base frame
    tilt: float = 0.0  # [rad] between the robot's up axis and the vertical
