"""What every sensor does, and the store of noise that they share."""

from abc import ABC, abstractmethod

import numpy as np

from harness.world.body_state import BodyState
from navstack.errors import ParameterError
from navstack.types import FloatArray, GpsFix, Imu, LaserScan, Odometry

Measurement = Odometry | Imu | GpsFix | LaserScan

MAX_RATE = 10_000.0  # [Hz]
_BLOCK = 256  # rows of noise drawn at once


class Sensor(ABC):
    """Measures the true world imperfectly. Which measurement it makes is which field of the observation it fills."""

    @abstractmethod
    def reset(self, body: BodyState, rng: np.random.Generator) -> None:
        """Start an episode with the robot at ``body``; all noise comes from ``rng``."""

    @abstractmethod
    def measure(self, body: BodyState, pedestrians: FloatArray, stamp: float) -> Measurement:
        """One measurement.

        Args:
            body: true motion of the robot now.
            pedestrians: (n, 4) x, y [m], vx, vy [m/s] in the map frame.
            stamp: [s] now.
        """


class NoiseStore:
    """Standard normal numbers, drawn in blocks because single draws are slow."""

    def __init__(self, rng: np.random.Generator, columns: int) -> None:
        """Hand out rows of ``columns`` numbers from ``rng``."""
        self._rng = rng
        self._columns = columns
        self._rows: list[list[float]] = []

    def row(self) -> list[float]:
        """The next row."""
        if not self._rows:
            self._rows = self._rng.standard_normal((_BLOCK, self._columns))[::-1].tolist()
        return self._rows.pop()


def check_rate(sensor: str, rate: float) -> None:
    """Refuse a rate that is not positive, or beyond every sensor.

    Raises:
        ParameterError: so it is.
    """
    if not 0.0 < rate <= MAX_RATE:
        raise ParameterError(f"{sensor}: rate {rate} Hz; allowed is more than 0 to {MAX_RATE:g}")


def check_deviations(sensor: str, **deviations: float) -> None:
    """Refuse negative standard deviations.

    Raises:
        ParameterError: one is negative; the message names it.
    """
    for name, value in deviations.items():
        if value < 0.0:
            raise ParameterError(f"{sensor}: {name} {value}; allowed is 0 or more")
