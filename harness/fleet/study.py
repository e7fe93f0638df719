"""Many days of a fleet: means with their intervals, the spread of days, curves over its size."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from harness.economics.break_even import break_even_robots_per_operator
from harness.economics.optional_prices import OptionalPrices
from harness.fleet.day_metrics import DAY_METRICS, PROFIT, DayMetric
from harness.fleet.ledger import Day, FleetPrices, settle
from harness.fleet.legs import Library
from harness.fleet.orders import draw_orders, order_times
from harness.fleet.robots import FleetRobot
from harness.fleet.settings import FleetSettings, of_size
from harness.fleet.simulation import FleetDay
from harness.statistics.bootstrap import bootstrap_mean, percentile_interval
from harness.statistics.interval import Interval, wider
from navstack.errors import InputError
from navstack.types import FloatArray

DAYS, RESAMPLES, DAYS_EACH = 100, 40, 5
CURVE_DAYS = 20
SIZES = (0.25, 0.5, 0.75, 1.0, 1.5, 2.0)  # times the fleet's own, on curves
MOST_LEGS = 1000  # of a way
MOST_LEGS_A_DAY = 2_000_000  # some 300 MB
TAILS = (0.025, 0.975)  # of single days
Tell = Callable[[], None]


@dataclass(frozen=True, slots=True)
class Estimate:
    """A quantity: its mean, and between which values single days lie."""

    mean: Interval  # over days; bounds from resampled legs, n is the number of days
    day_low: float | None  # 2.5 % of days are below
    day_high: float | None

    def as_json(self) -> dict[str, float | int | None]:
        """As JSON documents have it."""
        return {**self.mean.as_json(), "day_low": self.day_low, "day_high": self.day_high}


@dataclass(frozen=True, slots=True)
class CurvePoint:
    """A fleet of another size."""

    robots: int
    operators: int
    profit_per_robot: Interval  # [USD/day] over days, legs as they were driven
    profit: float  # [USD/day] of the fleet
    utilisation: float  # [%]
    customer_wait: float | None  # [min]
    operator_wait: float | None  # [min]


@dataclass(frozen=True, slots=True, eq=False)
class FleetStudy:
    """What a fleet comes to with the legs of one library."""

    library: Library
    days: tuple[Day, ...]
    resampled: tuple[tuple[Day, ...], ...]  # days of each resampled library
    robots: tuple[FleetRobot, ...]  # of the first day
    estimates: dict[str, Estimate]
    # robots that one operator must serve at least; None: no number pays
    break_even: Interval
    never_share: float  # of the resampled libraries with which no number pays


def require_moving(library: Library, settings: FleetSettings, when: str = "") -> None:
    """Check that ways can be made of a library's legs.

    Raises:
        InputError: a way would take more than :data:`MOST_LEGS` of them, or those of a day more
            than :data:`MOST_LEGS_A_DAY`.
    """
    progress = min(group.mean_progress for group in library.groups)
    if not progress > settings.way.value / MOST_LEGS:
        raise InputError(
            f"the robots of {library.name} hardly move{when}: {1000.0 * progress:.1f} m closer to "
            f"the goal with a leg; a way of {settings.way.value:g} km may take {MOST_LEGS} legs: "
            "give a run of more deliveries that arrive"
        )
    orders = settings.orders_per_day.value
    legs = 2.0 * orders * settings.way.value / progress  # there and back
    if legs > MOST_LEGS_A_DAY:
        raise InputError(
            f"{orders:g} orders of {settings.way.value:g} km there and back take {legs:.0f} legs "
            f"of {library.name}; at most {MOST_LEGS_A_DAY} a day can be simulated: give fewer "
            "orders_per_day, or longer legs"
        )


def require_countable_calls(settings: FleetSettings, optional: OptionalPrices) -> None:
    """Check that all calls for help of a day can be simulated.

    Raises:
        InputError: they are more than :data:`MOST_LEGS_A_DAY`.
    """
    orders, rate = settings.orders_per_day.value, optional.remote_assistance_rate.value
    if orders * rate > MOST_LEGS_A_DAY:
        raise InputError(
            f"{orders:g} orders with {rate:g} calls for help each (remote_assistance_rate) are "
            f"{orders * rate:g} calls; at most {MOST_LEGS_A_DAY} a day can be simulated: give a "
            "lower rate, or fewer orders_per_day"
        )


class Fleet:
    """A fleet and its prices: simulates days."""

    def __init__(
        self, settings: FleetSettings, at: FleetPrices, seed: int, tell: Tell = lambda: None
    ) -> None:
        """Nothing is simulated yet.

        Args:
            settings: of the fleet.
            at: prices.
            seed: of all chance; the same for every library and size.
            tell: is called after each simulated day.
        """
        self._settings, self._at, self._seed, self._tell = settings, at, seed, tell

    def day(self, library: Library, number: int) -> tuple[Day, list[FleetRobot]]:
        """One day by its number; and the robots at its end."""
        seed = (self._seed, number)
        placed = order_times(self._settings, np.random.default_rng([*seed, 3]))
        orders = draw_orders(library, self._settings, self._at.optional, placed, seed)
        rng = np.random.default_rng([*seed, 2])
        fleet_day = FleetDay(orders, self._settings, self._at.optional, rng)
        fleet_day.run()
        robots = fleet_day.robots
        day = settle(fleet_day.log, robots, orders, library, self._settings, self._at)
        self._tell()
        return day, robots

    def days(self, library: Library, numbers: Sequence[int]) -> tuple[Day, ...]:
        """Days by their numbers."""
        return tuple(self.day(library, number)[0] for number in numbers)

    def study(self, library: Library, days: int = DAYS, resamples: int = RESAMPLES) -> FleetStudy:
        """Many days with the legs as driven, some with each of many resampled libraries.

        Args:
            library: of driven legs.
            days: with the legs as they were driven.
            resamples: of the legs, each with :data:`DAYS_EACH` days of its own; the bounds of
                means hold what these days differ by, too.

        Raises:
            InputError: a way of a resampled library would take more than :data:`MOST_LEGS` legs.
        """
        own = self.days(library, range(days))
        resampled = []
        for number in range(resamples):
            other = library.resampled((self._seed, 4, number))
            require_moving(other, self._settings, f", as {library.size} legs are resampled")
            first = days + number * DAYS_EACH
            resampled.append(self.days(other, range(first, first + DAYS_EACH)))
        estimates = {key: _estimate(metric, own, resampled) for key, metric in DAY_METRICS.items()}
        break_even, never = self._break_even(own, resampled)
        robots = tuple(self.day(library, 0)[1])
        return FleetStudy(library, own, tuple(resampled), robots, estimates, break_even, never)

    def _break_even(
        self, own: Sequence[Day], resampled: Sequence[Sequence[Day]]
    ) -> tuple[Interval, float]:
        """Robots per operator, and the share of resamples with which no number pays."""
        wage = self._at.optional.operator_wage.value
        found = [_robots_per_operator(days, wage) for days in resampled]
        known = [each for each in found if each is not None]
        value = _robots_per_operator(own, wage)
        never = 1.0 - len(known) / max(len(found), 1)
        if value is None or never > TAILS[0] or len(known) < 2:
            return Interval(value, None, None, len(own)), never
        return _holding(value, np.array(known), len(own)), never

    def curve(
        self, library: Library, sizes: Sequence[tuple[int, int]], days: int = CURVE_DAYS
    ) -> tuple[CurvePoint, ...]:
        """Fleets of other numbers of robots and operators, the same days for each."""
        return tuple(self._point(library, *size, days) for size in sizes)

    def _point(self, library: Library, robots: int, operators: int, days: int) -> CurvePoint:
        settings = of_size(self._settings, robots, operators)
        fleet = Fleet(settings, self._at, self._seed, self._tell)
        found = fleet.days(library, range(days))
        own = {key: _values(metric, found) for key, metric in DAY_METRICS.items()}
        profits = own[PROFIT]
        return CurvePoint(
            robots,
            operators,
            bootstrap_mean(profits, np.random.default_rng(self._seed)),
            float(profits.mean()) * robots,
            _known_mean(own["utilisation_percent"]) or 0.0,
            _known_mean(own["customer_wait_min"]),
            _known_mean(own["operator_wait_min"]),
        )


def sizes_of_robots(robots: int, operators: int) -> list[tuple[int, int]]:
    """Fleets with as many robots per operator, as near as whole numbers allow."""
    numbers = sorted({max(1, round(robots * size)) for size in SIZES})
    return [(number, max(1, round(operators * number / robots))) for number in numbers]


def sizes_of_staff(robots: int, operators: int) -> list[tuple[int, int]]:
    """The same robots with other numbers of operators."""
    numbers = {1, *(max(1, round(operators * size)) for size in SIZES)}
    return [(robots, number) for number in sorted(numbers)]


def paying_size(curve: Sequence[CurvePoint]) -> CurvePoint | None:
    """The fleet that earns most; None where none earns anything."""
    best = max(curve, key=lambda point: point.profit)
    if best.profit <= 0.0:
        return None
    return best


def differences(first: FleetStudy, second: FleetStudy) -> dict[str, Estimate]:
    """Second less first, on the same days and the same resampled missions."""
    return {key: _difference(metric, first, second) for key, metric in DAY_METRICS.items()}


def _difference(metric: DayMetric, first: FleetStudy, second: FleetStudy) -> Estimate:
    own = _values(metric, second.days) - _values(metric, first.days)
    means = [
        _known_mean(_values(metric, after) - _values(metric, before))
        for before, after in zip(first.resampled, second.resampled, strict=True)
    ]
    return _of(own, means)


def _estimate(
    metric: DayMetric, own: Sequence[Day], resampled: Sequence[Sequence[Day]]
) -> Estimate:
    means = [_known_mean(_values(metric, days)) for days in resampled]
    return _of(_values(metric, own), means)


def _of(own: FloatArray, means: Sequence[float | None]) -> Estimate:
    """An estimate from days (n,), and from the means of resampled libraries."""
    value = _known_mean(own)
    known = np.array([mean for mean in means if mean is not None])
    if value is None:
        return Estimate(Interval(None, None, None, len(own)), None, None)
    low, high = np.nanquantile(own, TAILS)
    if known.size < 2:
        return Estimate(Interval(value, None, None, len(own)), float(low), float(high))
    return Estimate(_holding(value, known, len(own)), float(low), float(high))


def _holding(value: float, resampled: FloatArray, days: int) -> Interval:
    """A mean over days between percentiles of resampled libraries' means.

    Few days may lie beside what so many others come to: then the interval reaches as far.
    """
    found = percentile_interval(value, resampled, days)
    return wider(found, Interval(value, value, value, days))


def _values(metric: DayMetric, days: Sequence[Day]) -> FloatArray:
    return np.array([metric.of(day) for day in days], dtype=np.float64)


def _known_mean(values: FloatArray) -> float | None:
    known = values[~np.isnan(values)]
    if not known.size:
        return None
    return float(known.mean())


def _robots_per_operator(days: Sequence[Day], wage: float) -> float | None:
    """At which what robots earn pays the operators, if one serves them as well as now."""
    robot_days = sum(day.robots for day in days)
    before_wages = sum(day.profit - day.money["operators"] for day in days) / robot_days
    hours = sum(day.paid_hours for day in days) / len(days)
    return break_even_robots_per_operator(before_wages, wage * hours)
