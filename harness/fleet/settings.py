"""What a fleet has, what is ordered from it, and when; each value with its unit and source."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from harness.economics.price import Price, check_prices, names_of, with_values
from harness.economics.price import price_field as _price
from harness.storage.shipped import resolve, shipped
from navstack.errors import ParameterError
from navstack.params.strict import load_dataclass
from navstack.types import FloatArray

HOURS = 24
MOST_ROBOTS = 10_000


@dataclass(frozen=True, slots=True)
class HourlyCurve:
    """A quantity that changes over the day."""

    source: str
    hours: tuple[float, ...]  # relative, one for each hour from 0:00

    @property
    def shares(self) -> FloatArray:
        """The hours as an array (24,)."""
        return np.array(self.hours, dtype=np.float64)


@dataclass(frozen=True, slots=True)
class FleetSettings:
    """A file of ``params/fleet``."""

    demand_by_hour: HourlyCurve
    people_by_hour: HourlyCurve
    robots: Price = _price("robot", positive=True, at_most=MOST_ROBOTS)
    operators: Price = _price("operator", at_most=MOST_ROBOTS)
    field_workers: Price = _price("worker", at_most=MOST_ROBOTS)
    orders_per_day: Price = _price("1/day", at_most=1e6)
    open_hour: Price = _price("h", at_most=HOURS)
    close_hour: Price = _price("h", positive=True, at_most=HOURS)
    way: Price = _price("km", positive=True, at_most=50.0)
    crossings_per_km: Price = _price("1/km")
    crossing_wait: Price = _price("s")
    loading_time: Price = _price("min")
    handover_time: Price = _price("min")
    patience: Price = _price("min")
    promised_time: Price = _price("min")
    help_variation: Price = _price("1", at_most=10.0)
    battery_capacity: Price = _price("Wh", positive=True)
    idle_power: Price = _price("W")
    charge_power: Price = _price("W", positive=True)
    least_charge: Price = _price("1", at_most=1.0)

    @property
    def open_hours(self) -> float:
        """How long orders are accepted [h]."""
        return self.close_hour.value - self.open_hour.value

    @property
    def open_parts(self) -> tuple[FloatArray, FloatArray]:
        """Of each hour: when the part begins in which orders are accepted, and its length [h]."""
        hours = np.arange(HOURS)
        begins = np.maximum(hours, self.open_hour.value)
        ends = np.minimum(hours + 1.0, self.close_hour.value)
        return begins, np.maximum(ends - begins, 0.0)

    @property
    def open_demand(self) -> FloatArray:
        """Relative demand (24,) of each hour's open part."""
        demand: FloatArray = self.demand_by_hour.shares * self.open_parts[1]
        return demand


def load_settings(
    name_or_file: str = "city", values: Mapping[str, float] | None = None
) -> FleetSettings:
    """Settings by name (of ``params/fleet``) or from a YAML file.

    Args:
        name_or_file: of the settings.
        values: other values of some of them, e.g. ``{"robots": 50}``.

    Raises:
        InputError: an unknown name or key, or a value that cannot be used.
    """
    path = resolve(name_or_file, shipped("params") / "fleet", "fleet settings")
    loaded = load_dataclass(FleetSettings, path)
    where, given = path.name, values or {}
    if given:
        where += " with " + ", ".join(f"{name}={value:g}" for name, value in given.items())
    return checked(with_values(loaded, given), where)


def is_setting(settings: FleetSettings, name: str) -> bool:
    """Whether a setting is called so, with or without its unit."""
    return name in names_of(settings)


def of_size(settings: FleetSettings, robots: int, operators: int) -> FleetSettings:
    """The same fleet with another number of robots and operators."""
    return with_values(settings, {"robots": robots, "operators": operators})


def checked(settings: FleetSettings, where: str) -> FleetSettings:
    """The same settings if they can be used together.

    Raises:
        ParameterError: they cannot; names ``where``.
    """
    for name in ("robots", "operators", "field_workers"):
        value = getattr(settings, name).value
        if not 1.0 <= value <= MOST_ROBOTS or value != int(value):
            raise ParameterError(
                f"{where}: {name} {value:g} must be a whole number, 1 to {MOST_ROBOTS:g}"
            )
    check_prices(settings, where)
    for name in ("demand_by_hour", "people_by_hour"):
        _check_curve(getattr(settings, name), f"{where}: {name}")
    if settings.open_hours <= 0.0:
        raise ParameterError(
            f"{where}: open_hour {settings.open_hour.value:g} must be before close_hour "
            f"{settings.close_hour.value:g}"
        )
    if not settings.open_demand.any():
        raise ParameterError(
            f"{where}: nobody orders from open_hour {settings.open_hour.value:g} to close_hour "
            f"{settings.close_hour.value:g}; give other hours, or another demand_by_hour"
        )
    if settings.charge_power.value <= settings.idle_power.value:
        raise ParameterError(
            f"{where}: charge_power {settings.charge_power.value:g} W must be above idle_power "
            f"{settings.idle_power.value:g} W; a battery is never charged otherwise"
        )
    return settings


def _check_curve(curve: HourlyCurve, where: str) -> None:
    if len(curve.hours) != HOURS:
        raise ParameterError(f"{where}: has {len(curve.hours)} hours; give {HOURS}, from 0:00")
    if min(curve.hours) < 0.0 or max(curve.hours) <= 0.0:
        raise ParameterError(f"{where}: hours must not be negative, and one must be above 0")
