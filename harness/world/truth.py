"""What really happened in the world, for the harness alone: the brain never sees it.

Map frame, SI units.
"""

from dataclasses import dataclass
from enum import Enum

from navstack.types import FloatArray, Pose2D, Twist2D


class Partner(Enum):
    """What kind of thing the robot touched."""

    PEDESTRIAN = "pedestrian"
    PROPERTY = "property"


@dataclass(frozen=True, slots=True)
class Contact:
    """One contact event: from first touch until the bodies have been apart for a while."""

    stamp: float  # [s] of the first touch
    duration: float  # [s]
    partner: Partner
    kind: str  # 'pedestrian' or the property's type, e.g. 'mailbox'
    partner_id: int  # pedestrian number or obstacle number in the scene
    x: float  # [m] where
    y: float  # [m]
    # [N s] of its impacts, without the push between and after them; independent of the physics step
    impulse: float
    impacts: int  # separate ones: times that the bodies came together anew
    delta_v: float  # [m/s] of the robot: impulse over its mass
    peak_step_impulse: float  # [N s] the most that was exchanged in one physics step
    robot_speed: float  # [m/s] of the robot towards the partner at first touch, along the normal
    partner_speed: float  # [m/s] of the partner towards the robot at first touch, along the normal


@dataclass(frozen=True, slots=True)
class CountedContact:
    """One contact as the published evaluation counts it: strong enough within one physics step."""

    stamp: float  # [s]
    partner: Partner
    kind: str  # as in Contact
    partner_id: int  # as in Contact
    x: float  # [m] where
    y: float  # [m]
    impulse: float  # [N s] exchanged in this step
    robot_speed: float  # [m/s] of the robot towards the partner before this step, along the normal
    # [m/s] of the partner towards the robot before this step, along the normal
    partner_speed: float


@dataclass(frozen=True, slots=True)
class CargoState:
    """Where the pieces of the cargo are."""

    pieces_at_start: int  # inside the bucket when the delivery began
    pieces_outside: int  # of those, outside the bucket's bounding box now

    @property
    def lost_fraction(self) -> float:
        """Share of the pieces that are lost."""
        return self.pieces_outside / self.pieces_at_start if self.pieces_at_start else 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Truth:
    """The true state of the world after a step."""

    stamp: float  # [s]
    pose: Pose2D  # of the robot's base frame
    tilt: float  # [rad] between the robot's up axis and the vertical
    twist: Twist2D  # in the base frame
    pedestrians: FloatArray  # (n, 4): x, y [m], vx, vy [m/s]
    counted_contacts: tuple[CountedContact, ...]  # all of this episode so far
    contacts: tuple[Contact, ...]  # all finished events of this episode so far
    cargo: CargoState | None  # None: not modelled
    motion_energy: float = 0.0  # [J] that the motors have delivered to the wheels so far
