"""The frozen world against the published rows: tests of the outcome shares, and predictions within stated factors."""

from collections.abc import Mapping
from dataclasses import dataclass

from harness.calibration.reading import (
    INJURY,
    METHODS,
    STANDING,
    Reading,
    published_count,
    published_property_contacts,
)
from harness.report.published import Published
from harness.statistics import Interval, fisher_p, holm, rates_p, wilson_interval
from harness.valuation import OUTCOMES

LEVEL = 0.05  # adjusted p below which a share is rejected
INJURY_FACTOR = 1.5  # within which an injury cost may lie, either way
IMPULSE_SHARE, DISTANCE_SHARE = 0.3, 0.25  # by which impulse and distance may differ
SECONDS_PER_HOUR = 3600.0


@dataclass(frozen=True, slots=True)
class ShareTest:
    """One outcome share of one stack against the published one."""

    stack: str
    outcome: str
    ours: Interval
    theirs: int
    theirs_n: int
    p: float
    p_holm: float  # adjusted for all shares that were tested

    @property
    def is_rejected(self) -> bool:
        """Whether the two can hardly be the same share."""
        return self.p_holm < LEVEL


@dataclass(frozen=True, slots=True)
class Prediction:
    """One quantity that nothing was fitted to, against the published one."""

    stack: str
    quantity: str
    unit: str
    ours: Interval
    theirs: float
    gate: tuple[float, float] | None  # allowed for ours over theirs; None: reported only

    @property
    def ratio(self) -> float | None:
        """Ours over theirs."""
        return None if self.ours.value is None or not self.theirs else self.ours.value / self.theirs

    @property
    def holds(self) -> bool | None:
        """Whether it is within its gate; None: it has none."""
        if self.gate is None:
            return None
        return self.ratio is not None and self.gate[0] <= self.ratio <= self.gate[1]


@dataclass(frozen=True, slots=True)
class CountTest:
    """Contacts with property against the published ones: as rare?"""

    stack: str
    ours: int
    ours_n: int
    theirs: int
    theirs_n: int
    p: float

    @property
    def is_rejected(self) -> bool:
        """Whether the two can hardly have the same rate."""
        return self.p < LEVEL


def share_tests(readings: Mapping[str, Reading], published: Published) -> list[ShareTest]:
    """Every outcome share of every stack that stands for a published method, adjusted together (Holm)."""
    pairs = [
        (readings[stack], published.methods[method], outcome)
        for stack, method in METHODS.items()
        if stack in readings
        for outcome in OUTCOMES
    ]
    tests = [
        (reading, method, outcome, published_count(method, outcome), reading.counts[outcome])
        for reading, method, outcome in pairs
    ]
    p_values = [fisher_p(ours, reading.n, theirs, method.episodes) for reading, method, _, theirs, ours in tests]
    return [
        ShareTest(reading.stack, outcome, wilson_interval(ours, reading.n), theirs, method.episodes, p, adjusted)
        for (reading, method, outcome, theirs, ours), p, adjusted in zip(tests, p_values, holm(p_values), strict=True)
    ]


def predictions(readings: Mapping[str, Reading], published: Published) -> list[Prediction]:
    """What the published rows tell beyond outcomes; distance has a gate for GPS only, times and speeds have none."""
    factor = (1.0 / INJURY_FACTOR, INJURY_FACTOR)
    gates = {
        (INJURY, "USD/run"): factor,
        ("avg_collision_impulse_ns", "N s/run"): _around(IMPULSE_SHARE),
        ("avg_distance_km", "km"): _around(DISTANCE_SHARE),
        ("avg_runtime_h", "h"): None,
        ("avg_velocity_mps", "m/s"): None,
    }
    found = []
    for stack, name in METHODS.items():
        if stack in readings:
            theirs = published.methods[name].measured
            for (key, unit), gate in gates.items():
                asked = None if key == "avg_distance_km" and stack != "paper-gps" else gate
                found.append(Prediction(stack, key, unit, readings[stack].means[key], getattr(theirs, key), asked))
    stack, name = STANDING
    if stack in readings:
        still = published.methods[name].measured
        seconds = still.avg_runtime_h * SECONDS_PER_HOUR
        ours = _scaled(readings[stack].injury_per_second, seconds)
        label = f"injuries in {seconds:.0f} s of standing"
        found.append(Prediction(stack, label, "USD", ours, still.pedestrian_injury_usd_per_run, factor))
    return found


def count_tests(readings: Mapping[str, Reading], published: Published) -> list[CountTest]:
    """Contacts with property of every stack that stands for a published method."""
    found = []
    for stack, name in METHODS.items():
        if stack in readings:
            ours, method = readings[stack], published.methods[name]
            theirs = published_property_contacts(method)
            p = rates_p(ours.property_contacts, ours.n, theirs, method.episodes)
            found.append(CountTest(stack, ours.property_contacts, ours.n, theirs, method.episodes, p))
    return found


def _around(share: float) -> tuple[float, float]:
    return 1.0 - share, 1.0 + share


def _scaled(interval: Interval, factor: float) -> Interval:
    value, low, high = (None if end is None else factor * end for end in (interval.value, interval.low, interval.high))
    return Interval(value, low, high, interval.n)
