"""The parameters of a camera: ``policy.camera`` in a stack file."""

import math
from dataclasses import dataclass
from typing import Annotated

from navstack.errors import ParameterError
from navstack.ranges import Allowed, Parameters, within

MOST_PIXELS = 2048  # per side
MOST_RANGE = 500.0  # [m]
MOST_OFFSET = 10.0  # [m] from the base along each axis
Pixels = Annotated[int, within(0, MOST_PIXELS)]
FieldOfView = Annotated[
    float, Allowed("more than 0 and less than pi [rad]", lambda angle: 0.0 < angle < math.pi)
]
Pitch = Annotated[float, Allowed("-pi/2 to pi/2 [rad]", lambda angle: abs(angle) < 0.5 * math.pi)]
Position = Annotated[
    tuple[float, float, float],
    Allowed("up to 10 m from the base", lambda three: max(map(abs, three)) <= MOST_OFFSET),
]


@dataclass(frozen=True, slots=True)
class CameraParams(Parameters, whose="camera"):
    """A colour camera, without noise or distortion, fixed to the robot.

    None unless it has pixels.
    """

    width: Pixels = 0  # [pixels]
    height: Pixels = 0  # [pixels]
    fov: FieldOfView = 1.2  # [rad] from left to right
    position: Position = (0.3, 0.0, 1.0)  # [m] base frame
    pitch: Pitch = 0.0  # [rad] downwards
    range: Annotated[float, within(1, MOST_RANGE)] = 40.0  # [m] beyond which nothing is drawn

    def _check_together(self) -> None:
        if (self.width == 0) != (self.height == 0):
            raise ParameterError("camera: give width and height, or neither")

    @property
    def is_there(self) -> bool:
        """Whether there is one."""
        return self.width > 0
