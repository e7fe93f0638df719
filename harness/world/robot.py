"""The robot's body: what it weighs, how big it is, what its drive can do."""

from dataclasses import dataclass
from functools import cached_property

from navstack.errors import ParameterError
from navstack.geometry import make_footprint
from navstack.types import FloatArray

_POSITIVE = (
    *("mass", "height", "center_of_mass_height", "foot_radius", "ground_clearance", "track", "max_speed"),
    *("max_yaw_rate", "max_acceleration", "max_deceleration", "max_yaw_acceleration", "max_drive_force"),
    "servo_time_constant",
)


@dataclass(frozen=True)
class RobotParams:
    """A differential drive with a box for a body: one file of ``params/robots``."""

    footprint: tuple[tuple[float, float], ...]  # [m] base frame; the body is its bounding box
    mass: float  # [kg]
    height: float  # [m] of the body
    center_of_mass_height: float  # [m] above ground; along x and y it is the body's centre
    foot_radius: float  # [m] of the four feet at the body's corners
    ground_clearance: float  # [m] below the body
    track: float  # [m] between the driven wheels
    wheel_friction: float  # [-] Coulomb coefficient of the driven wheels on the ground
    max_speed: float  # [m/s]
    max_yaw_rate: float  # [rad/s]
    max_acceleration: float  # [m/s2] speeding up
    max_deceleration: float  # [m/s2] slowing down
    max_yaw_acceleration: float  # [rad/s2]
    max_drive_force: float  # [N] of both driven wheels together
    servo_time_constant: float  # [s] of the wheel speed loop
    body_friction: float  # [-] Coulomb coefficient of the body against what it touches
    bucket: tuple[float, float, float]  # [m] centre of the bucket's floor, base frame

    def __post_init__(self) -> None:
        """Check what the types cannot.

        Raises:
            ParameterError: a value out of range.
        """
        make_footprint(self.footprint)
        for name in _POSITIVE:
            if not getattr(self, name) > 0.0:
                raise ParameterError(f"robot: {name} {getattr(self, name)}; allowed is more than 0")
        for name in ("wheel_friction", "body_friction"):
            if getattr(self, name) < 0.0:
                raise ParameterError(f"robot: {name} {getattr(self, name)}; allowed is 0 or more")
        if not max(self.center_of_mass_height, self.ground_clearance) < self.height:
            raise ParameterError(
                f"robot: height {self.height} m must exceed center_of_mass_height {self.center_of_mass_height} m "
                f"and ground_clearance {self.ground_clearance} m"
            )

    @cached_property
    def polygon(self) -> FloatArray:
        """The footprint as an array (N, 2) in [m], base frame."""
        return make_footprint(self.footprint)

    @cached_property
    def half_size(self) -> tuple[float, float]:
        """Half length and half width of the body in [m]."""
        length, width = self.polygon.max(axis=0) - self.polygon.min(axis=0)
        return 0.5 * float(length), 0.5 * float(width)

    @cached_property
    def center(self) -> tuple[float, float]:
        """The body's centre, which is above the centre of mass, in [m], base frame."""
        x, y = 0.5 * (self.polygon.max(axis=0) + self.polygon.min(axis=0))
        return float(x), float(y)

    @cached_property
    def inertia(self) -> tuple[float, float, float]:
        """Principal moments of inertia in [kg m2]: those of a uniform box of the body's size (textbook)."""
        a, b = self.half_size
        length2, width2, height2 = (2.0 * a) ** 2, (2.0 * b) ** 2, self.height**2
        k = self.mass / 12.0
        return k * (width2 + height2), k * (length2 + height2), k * (length2 + width2)
