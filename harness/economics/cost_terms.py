"""Every term of what a delivery costs, declared once in :data:`COST_TERMS`.

Tables, page, figures, comparisons and explanations read the declaration. A new term takes an entry
here and its price: a field of :class:`Prices` or :class:`OptionalPrices`, and a value in the file
that they are read from.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum

from harness.economics.measured import Measured, Quantity
from harness.economics.optional_prices import OptionalPrices, load_optional_prices
from harness.economics.prices import Prices
from harness.metrics.contacts import PRICED_PROPERTY
from navstack.params.extensions import uses_map

WATTS_PER_KILOWATT = 1000.0


@dataclass(frozen=True, slots=True)
class CostInputs:
    """What formulas are given: of a run's means, or of each delivery."""

    measured: Measured
    prices: Prices
    optional: OptionalPrices = field(default_factory=load_optional_prices)
    localizer: str = ""


Formula = Callable[[CostInputs], Quantity | None]
Investment = Callable[[CostInputs], float]


class Paid(Enum):
    """What a cost comes from."""

    DRIVING = "driving"
    CONTACT = "contact"
    OUTCOME = "outcome"


@dataclass(frozen=True, slots=True)
class CostTerm:
    """One term of OPEX."""

    title: str  # in tables
    formula: Formula  # [USD/run]; None where it depends on cargo that is not modelled
    paid: Paid = Paid.DRIVING
    label: str = ""  # in figures; empty: the title
    rank: int = 100  # in figures, where the terms that cost the paper's robots most come first
    decimals: int = 2  # in tables
    is_linear: bool = True  # in the measurements: then the mean of deliveries has an interval
    is_optional: bool = False  # not in the paper: counted only where a user asks for it
    investment: Investment | None = None  # [USD/robot] its part of CAPEX
    prices: tuple[str, ...] = ()  # the optional prices that it rests on


def _electricity(given: CostInputs) -> Quantity:
    """Mean power drawn from the grid times mean time."""
    power = given.measured.avg_mechanical_power_kw / given.prices.electro_mechanical_efficiency
    return given.prices.electricity.value * power * given.measured.avg_runtime_h


def _service_compensation(given: CostInputs) -> Quantity | None:
    """Refunds: the food where it is spoiled, the fee where it comes late or never."""
    measured, prices = given.measured, given.prices
    if measured.spoiled is None:
        return None
    late = measured.timeout + measured.physical_assistance
    return measured.spoiled * prices.food_price + late * prices.delivery_fee.value


def _pedestrian_safety(given: CostInputs) -> Quantity:
    """Expected cost of the injuries in counted contacts."""
    return given.measured.pedestrian_injury_usd_per_run


def _property_damage(given: CostInputs) -> Quantity:
    """Damage to property; what the world does not contain cannot be damaged."""
    damage = given.prices.property_damage
    total: Quantity = 0
    for kind in PRICED_PROPERTY:
        contacts = getattr(given.measured, f"{kind}_contacts")
        if contacts is not None:
            total = total + contacts * getattr(damage, kind).value
    return total + given.measured.other_property_usd


def _repair(given: CostInputs) -> Quantity:
    """The fleet's repairs, charged to ways that end in physical assistance."""
    return given.prices.repair_per_physical_assistance * _assisted(given.measured)


def _assisted(measured: Measured) -> Quantity:
    """[1/run] ways there and back to which somebody has to come."""
    return measured.physical_assistance + measured.back_assistance


def _nothing(given: CostInputs) -> Quantity:
    """No running cost."""
    return 0.0


def _map_survey(given: CostInputs) -> float:
    """Survey of the map, once per robot; for localizers that need one."""
    if not uses_map(given.localizer):
        return 0.0
    return given.optional.survey_wage.value * given.optional.survey_time.value


def _operator(given: CostInputs) -> Quantity:
    """Share of an operator who watches some robots while they drive, and helps them from afar."""
    wage = given.optional.operator_wage.value / given.optional.robots_per_operator.value
    return wage * given.measured.avg_runtime_h


def _operator_shift(given: CostInputs) -> Quantity:
    """Share of an operator's whole shift, driving or not: the fewer deliveries, the dearer each."""
    optional = given.optional
    shift = optional.operator_wage.value * optional.operator_shift.value  # [USD/day]
    deliveries = optional.robots_per_operator.value * given.prices.deliveries_per_day.value
    return shift / deliveries


def _remote_assistance(given: CostInputs) -> Quantity:
    """Wage of a teleoperator per intervention.

    The rate is the stated one, nothing in the simulation calls for help.
    """
    optional = given.optional
    hours = optional.remote_assistance_rate.value * optional.remote_assistance_time.value
    return optional.operator_wage.value * hours


def _on_site_assistance(given: CostInputs) -> Quantity:
    """Wage of whoever comes to a robot that needs physical assistance."""
    wage = given.optional.operator_wage.value * given.optional.on_site_time.value
    return wage * _assisted(given.measured)


def _battery_wear(given: CostInputs) -> Quantity:
    """Share of the battery that the energy of a delivery wears off."""
    prices, measured = given.prices, given.measured
    efficiency = prices.inverter_efficiency.value * prices.motor_efficiency.value
    energy = measured.avg_mechanical_power_kw * measured.avg_runtime_h / efficiency  # [kWh/run]
    per_energy = given.optional.battery_price.value / given.optional.battery_cycles.value
    return per_energy * energy


def _distance_fee(given: CostInputs) -> Quantity:
    """What is earned for the way beyond the flat fee's: a negative cost."""
    return 0.0 - given.optional.distance_fee.value * given.measured.further_km


def _idle_power(given: CostInputs) -> Quantity:
    """Electricity of what always runs, driving or waiting at signals: computer, sensors, radio."""
    prices = given.prices
    efficiency = prices.charge_efficiency.value * prices.battery_roundtrip_efficiency.value
    kilowatts = given.optional.idle_power.value / WATTS_PER_KILOWATT / efficiency
    return prices.electricity.value * kilowatts * given.measured.avg_runtime_h


# By key, in the order of the paper's table; the key names the term in JSON documents.
COST_TERMS = {
    "electricity": CostTerm(
        title="Electricity",
        label="electricity",
        rank=5,
        formula=_electricity,
        decimals=5,
        is_linear=False,
    ),
    "service_compensation": CostTerm(
        title="Service Compensation",
        label="refunds",
        rank=2,
        formula=_service_compensation,
        paid=Paid.OUTCOME,
    ),
    "pedestrian_safety": CostTerm(
        title="Pedestrian Safety",
        label="injuries",
        rank=1,
        formula=_pedestrian_safety,
        paid=Paid.CONTACT,
    ),
    "property_damage": CostTerm(
        title="Property Damage",
        label="property",
        rank=4,
        formula=_property_damage,
        paid=Paid.CONTACT,
    ),
    "repair": CostTerm(
        title="Repair",
        label="repair",
        rank=3,
        formula=_repair,
        paid=Paid.OUTCOME,
    ),
    "mapping_survey": CostTerm(
        title="Mapping Survey",
        formula=_nothing,
        is_optional=True,
        investment=_map_survey,
        prices=("survey_wage", "survey_time"),
    ),
    "operator": CostTerm(
        title="Operator",
        formula=_operator,
        is_optional=True,
        prices=("operator_wage", "robots_per_operator"),
    ),
    "operator_shift": CostTerm(
        title="Operator's Shift",
        formula=_operator_shift,
        is_optional=True,
        prices=("operator_wage", "operator_shift", "robots_per_operator"),
    ),
    "remote_assistance": CostTerm(
        title="Remote Assistance",
        formula=_remote_assistance,
        is_optional=True,
        prices=("remote_assistance_rate", "remote_assistance_time", "operator_wage"),
    ),
    "on_site_assistance": CostTerm(
        title="On-site Assistance",
        formula=_on_site_assistance,
        is_optional=True,
        prices=("on_site_time", "operator_wage"),
    ),
    "battery_wear": CostTerm(
        title="Battery Wear",
        formula=_battery_wear,
        is_optional=True,
        prices=("battery_price", "battery_cycles"),
    ),
    "distance_fee": CostTerm(
        title="Fee for Distance (earned)",
        formula=_distance_fee,
        is_optional=True,
        prices=("distance_fee",),
    ),
    "idle_power": CostTerm(
        title="Idle Power",
        formula=_idle_power,
        is_optional=True,
        decimals=5,
        prices=("idle_power",),
    ),
}
COUNTED_TERMS = {key: term for key, term in COST_TERMS.items() if not term.is_optional}
OPTIONAL_TERMS = {key: term for key, term in COST_TERMS.items() if term.is_optional}
MARGIN = "contribution_margin"
# what has an interval of its mean and is compared [USD/run]
DOLLARS = (
    *sorted(key for key, term in COUNTED_TERMS.items() if term.is_linear),
    *("opex", "revenue", MARGIN),
)


# what the counted terms are called in figures, in their order there
COST_LABELS = {
    key: term.label or term.title.lower()
    for key, term in sorted(COUNTED_TERMS.items(), key=lambda entry: entry[1].rank)
}
