"""The prices and constants of the cost model, each with its unit and its source."""

from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

from harness.economics.price import Price, check_prices
from harness.economics.price import price_field as _price
from harness.storage.shipped import names, resolve, shipped
from navstack.errors import ParameterError, UnknownNameError
from navstack.params.strict import from_mapping, load_dataclass, load_yaml
from navstack.ranges import KEPT_OUT

DAYS_PER_YEAR = 365
GRAVITY = 9.8  # [m/s2] as the paper rounds it


@dataclass(frozen=True, slots=True)
class PropertyPrices:
    """What a counted contact with each type of property costs."""

    mailbox: Price = _price("USD/contact", positive=True)
    trash_bin: Price = _price("USD/contact", positive=True)
    building_glass: Price = _price("USD/contact", positive=True)
    bollard: Price = _price("USD/contact", positive=True)
    plant: Price = _price("USD/contact")
    fence: Price = _price("USD/contact")


@dataclass(frozen=True, slots=True)
class InjuryCosts:
    """Cost of one injury by its severity (maximum abbreviated injury scale)."""

    mais_0: Price = _price("USD/event")
    mais_1: Price = _price("USD/event", positive=True)
    mais_2: Price = _price("USD/event", positive=True)
    mais_3: Price = _price("USD/event", positive=True)


@dataclass(frozen=True, slots=True)
class Logistic:
    """Coefficients of one risk curve."""

    intercept: float
    slope_per_mph: float  # [1/mph]


@dataclass(frozen=True, slots=True)
class InjuryRisk:
    """Risk curves: probability of a severity of at least MAIS k."""

    source: str
    mais_1: Logistic
    mais_2: Logistic
    mais_3: Logistic
    mais_4: Logistic
    mais_5: Logistic
    fatal: Logistic

    @property
    def curves(self) -> tuple[Logistic, ...]:
        """The six curves, least severe first."""
        return (self.mais_1, self.mais_2, self.mais_3, self.mais_4, self.mais_5, self.fatal)


@dataclass(frozen=True, slots=True)
class InjuryPrices:
    """What an injury costs, and how likely it is."""

    costs: InjuryCosts
    logistic: InjuryRisk
    reference_vehicle_mass: Price = _price("kg", positive=True)


@dataclass(frozen=True, slots=True)
class Prices:
    """A price file. Derived quantities are properties.

    The formulas are those of the paper's appendix.
    """

    property_damage: PropertyPrices
    injury: InjuryPrices
    robot_cost: Price = _price("USD/robot", positive=True)
    lidar_cost: Price = _price("USD/robot")
    gps_cost: Price = _price("USD/robot")
    robot_life: Price = _price("year", positive=True)
    deliveries_per_day: Price = _price("run/day", positive=True)
    data_collector_wage: Price = _price("USD/h")
    data_collection_time: Price = _price("h")
    delivery_fee: Price = _price("USD/run", positive=True)
    refund: Price = _price("USD/run", positive=True)
    physical_assistance_baseline: Price = _price("1/run", positive=True)
    annual_repair_rate: Price = _price("1/year", positive=True)
    electricity: Price = _price("USD/kWh")
    charge_efficiency: Price = _price("1", positive=True, at_most=1.0)
    battery_roundtrip_efficiency: Price = _price("1", positive=True, at_most=1.0)
    inverter_efficiency: Price = _price("1", positive=True, at_most=1.0)
    motor_efficiency: Price = _price("1", positive=True, at_most=1.0)
    robot_mass: Price = _price("kg", positive=True)
    rolling_resistance_coefficient: Price = _price("1")
    # by which contacts are paid: a name of harness.economics.accountings.ACCOUNTINGS
    accounting: str = field(default="published", metadata=KEPT_OUT)
    # whether injuries cost more by the robot's mass over the reference one, as the paper has it
    injuries_scale: bool = field(default=True, metadata=KEPT_OUT)
    as_of: str = field(default="", metadata=KEPT_OUT)  # year and month of the sources
    # optional terms that belong to the set
    terms: tuple[str, ...] = field(default=(), metadata=KEPT_OUT)
    # its own prices of these
    optional: dict[str, Price] = field(default_factory=dict, hash=False, metadata=KEPT_OUT)

    @property
    def robot_life_runs(self) -> float:
        """Deliveries in a robot's life, N_RobotLifeRun [run]."""
        return self.robot_life.value * DAYS_PER_YEAR * self.deliveries_per_day.value

    @property
    def food_price(self) -> float:
        """What spoiled food costs, P_MktFood [USD/run]: the refund without the delivery fee."""
        return self.refund.value - self.delivery_fee.value

    @property
    def electro_mechanical_efficiency(self) -> float:
        """From the grid to the wheel, C_ElectroMechanicalEff [1]."""
        return (
            self.charge_efficiency.value
            * self.inverter_efficiency.value
            * self.battery_roundtrip_efficiency.value
            * self.motor_efficiency.value
        )

    @property
    def repair_per_physical_assistance(self) -> float:
        """Repair cost if every delivery ended in physical assistance [USD/run]."""
        per_run = self.robot_cost.value / self.robot_life_runs
        return per_run * self.annual_repair_rate.value / self.physical_assistance_baseline.value

    @property
    def rolling_resistance_force(self) -> float:
        """Force that keeps the robot rolling, C_RollingResistanceForce [N]."""
        return self.robot_mass.value * GRAVITY * self.rolling_resistance_coefficient.value

    @property
    def injury_mass_factor(self) -> float:
        """Robot's mass over that of the crash report's vehicles, K_InjuryAdjustment [1].

        1 for an injury curve of robots themselves.
        """
        if not self.injuries_scale:
            return 1.0
        return self.robot_mass.value / self.injury.reference_vehicle_mass.value

    @property
    def mais_costs(self) -> tuple[float, float, float, float]:
        """Cost of MAIS 0..3 before the mass adjustment [USD/event]."""
        costs = self.injury.costs
        return (costs.mais_0.value, costs.mais_1.value, costs.mais_2.value, costs.mais_3.value)


def load_prices(name_or_file: str = "costnav") -> Prices:
    """Prices by name (of ``params/prices``) or from a YAML file.

    ``as_in`` of it names shipped ones that it builds on.

    Raises:
        InputError: an unknown name or key, a number in another unit or out of its range.
    """
    # which knows accountings and optional terms, and so imports this module
    from harness.economics.price_set import check_set

    path = resolve(name_or_file, shipped("params") / "prices", "prices")
    prices = checked(from_mapping(Prices, _content(path), str(path)), str(path))
    check_set(prices, str(path))
    return prices


def _content(path: Path) -> Any:
    """A price file with what it builds on."""
    content = load_yaml(path)
    if not isinstance(content, dict) or (base := content.pop("as_in", None)) is None:
        return content
    if base not in price_sets():
        unknown = UnknownNameError("as_in", str(base), price_sets())
        raise ParameterError(f"{path}: {unknown}")
    return _over(_content(shipped("params") / "prices" / f"{base}.yaml"), content)


def price_sets() -> list[str]:
    """The names of all shipped prices, the published ones first."""
    known = names(shipped("params") / "prices")
    return sorted(known, key=lambda name: (name != "costnav", name))


def _over(base: Any, content: Any) -> Any:
    """A mapping with the entries of another in place of its own, at every depth.

    A price is replaced as a whole.
    """
    if not (isinstance(base, dict) and isinstance(content, dict)) or "value" in content:
        return content
    return {**base, **{key: _over(base.get(key), value) for key, value in content.items()}}


@dataclass(frozen=True, slots=True)
class SeverePrices:
    """What the published rule does not price: the accounting ``monotone`` does."""

    mais_4: Price = _price("USD/event", positive=True)
    mais_5: Price = _price("USD/event", positive=True)
    fatal: Price = _price("USD/event", positive=True)
    other_property: Price = _price("USD/contact")


@cache
def load_severe() -> SeverePrices:
    """The shipped ones."""
    path = shipped("params") / "prices" / "optional" / "severe.yaml"
    prices = load_dataclass(SeverePrices, path)
    check_prices(prices, str(path))
    return prices


def checked(prices: Prices, where: str) -> Prices:
    """The same prices if they can be used together.

    Raises:
        ParameterError: a number in another unit or out of its range, or a refund below the fee;
            names ``where``.
    """
    check_prices(prices, where)
    if prices.food_price < 0:
        raise ParameterError(
            f"{where}: refund {prices.refund.value:g} USD is less than the delivery_fee "
            f"{prices.delivery_fee.value:g} USD that it contains; raise the one or lower the other"
        )
    return prices
