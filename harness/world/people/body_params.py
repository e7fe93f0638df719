"""The parameters of people's bodies: ``pedestrian_bodies`` in a file of ``params/worlds``."""

from dataclasses import dataclass
from typing import Annotated

from navstack.errors import ParameterError
from navstack.ranges import Known, NotNegative, Parameters, Positive

PEDESTRIAN_BODIES = ("kinematic", "dynamic")
FRICTION_RULES = ("multiply", "average")
MAX_FRAME_STEPS = 120  # physics steps per rendered frame


@dataclass(frozen=True, slots=True)
class PedestrianBodyParams(Parameters, whose="pedestrian_bodies"):
    """How people's bodies behave when the robot touches them."""

    # 'kinematic': walks on whatever it hits (published); 'dynamic': is pushed away
    kind: Annotated[str, Known("kind of pedestrian body", PEDESTRIAN_BODIES)] = "kinematic"
    mass: Positive = 75.0  # [kg] of a dynamic body
    # [N] at most, with which a dynamic body keeps to its way; about a quarter of its weight
    push_force: Positive = 200.0
    friction: NotNegative = 0.5  # [-] Coulomb coefficient of clothes
    # with the robot's: 'multiply' (Bullet's rule) or 'average' (PhysX's default)
    friction_combine: Annotated[
        str, Known("pedestrian_bodies: friction_combine", FRICTION_RULES)
    ] = "multiply"
    # physics steps per rendered frame: a kinematic body makes a frame's way in the first of them
    frame_steps: int = 1
    # [N s] of one contact point in one physics step; 0: no limit
    max_contact_impulse: NotNegative = 0.0
    # [m/s] at most, at which bodies shown in frames part that overlap; 0: by contact_erp alone
    max_depenetration_speed: NotNegative = 0.0

    def _check_together(self) -> None:
        if self.max_depenetration_speed and self.frame_steps == 1:
            raise ParameterError(
                f"pedestrian_bodies: max_depenetration_speed {self.max_depenetration_speed:g} has "
                "no effect with frame_steps 1; allowed is 0, or more steps per frame"
            )
        may_split = self.kind == "kinematic" or self.frame_steps == 1
        if not 1 <= self.frame_steps <= MAX_FRAME_STEPS or not may_split:
            raise ParameterError(
                f"pedestrian_bodies: frame_steps {self.frame_steps} of {self.kind} bodies; "
                f"allowed is 1 to {MAX_FRAME_STEPS}, and more than 1 for kinematic bodies only"
            )
