"""The parameters of people's bodies: ``pedestrian_bodies`` in a file of ``params/worlds``."""

from dataclasses import dataclass

from harness.world.ranges import check_ranges
from navstack.errors import ParameterError, UnknownNameError

PEDESTRIAN_BODIES = ("kinematic", "dynamic")
FRICTION_RULES = ("multiply", "average")
MAX_FRAME_STEPS = 120  # physics steps per rendered frame


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
