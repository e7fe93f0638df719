"""The parameters of physics and contacts: two sections of a file of ``params/worlds``."""

from dataclasses import dataclass

from harness.world.ranges import POSITIVE, check_ranges
from navstack.errors import UnknownNameError

COUNTED_PER = ("partner", "point")
_PHYSICS = {  # more steps and iterations would never end
    "rate": (60.0, 10_000.0),
    "gravity": (POSITIVE, 100.0),
    "contact_erp": (0.0, 0.2),
    "solver_iterations": (1, 1000),
}


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
