"""The parameters of a camera: ``policy.camera`` in a stack file."""

import math
from dataclasses import dataclass

from navstack.errors import ParameterError

MOST_PIXELS = 2048  # per side
MOST_RANGE = 500.0  # [m]


@dataclass(frozen=True, slots=True)
class CameraParams:
    """A colour camera, without noise or distortion, fixed to the robot.

    None unless it has pixels.
    """

    width: int = 0  # [pixels]
    height: int = 0  # [pixels]
    fov: float = 1.2  # [rad] from left to right
    position: tuple[float, float, float] = (0.3, 0.0, 1.0)  # [m] base frame
    pitch: float = 0.0  # [rad] downwards
    range: float = 40.0  # [m] beyond which nothing is drawn

    def __post_init__(self) -> None:
        """Check what the types cannot.

        Raises:
            ParameterError: a value out of range.
        """
        for name in ("width", "height"):
            if not 0 <= getattr(self, name) <= MOST_PIXELS:
                raise ParameterError(
                    f"camera: {name} {getattr(self, name)}; allowed is 0 to {MOST_PIXELS} pixels"
                )
        if (self.width == 0) != (self.height == 0):
            raise ParameterError("camera: give width and height, or neither")
        if not 0.0 < self.fov < math.pi:
            raise ParameterError(
                f"camera: fov {self.fov}; allowed is more than 0 and less than pi [rad]"
            )
        if not abs(self.pitch) < 0.5 * math.pi:
            raise ParameterError(f"camera: pitch {self.pitch}; allowed is -pi/2 to pi/2 [rad]")
        if not 1.0 <= self.range <= MOST_RANGE:
            raise ParameterError(f"camera: range {self.range}; allowed is 1 to {MOST_RANGE:g} m")
        if not all(abs(each) <= 10.0 for each in self.position):
            raise ParameterError(
                f"camera: position {list(self.position)}; allowed is up to 10 m from the base"
            )

    @property
    def is_there(self) -> bool:
        """Whether there is one."""
        return self.width > 0
