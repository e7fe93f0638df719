"""Parameters of what stands between the controller and the wheels.

Names and defaults are those of Nav2 Jazzy.
"""

from dataclasses import dataclass
from typing import Annotated

from navstack.ranges import Allowed, Parameters, Positive, Quantity, one_of

Triple = tuple[float, float, float]  # along x, along y, about z
Feedback = Annotated[str, one_of(("OPEN_LOOP", "CLOSED_LOOP"))]
AnyTriple = Annotated[
    Triple, Allowed("numbers up to 1e+09", lambda triple: max(map(abs, triple)) <= 1e9)
]
UpTriple = Annotated[Triple, Allowed("0 or more on every axis", lambda triple: min(triple) >= 0.0)]
DownTriple = Annotated[
    Triple, Allowed("0 or less on every axis", lambda triple: max(triple) <= 0.0)
]


@dataclass(frozen=True, slots=True)
class VelocitySmootherParams(Parameters):
    """``velocity_smoother`` (``velocity_smoother.cpp``)."""

    smoothing_frequency: Positive = 20.0  # [Hz]
    # scale all axes alike, so that the direction of the change is kept
    scale_velocities: bool = False
    # start from the last command; CLOSED_LOOP: from the measured velocity
    feedback: Feedback = "OPEN_LOOP"
    max_velocity: UpTriple = (0.5, 0.0, 2.5)  # [m/s, m/s, rad/s]
    min_velocity: DownTriple = (-0.5, 0.0, -2.5)  # [m/s, m/s, rad/s]
    max_accel: UpTriple = (2.5, 0.0, 3.2)  # [m/s2, m/s2, rad/s2] while the speed grows
    max_decel: DownTriple = (-2.5, 0.0, -3.2)  # [m/s2, m/s2, rad/s2] while it falls
    deadband_velocity: AnyTriple = (0.0, 0.0, 0.0)  # [m/s, m/s, rad/s] slower outputs are sent as 0
    # [s] without a command, after which the robot is brought to a stop
    velocity_timeout: Quantity = 1.0
