"""The robot's body: what it weighs, how big it is, what its drive can do."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

from navstack.errors import ParameterError
from navstack.geometry import crosses_itself, make_footprint
from navstack.ranges import Known, NotNegative, Parameters, Quantity, up_to, within
from navstack.types import FloatArray

MAX_CORNERS, MAX_SIZE = 1000, 10.0  # of the footprint, [m] of the body
MOST_HALVES = 4.0  # of the body's size, in a wheelbase or a track
MOST_SHOWN = 8  # corners in a complaint
DIFFERENTIAL, SKID = "differential", "skid"
# a mass, length, speed, ...; what is larger is no robot
Size = Annotated[float, up_to(1e5)]


@dataclass(frozen=True)
class RobotParams(Parameters, whose="robot"):
    """A drive with a box for a body: one file of ``params/robots``.

    The base frame's origin is on the ground. A differential drive has it below the middle of the
    driven axle, and two casters follow behind, or go in front. A skid steer has it in the middle of
    four driven wheels.
    """

    footprint: tuple[tuple[float, float], ...]  # [m] base frame; the body is its bounding box
    mass: Size  # [kg]
    height: Size  # [m] of the body
    center_of_mass_x: float  # [m] base frame; between casters and axle
    center_of_mass_height: Size  # [m] above ground
    foot_radius: Size  # [m] of the spheres that stand for the treads of wheels and casters
    ground_clearance: Size  # [m] below the body
    wheel_radius: Size  # [m] of the driven wheels
    track: Size  # [m] between the driven wheels
    # [m] from the driven axle, or the front wheels, back to the casters or wheels; negative: the
    # casters are in front of the axle
    wheelbase: Quantity
    caster_track: Size  # [m] between the casters; of a skid steer nothing
    wheel_friction: NotNegative  # [-] Coulomb coefficient of the driven wheels on the ground
    rolling_resistance: NotNegative  # [-] force that rolling costs over the weight
    max_speed: Size  # [m/s]
    max_yaw_rate: Size  # [rad/s]
    max_acceleration: Size  # [m/s2] speeding up
    max_deceleration: Size  # [m/s2] slowing down
    max_yaw_acceleration: Size  # [rad/s2]
    max_wheel_torque: Size  # [N m] of each driven wheel
    servo_time_constant: Size  # [s] of the wheel speed loop
    body_friction: NotNegative  # [-] Coulomb coefficient of the body against what it touches
    bucket: tuple[float, float, float]  # [m] centre of the bucket's floor, base frame
    # [s] from an observation to the drive's hearing the command that was decided on it
    compute_latency: NotNegative = 0.0
    steering: Annotated[str, Known("robot: steering", (DIFFERENTIAL, SKID))] = DIFFERENTIAL
    # [-] of a skid steer's controller: the track that it counts on, over the real one
    track_multiplier: Annotated[float, within(1.0, 5.0)] = 1.0

    def _check_together(self) -> None:
        if len(self.footprint) > MAX_CORNERS:
            raise ParameterError(
                f"robot: footprint has {len(self.footprint)} corners; "
                f"at most {MAX_CORNERS} are read"
            )
        if crosses_itself(self.polygon):
            raise ParameterError(
                f"robot: footprint {[list(each) for each in self.footprint[:MOST_SHOWN]]} crosses "
                "itself; give its corners in order around the robot"
            )
        half_length, half_width = self.half_size
        if not 0.01 <= min(half_length, half_width) <= max(half_length, half_width) <= MAX_SIZE:
            raise ParameterError(
                f"robot: footprint reaches {half_length} m lengthwise and {half_width} m sideways "
                f"from its middle; allowed are 0.01 to {MAX_SIZE:g} m"
            )
        if not all(abs(part) <= MAX_SIZE for part in self.bucket):
            raise ParameterError(
                f"robot: bucket {list(self.bucket)} m; "
                f"allowed is up to {MAX_SIZE:g} m off the base frame"
            )
        self._check_sizes()
        if not max(self.center_of_mass_height, self.ground_clearance) < self.height:
            raise ParameterError(
                f"robot: height {self.height} m must exceed center_of_mass_height "
                f"{self.center_of_mass_height} m and ground_clearance {self.ground_clearance} m"
            )
        (front, _), *_, (back, _) = self.feet
        rear, front = sorted((back, front))
        if not rear < self.center_of_mass_x < front:
            raise ParameterError(
                f"robot: center_of_mass_x {self.center_of_mass_x} m; allowed is between "
                f"{rear:g} m and {front:g}, where it stands, or the robot falls over"
            )

    def _check_sizes(self) -> None:
        """Refuse wheels that are larger than the robot, as of lengths in millimetres."""
        half_length, half_width = self.half_size
        longest = MOST_HALVES * half_length
        is_right = 0.0 < abs(self.wheelbase) <= longest
        self._require("wheelbase", is_right, f"other than 0, and up to {longest:g} m long")
        if self.steering == SKID:
            self._require("wheelbase", self.wheelbase > 0.0, "more than 0 of a skid steer")
        widest = MOST_HALVES * half_width
        for name in ("track", "caster_track"):
            self._require(
                name, getattr(self, name) <= widest, f"at most {widest:g} m, twice the body"
            )
        highest = max(half_length, half_width)
        for name in ("wheel_radius", "foot_radius"):
            self._require(
                name, getattr(self, name) <= highest, f"at most {highest:g} m, half the body"
            )
        self._require("bucket", self.bucket[2] >= 0.0, "at 0 m above the ground or higher")

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
        """The centre of mass in [m], base frame; sideways it is between the wheels."""
        return self.center_of_mass_x, 0.0, self.center_of_mass_height

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
        if self.steering == SKID:
            return 1.0
        return 1.0 + self.center_of_mass_x / self.wheelbase

    @cached_property
    def feet(self) -> tuple[tuple[float, float], ...]:
        """Where the robot stands, (x, y) in [m], base frame.

        Left and right wheel, left and right caster; of a skid steer the front and the rear wheels.
        """
        if self.steering == SKID:
            half, side = 0.5 * self.wheelbase, 0.5 * self.track
            return (half, side), (half, -side), (-half, side), (-half, -side)
        wheel, caster = 0.5 * self.track, 0.5 * self.caster_track
        return (0.0, wheel), (0.0, -wheel), (-self.wheelbase, caster), (-self.wheelbase, -caster)
