"""The parameters of the cargo: ``cargo`` in a file of ``params/worlds``."""

import math
from dataclasses import dataclass

from harness.world.ranges import POSITIVE, check_ranges
from navstack.errors import ParameterError, UnknownNameError

BUCKETS = ("fixed", "free")
MAX_PIECES = 1000


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
            positive="bucket_mass piece_mass piece_radius bucket_width "
            "wake_acceleration settle_time",
            not_negative="bucket_friction friction rolling_friction restitution",
            within={
                "pieces": (0, MAX_PIECES),
                "fill": (POSITIVE, 1.0),
                "packing": (POSITIVE, 0.74),
            },
        )
        if self.bucket_width < 2.0 * self.piece_radius:
            raise ParameterError(
                f"cargo: bucket_width {self.bucket_width} m holds no piece "
                f"of radius {self.piece_radius} m; "
                "allowed is twice the radius or more"
            )

    @property
    def bucket_height(self) -> float:
        """Height [m] of the walls inside: the settled pieces reach up to ``fill`` of it."""
        volume = self.pieces * 4.0 / 3.0 * math.pi * self.piece_radius**3 / self.packing
        return volume / (self.bucket_width**2 * self.fill)
