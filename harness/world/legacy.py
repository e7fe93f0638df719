"""What a robot takes over from an episode before."""

from collections.abc import Mapping
from dataclasses import dataclass

from harness.world.sensors.sensor import Errors


@dataclass(frozen=True, slots=True)
class Legacy:
    """What an episode leaves to the next one of the same robot."""

    errors: Mapping[str, Errors]  # of each sensor, by its name
    pieces: int | None  # of the cargo in the bucket on the robot; None: it is filled anew
    age: float = 0.0  # [s] between the end of the one and the begin of the other
