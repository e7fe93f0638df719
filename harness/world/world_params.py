"""The parameters of the simulated world: one file of ``params/worlds``."""

import math
from dataclasses import dataclass

from harness.world.people.pedestrian_params import PedestrianParams
from harness.world.sensors.ranges import POSITIVE, check_ranges
from navstack.errors import ParameterError, UnknownNameError

PEDESTRIAN_BODIES = ("kinematic", "dynamic")
COUNTED_PER = ("partner", "point")
FRICTION_RULES = ("multiply", "average")
BUCKETS = ("fixed", "free")
_PHYSICS = {  # more steps and iterations would never end
    "rate": (60.0, 10_000.0),
    "gravity": (POSITIVE, 100.0),
    "contact_erp": (0.0, 0.2),
    "solver_iterations": (1, 1000),
}
MAX_FRAME_STEPS = 120  # physics steps per rendered frame
MAX_PIECES = 1000  # of cargo


@dataclass(frozen=True, slots=True)
class PhysicsParams:
    """How the physics is integrated."""

    rate: float = 120.0  # [Hz] physics steps, published
    gravity: float = 9.81  # [m/s2]
    # [-] share of a penetration removed per step; adds at most this share to an impulse
    contact_erp: float = 0.01
    solver_iterations: int = 50  # of the contact solver per step

    def __post_init__(self) -> None:
        """Check what the types cannot.

        Raises:
            ParameterError: a value out of range.
        """
        check_ranges("physics", self, within=_PHYSICS)


@dataclass(frozen=True, slots=True)
class PedestrianBodyParams:
    """How people's bodies behave when the robot touches them."""

    # 'kinematic': walks on whatever it hits (published); 'dynamic': is pushed away
    kind: str = "kinematic"
    mass: float = 75.0  # [kg] of a dynamic body
    # [N] at most, with which a dynamic body keeps to its way; about a quarter of its weight
    push_force: float = 200.0
    friction: float = 0.5  # [-] Coulomb coefficient of clothes
    # with the robot's: 'multiply' (Bullet's rule) or 'average' (PhysX's default)
    friction_combine: str = "multiply"
    # physics steps per rendered frame: a kinematic body makes a frame's way in the first of them
    frame_steps: int = 1
    max_contact_impulse: float = 0.0  # [N s] of one contact point in one physics step; 0: no limit
    # [m/s] at most, at which bodies that overlap part; 0: by contact_erp alone
    max_depenetration_speed: float = 0.0

    def __post_init__(self) -> None:
        """Check what the types cannot.

        Raises:
            ParameterError: a value out of range.
        """
        if self.kind not in PEDESTRIAN_BODIES:
            raise UnknownNameError("kind of pedestrian body", self.kind, PEDESTRIAN_BODIES)
        if self.friction_combine not in FRICTION_RULES:
            raise UnknownNameError(
                "pedestrian_bodies: friction_combine", self.friction_combine, FRICTION_RULES
            )
        if not 1 <= self.frame_steps <= MAX_FRAME_STEPS or (
            self.frame_steps > 1 and self.kind != "kinematic"
        ):
            raise ParameterError(
                f"pedestrian_bodies: frame_steps {self.frame_steps} of {self.kind} bodies; "
                f"allowed is 1 to {MAX_FRAME_STEPS}, and more than 1 for kinematic bodies only"
            )
        check_ranges(
            "pedestrian_bodies",
            self,
            positive="mass push_force",
            not_negative="friction max_contact_impulse max_depenetration_speed",
        )


@dataclass(frozen=True, slots=True)
class ContactParams:
    """What is a counted contact and what one contact event."""

    counted_impulse: float = 50.0  # [N s] in one step, from which it counts; published
    # what must reach it: 'partner': all its points together; 'point': one of them, as published
    per: str = "partner"
    # contact reports (steps with contact) after a counted one during which nothing counts; publ.
    cool_down: int = 30
    impact_speed: float = 0.05  # [m/s] closing speed up to which bodies touch without impact
    separation_time: float = 0.25  # [s] apart after which an event has ended

    def __post_init__(self) -> None:
        """Check what the types cannot.

        Raises:
            ParameterError: a value out of range.
            UnknownNameError: an unknown ``per``.
        """
        if self.per not in COUNTED_PER:
            raise UnknownNameError("contacts: per", self.per, COUNTED_PER)
        check_ranges(
            "contacts", self, not_negative="counted_impulse cool_down impact_speed separation_time"
        )


@dataclass(frozen=True, slots=True)
class CargoParams:
    """The popcorn and its bucket, an open box with a square floor.

    :mod:`harness.world.cargo.cargo` says what is assumed.
    """

    pieces: int = 50  # published; 0: no cargo
    piece_mass: float = 0.001  # [kg] published
    # [-] share of the bucket's volume below the settled pieces' mean surface; published
    fill: float = 0.6
    piece_radius: float = 0.0154  # [m] about that of popped corn; assumed
    bucket_width: float = 0.12  # [m] inside; assumed
    # [-] share of the filled volume that is pieces: loose random packing between near walls
    packing: float = 0.59
    friction: float = 0.5  # [-] Coulomb coefficient between pieces and with the cardboard; assumed
    # [-] of speed kept in a bounce between pieces and off the walls; assumed
    restitution: float = 0.3
    # [-] of a piece's radius; stands for the irregular shape; assumed
    rolling_friction: float = 0.05
    # [m/s2] of the bucket from which pieces are simulated; below friction times gravity
    wake_acceleration: float = 4.5
    settle_time: float = 0.5  # [s] below it after which they rest again
    # 'fixed' to the robot; 'free': stands loose on it, as the published code spawns it
    bucket: str = "fixed"
    bucket_mass: float = 0.05  # [kg] of a free one: cardboard; assumed
    # [-] Coulomb coefficient of a free one on the robot; PhysX's default
    bucket_friction: float = 0.5

    def __post_init__(self) -> None:
        """Check what the types cannot.

        Raises:
            ParameterError: a value out of range.
            UnknownNameError: an unknown ``bucket``.
        """
        if self.bucket not in BUCKETS:
            raise UnknownNameError("cargo: bucket", self.bucket, BUCKETS)
        check_ranges(
            "cargo",
            self,
            positive="bucket_mass piece_mass piece_radius bucket_width wake_acceleration settle_time",
            not_negative="bucket_friction friction rolling_friction restitution",
            within={
                "pieces": (0, MAX_PIECES),
                "fill": (POSITIVE, 1.0),
                "packing": (POSITIVE, 0.74),
            },
        )
        if self.bucket_width < 2.0 * self.piece_radius:
            raise ParameterError(
                f"cargo: bucket_width {self.bucket_width} m holds no piece of radius {self.piece_radius} m; "
                "allowed is twice the radius or more"
            )

    @property
    def bucket_height(self) -> float:
        """Height [m] of the walls inside: the settled pieces reach up to ``fill`` of it."""
        volume = self.pieces * 4.0 / 3.0 * math.pi * self.piece_radius**3 / self.packing
        return volume / (self.bucket_width**2 * self.fill)


@dataclass(frozen=True, slots=True)
class WorldParams:
    """A whole world: physics, people, contacts and cargo."""

    physics: PhysicsParams = PhysicsParams()
    people: PedestrianParams = PedestrianParams()
    pedestrian_bodies: PedestrianBodyParams = PedestrianBodyParams()
    contacts: ContactParams = ContactParams()
    cargo: CargoParams = CargoParams()
