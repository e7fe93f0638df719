"""The parameters of physics and contacts: two sections of a file of ``params/worlds``."""

from dataclasses import dataclass
from typing import Annotated

from navstack.ranges import Known, NotNegative, NotNegativeInt, Parameters, up_to, within

COUNTED_PER = ("partner", "point")


@dataclass(frozen=True, slots=True)
class PhysicsParams(Parameters, whose="physics"):
    """How the physics is integrated; more steps and iterations would never end."""

    rate: Annotated[float, within(60, 10_000)] = 120.0  # [Hz] physics steps, published
    gravity: Annotated[float, up_to(100)] = 9.81  # [m/s2]
    # [-] share of a penetration removed per step; adds at most this share to an impulse
    contact_erp: Annotated[float, within(0, 0.2)] = 0.01
    solver_iterations: Annotated[int, within(1, 1000)] = 50  # of the contact solver per step


@dataclass(frozen=True, slots=True)
class ContactParams(Parameters, whose="contacts"):
    """What is a counted contact and what one contact event."""

    counted_impulse: NotNegative = 50.0  # [N s] in one step, from which it counts; published
    # what must reach it: 'partner': all its points together; 'point': one of them, as published
    per: Annotated[str, Known("contacts: per", COUNTED_PER)] = "partner"
    # contact reports (steps with contact) after a counted one during which nothing counts; publ.
    cool_down: NotNegativeInt = 30
    impact_speed: NotNegative = 0.05  # [m/s] closing speed up to which bodies touch without impact
    separation_time: NotNegative = 0.25  # [s] apart after which an event has ended
