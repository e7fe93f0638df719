"""What a policy sees and what it answers: all that its author has to know."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from navstack.errors import NavstackError
from navstack.types import FloatArray

Image = npt.NDArray[np.uint8]
ROUTE_POINTS, ROUTE_SPACING = 10, 1.0  # [m] along the route between points


class PolicyError(NavstackError):
    """A policy crashed, hung, or answered what is no command."""


@dataclass(frozen=True, slots=True, eq=False)
class PolicyObservation:
    """What a policy sees, in the robot's base frame, x forward.

    What is believed comes from the stack's localizer.
    """

    stamp: float  # [s] since the delivery began
    goal: FloatArray  # (3,) x, y [m], yaw [rad] of the goal in the believed base frame
    # (ROUTE_POINTS, 2) [m] the path planned at the start, 1, 2, ... m ahead, believed base frame
    route: FloatArray
    pose: FloatArray  # (3,) x, y [m], yaw [rad] believed, map frame
    velocity: FloatArray  # (2,) forward [m/s] and yaw rate [rad/s], from odometry
    # (n,) [m] of the newest scan; range_max where nothing returned; (0,) before the first one
    ranges: FloatArray
    angles: FloatArray  # (n,) [rad] of its beams in the sensor frame
    # (m, 4) x, y [m], vx, vy [m/s] in the true base frame; (0, 4) unless sees_people
    people: FloatArray
    # (height, width, 3) uint8, red, green, blue, top row first; (0, 0, 3) without a camera
    image: Image


class Policy(Protocol):
    """What drives.

    It is made once per process, without arguments, or with the path of the stack's ``policy.file``.
    """

    def reset(self, seed: int) -> None:
        """Start a delivery.

        All chance is to be drawn from ``seed``, 0 to 2**63 - 1, so that the delivery repeats.
        """

    def act(self, observation: PolicyObservation) -> FloatArray:
        """A velocity (2,): forward [m/s], yaw rate [rad/s].

        Or waypoints (k, 2) [m] in the base frame, to be followed.

        It holds until the next answer.
        """
