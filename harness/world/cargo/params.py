"""The parameters of the cargo: ``cargo`` in a file of ``params/worlds``."""

import math
from dataclasses import dataclass
from typing import Annotated

from harness.world.physics.robot import MAX_SIZE, RobotParams
from navstack.errors import ParameterError
from navstack.ranges import Known, NotNegative, Parameters, Positive, up_to, within

BUCKETS = ("fixed", "free")
MAX_PIECES = 1000


@dataclass(frozen=True, slots=True)
class CargoParams(Parameters, whose="cargo"):
    """The popcorn and its bucket, an open box with a square floor.

    :mod:`harness.world.cargo.cargo` says what is assumed.
    """

    pieces: Annotated[int, within(0, MAX_PIECES)] = 50  # published; 0: no cargo
    piece_mass: Positive = 0.001  # [kg] published
    # [-] share of the bucket's volume below the settled pieces' mean surface; published
    fill: Annotated[float, up_to(1)] = 0.6
    piece_radius: Positive = 0.0154  # [m] about that of popped corn; assumed
    bucket_width: Positive = 0.12  # [m] inside; assumed
    # [-] share of the filled volume that is pieces: loose random packing between near walls
    packing: Annotated[float, up_to(0.74)] = 0.59
    # [-] Coulomb coefficient between pieces and with the cardboard; assumed
    friction: NotNegative = 0.5
    # [-] of speed kept in a bounce between pieces and off the walls; assumed
    restitution: NotNegative = 0.3
    # [-] of a piece's radius; stands for the irregular shape; assumed
    rolling_friction: NotNegative = 0.05
    # [m/s2] of the bucket from which pieces are simulated, where friction holds them so long
    wake_acceleration: Positive = 4.5
    settle_time: Positive = 0.5  # [s] below it after which they rest again
    # 'fixed' to the robot; 'free': stands loose on it, as the published code spawns it
    bucket: Annotated[str, Known("cargo: bucket", BUCKETS)] = "fixed"
    # [m] centre of the bucket's floor, base frame, z above ground; None: the robot's own
    place: tuple[float, float, float] | None = None
    # [m] above the deck from which a free one is dropped before the first count
    drop: Annotated[float, within(0, 1)] = 0.0
    bucket_mass: Positive = 0.05  # [kg] of a free one: cardboard; assumed
    # [-] Coulomb coefficient of a free one on the robot; PhysX's default
    bucket_friction: NotNegative = 0.5

    def _check_together(self) -> None:
        if self.place and not all(abs(part) <= MAX_SIZE for part in self.place):
            raise ParameterError(
                f"cargo: place {list(self.place)} m; allowed are three numbers from -{MAX_SIZE} to "
                f"{MAX_SIZE} m"
            )
        if self.bucket_width < 2.0 * self.piece_radius:
            raise ParameterError(
                f"cargo: bucket_width {self.bucket_width} m holds no piece of radius "
                f"{self.piece_radius} m; allowed is twice the radius or more"
            )

    def place_on(self, robot: RobotParams) -> tuple[float, float, float]:
        """Centre of the bucket's floor on a robot [m]; base frame, z above ground."""
        if self.place is None:
            return robot.bucket
        return self.place

    def wakes_at(self, gravity: float) -> float:
        """The bucket's acceleration [m/s2] from which pieces are simulated; none slides below."""
        frictions = [self.friction]
        if self.bucket == "free":
            frictions.append(self.bucket_friction)
        return min(self.wake_acceleration, gravity * min(frictions))

    @property
    def bucket_height(self) -> float:
        """Height [m] of the walls inside: the settled pieces reach up to ``fill`` of it.

        Never less than a piece's.
        """
        volume = self.pieces * 4.0 / 3.0 * math.pi * self.piece_radius**3 / self.packing
        return max(volume / (self.bucket_width**2 * self.fill), 2.0 * self.piece_radius)
