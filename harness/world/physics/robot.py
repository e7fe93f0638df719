"""The robot's body: what it weighs, how big it is, what its drive can do."""

import math
from dataclasses import dataclass
from functools import cached_property

from harness.world.ranges import POSITIVE, check_ranges
from navstack.errors import ParameterError
from navstack.geometry import make_footprint
from navstack.types import FloatArray

_POSITIVE = (
    "mass height center_of_mass_height foot_radius ground_clearance wheel_radius track wheelbase "
    "caster_track max_speed max_yaw_rate max_acceleration max_deceleration max_yaw_acceleration "
    "max_wheel_torque servo_time_constant"
)
_NOT_NEGATIVE = "wheel_friction body_friction rolling_resistance compute_latency"
MAX_CORNERS, MAX_SIZE = 1000, 10.0  # of the footprint, [m] of the body
MAX_VALUE = 1e5  # of a mass, length, speed, ...; what is larger is no robot


@dataclass(frozen=True)
class RobotParams:
    """A differential drive with a box for a body: one file of ``params/robots``.

    The base frame's origin is on the ground below the middle of the driven axle; two casters follow
    behind it.
    """

    footprint: tuple[tuple[float, float], ...]  # [m] base frame; the body is its bounding box
    mass: float  # [kg]
    height: float  # [m] of the body
    center_of_mass_x: float  # [m] base frame; between casters and axle
    center_of_mass_height: float  # [m] above ground
    foot_radius: float  # [m] of the spheres that stand for the treads of wheels and casters
    ground_clearance: float  # [m] below the body
    wheel_radius: float  # [m] of the driven wheels
    track: float  # [m] between the driven wheels
    wheelbase: float  # [m] from the driven axle back to the casters
    caster_track: float  # [m] between the casters
    wheel_friction: float  # [-] Coulomb coefficient of the driven wheels on the ground
    rolling_resistance: float  # [-] force that rolling costs over the weight
    max_speed: float  # [m/s]
    max_yaw_rate: float  # [rad/s]
    max_acceleration: float  # [m/s2] speeding up
    max_deceleration: float  # [m/s2] slowing down
    max_yaw_acceleration: float  # [rad/s2]
    max_wheel_torque: float  # [N m] of each driven wheel
    servo_time_constant: float  # [s] of the wheel speed loop
    body_friction: float  # [-] Coulomb coefficient of the body against what it touches
    bucket: tuple[float, float, float]  # [m] centre of the bucket's floor, base frame
    # [s] from an observation to the drive's hearing the command that was decided on it
    compute_latency: float = 0.0

    def __post_init__(self) -> None:
        """Check what the types cannot.

        Raises:
            ParameterError: a value out of range.
        """
        if len(self.footprint) > MAX_CORNERS:
            raise ParameterError(
                f"robot: footprint has {len(self.footprint)} corners; at most {MAX_CORNERS} are "
                "read"
            )
        make_footprint(self.footprint)
        if not 0.01 <= min(self.half_size) <= max(self.half_size) <= MAX_SIZE:
            raise ParameterError(
                f"robot: footprint reaches {self.half_size[0]} m lengthwise and "
                f"{self.half_size[1]} m sideways from its middle; allowed are 0.01 to {MAX_SIZE:g} m"
            )
        if not all(abs(part) <= MAX_SIZE for part in self.bucket):
            raise ParameterError(
                f"robot: bucket {list(self.bucket)} m; allowed is up to {MAX_SIZE:g} m off the "
                "base frame"
            )
        limits = dict.fromkeys(_POSITIVE.split(), (POSITIVE, MAX_VALUE))
        check_ranges("robot", self, not_negative=_NOT_NEGATIVE, within=limits)
        if not max(self.center_of_mass_height, self.ground_clearance) < self.height:
            raise ParameterError(
                f"robot: height {self.height} m must exceed center_of_mass_height "
                f"{self.center_of_mass_height} m and ground_clearance {self.ground_clearance} m"
            )
        if not -self.wheelbase < self.center_of_mass_x < 0.0:
            raise ParameterError(
                f"robot: center_of_mass_x {self.center_of_mass_x} m; allowed is between the "
                f"casters at {-self.wheelbase} m and the axle at 0, or the robot falls over"
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
        """The middle of the body in [m], base frame."""
        x, y = 0.5 * (self.polygon.max(axis=0) + self.polygon.min(axis=0))
        return float(x), float(y)

    @cached_property
    def center_of_mass(self) -> tuple[float, float, float]:
        """The centre of mass in [m], base frame; sideways it is the body's middle."""
        return self.center_of_mass_x, self.center[1], self.center_of_mass_height

    @cached_property
    def inertia(self) -> tuple[float, float, float]:
        """Principal moments of inertia in [kg m2].

        Those of a uniform box of the body's size (textbook).
        """
        a, b = self.half_size
        length2, width2, height2 = (2.0 * a) ** 2, (2.0 * b) ** 2, self.height**2
        k = self.mass / 12.0
        return k * (width2 + height2), k * (length2 + height2), k * (length2 + width2)

    @cached_property
    def reach(self) -> float:
        """Distance [m] in the plane from the centre of mass to the farthest corner of the body."""
        (cx, cy), (a, b) = self.center, self.half_size
        x, y, _ = self.center_of_mass
        return math.hypot(a + abs(cx - x), b + abs(cy - y))

    @property
    def max_drive_force(self) -> float:
        """What both motors together can push with, in [N]."""
        return 2.0 * self.max_wheel_torque / self.wheel_radius

    @property
    def axle_share(self) -> float:
        """Share of the weight that the driven wheels carry at rest (law of the lever)."""
        return 1.0 + self.center_of_mass_x / self.wheelbase

    @cached_property
    def feet(self) -> tuple[tuple[float, float], ...]:
        """Where the robot stands, (x, y) in [m], base frame.

        Left and right wheel, left and right caster.
        """
        wheel, caster = 0.5 * self.track, 0.5 * self.caster_track
        return (0.0, wheel), (0.0, -wheel), (-self.wheelbase, caster), (-self.wheelbase, -caster)
