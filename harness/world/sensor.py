"""What every sensor does, and what every sensor's parameters are checked for."""

from abc import ABC, abstractmethod

import numpy as np

from harness.world.body_state import BodyState
from navstack.errors import ParameterError
from navstack.types import FloatArray, GpsFix, Imu, LaserScan, Odometry

Measurement = Odometry | Imu | GpsFix | LaserScan

MAX_RATE = 10_000.0  # [Hz]
MAX_LATENCY = 60.0  # [s]


class Sensor(ABC):
    """Measures the true world imperfectly. Which measurement it makes is which field of the observation it fills."""

    @abstractmethod
    def reset(self, body: BodyState, rng: np.random.Generator) -> None:
        """Start an episode with the robot at ``body``; all noise comes from ``rng`` and its children.

        Each error draws from a generator of its own: the white noise from ``rng``, the others from its children, so
        that an error that is switched off leaves the others as they were.
        """

    @abstractmethod
    def measure(self, body: BodyState, pedestrians: FloatArray, stamp: float) -> Measurement | None:
        """One measurement; None: the sensor has none.

        Args:
            body: true motion of the robot now.
            pedestrians: (n, 4) x, y [m], vx, vy [m/s] in the map frame.
            stamp: [s] now.
        """


def check_timing(sensor: str, rate: float, latency: float) -> None:
    """Refuse a rate that is not positive, or beyond every sensor, and a latency that is negative or endless.

    Raises:
        ParameterError: so it is.
    """
    if not 0.0 < rate <= MAX_RATE:
        raise ParameterError(f"{sensor}: rate {rate} Hz; allowed is more than 0 to {MAX_RATE:g}")
    if not 0.0 <= latency <= MAX_LATENCY:
        raise ParameterError(f"{sensor}: latency {latency} s; allowed is 0 to {MAX_LATENCY:g}")


def check_not_negative(sensor: str, **values: float) -> None:
    """Refuse negative standard deviations and the like.

    Raises:
        ParameterError: one is negative; the message names it.
    """
    for name, value in values.items():
        if value < 0.0:
            raise ParameterError(f"{sensor}: {name} {value}; allowed is 0 or more")


def check_positive(sensor: str, **values: float) -> None:
    """Refuse times and the like that are not positive.

    Raises:
        ParameterError: one is 0 or negative; the message names it.
    """
    for name, value in values.items():
        if value <= 0.0:
            raise ParameterError(f"{sensor}: {name} {value}; allowed is more than 0")


def check_shares(sensor: str, **shares: float) -> None:
    """Refuse shares and probabilities beyond 0 to 1.

    Raises:
        ParameterError: one is; the message names it.
    """
    for name, value in shares.items():
        if not 0.0 <= value <= 1.0:
            raise ParameterError(f"{sensor}: {name} {value}; allowed is 0 to 1")
