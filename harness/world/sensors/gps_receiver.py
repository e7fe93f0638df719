"""The satellite receiver: white noise, slow errors, multipath and outages near buildings."""

import math
from dataclasses import dataclass

import numpy as np

from harness.world.physics.body_state import BodyState
from harness.world.ranges import Latency, Rate
from harness.world.sensors.noise import GaussMarkov, NoiseStore
from harness.world.sensors.sensor import Errors, Sensor
from harness.world.sensors.sky import Sky
from navstack.errors import ParameterError
from navstack.ranges import NotNegative, Parameters, Positive, Share
from navstack.types import FloatArray, GpsFix

# [m] a receiver without error states no less, for 0 means that nothing is stated
LEAST_STATED = 1e-3
_HALF = 0.5  # share of the sky at which multipath has its stated deviation


@dataclass(frozen=True, slots=True)
class GpsParams(Parameters, whose="gps"):
    """How well the satellite receiver measures. What is left out is off."""

    rate: Rate  # [Hz]
    position_std: NotNegative  # [m] per axis, white
    # [m] per axis under any sky, Gauss-Markov: orbits, clocks, atmosphere
    drift_std: NotNegative = 0.0
    drift_time: Positive = 600.0  # [s] its correlation time
    # [m] per axis where half the sky is hidden, Gauss-Markov; grows with the hidden share
    multipath_std: NotNegative = 0.0
    multipath_time: Positive = 10.0  # [s] its correlation time
    # [-] of the correlated deviations that the fix's own deviation contains
    stated_share: Share = 0.0
    lost_above: Share = 1.0  # [-] hidden share of the sky above which the fix is lost; 1: never
    found_below: Share = 1.0  # [-] hidden share below which satellites are acquired again
    # [s] from then to the next fix, mean of an exponential distribution
    reacquisition_time: NotNegative = 0.0
    # [s] from, to since a mission began: no fix is measured
    outages: tuple[tuple[float, float], ...] = ()
    latency: Latency = 0.0  # [s] from measurement to delivery

    def _check_together(self) -> None:
        if self.found_below > self.lost_above:
            raise ParameterError(
                f"gps: found_below {self.found_below} is above lost_above {self.lost_above}; "
                "give at most the same"
            )
        for start, end in self.outages:
            if not 0.0 <= start < end:
                raise ParameterError(
                    f"gps: outage from {start} to {end} s; allowed is 0 <= from < to"
                )

    @property
    def depends_on_sky(self) -> bool:
        """Whether it matters how much of the sky is hidden."""
        return self.multipath_std > 0.0 or self.lost_above < 1.0


class GpsReceiver(Sensor[GpsFix]):
    """Position fixes of the base origin (the antenna's lever arm is taken as corrected).

    The deviation that a fix states is the white one and ``stated_share`` of the correlated ones:
    real receivers judge themselves by the scatter of their measurements, in which an error that
    many satellites share for long does not show.
    """

    def __init__(self, params: GpsParams, sky: Sky | None) -> None:
        """Make a receiver.

        Args:
            params: of it.
            sky: what hides satellites; None: nothing does.
        """
        self._params = params
        self._sky = sky

    def reset(self, body: BodyState, rng: np.random.Generator) -> None:
        """Start an episode; under open sky the receiver has a fix."""
        drift_rng, multipath_rng, self._outage_rng = rng.spawn(3)
        self._noise = NoiseStore(rng, 2)
        self._drift = GaussMarkov(drift_rng, 2, self._params.drift_time)
        self._multipath = GaussMarkov(multipath_rng, 2, self._params.multipath_time)
        self._silent_until = 0.0  # [s]; inf: too much of the sky is hidden
        self._before = 0.0  # [s] that it has worked before this episode, for the script of outages

    def lasting(self, stamp: float) -> Errors:
        """Drift and multipath, how long [s] it stays without a fix, and has worked [s]."""
        slow = *self._drift.values, *self._multipath.values
        return *slow, self._silent_until - stamp, self._before + stamp

    def take_over(self, errors: Errors, age: float) -> None:
        """See :meth:`Sensor.take_over`."""
        *slow, silent, worked = errors
        self._drift.go_on(slow[:2], age)
        self._multipath.go_on(slow[2:], age)
        self._silent_until = silent - age
        self._before = worked + age

    def measure(self, body: BodyState, pedestrians: FloatArray, stamp: float) -> GpsFix | None:
        """The position now; None: there is no fix."""
        params, noise = self._params, self._noise.row()
        x, y = body.x + params.position_std * noise[0], body.y + params.position_std * noise[1]
        hidden = 0.0
        if self._sky:
            hidden = self._sky.hidden(body.x, body.y)
        multipath_std = params.multipath_std * hidden / _HALF
        for process, deviation in (
            (self._drift, params.drift_std),
            (self._multipath, multipath_std),
        ):
            if deviation:
                error = process.at(stamp)
                x, y = x + deviation * error[0], y + deviation * error[1]
        if self._is_silent(hidden, stamp):
            return None
        slow = params.stated_share * math.hypot(params.drift_std, multipath_std)
        return GpsFix(stamp, x, y, max(math.hypot(params.position_std, slow), LEAST_STATED))

    def _is_silent(self, hidden: float, stamp: float) -> bool:
        """Whether there is no fix, for the hidden share of the sky or by script."""
        params = self._params
        if hidden > params.lost_above:
            self._silent_until = math.inf
        elif self._silent_until == math.inf and hidden <= params.found_below:
            delay = params.reacquisition_time * self._outage_rng.standard_exponential()
            self._silent_until = stamp + delay
        worked = self._before + stamp
        return stamp < self._silent_until or any(
            start <= worked < end for start, end in params.outages
        )
