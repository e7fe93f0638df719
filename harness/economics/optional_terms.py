"""Costs that the paper leaves out: off unless asked for, and marked wherever they enter."""

import dataclasses
from collections.abc import Callable, Collection
from dataclasses import dataclass

from harness.economics.cost_model import Beyond, Measured
from harness.economics.price import Price, check_prices, price_keys
from harness.economics.price import price_field as _price
from harness.economics.prices import Prices
from harness.storage.shipped import shipped
from navstack.errors import InputError, UnknownNameError
from navstack.params.extensions import uses_map
from navstack.params.strict import load_dataclass


@dataclass(frozen=True, slots=True)
class OptionalPrices:
    """The prices of the optional terms."""

    operator_wage: Price = _price("USD/h")
    robots_per_operator: Price = _price("robot/operator", positive=True)
    remote_assistance_rate: Price = _price("1/run")
    remote_assistance_time: Price = _price("h")
    on_site_time: Price = _price("h")
    survey_wage: Price = _price("USD/h")
    survey_time: Price = _price("h")
    battery_price: Price = _price("USD/kWh")
    battery_cycles: Price = _price("1", positive=True)


@dataclass(frozen=True, slots=True)
class OptionalTerms:
    """Costs beyond the paper that a user wants counted."""

    names: tuple[str, ...]
    prices: OptionalPrices


@dataclass(frozen=True, slots=True)
class Inputs:
    """What the terms are worked out from."""

    measured: Measured
    localizer: str
    prices: Prices
    optional: OptionalPrices


def _mapping_survey(given: Inputs) -> Beyond:
    """Survey of the map, once per robot; for localizers that need one."""
    if not uses_map(given.localizer):
        return Beyond()
    return Beyond(capex_usd=given.optional.survey_wage.value * given.optional.survey_time.value)


def _operator(given: Inputs) -> Beyond:
    """Share of an operator who watches some robots as long as they drive, and helps them from afar."""
    wage = given.optional.operator_wage.value / given.optional.robots_per_operator.value
    return Beyond(opex=wage * given.measured.avg_runtime_h)


def _remote_assistance(given: Inputs) -> Beyond:
    """Wage of a teleoperator per intervention.

    The rate is the stated one, nothing in the simulation calls for help.
    """
    hours = (
        given.optional.remote_assistance_rate.value * given.optional.remote_assistance_time.value
    )
    return Beyond(opex=given.optional.operator_wage.value * hours)


def _on_site_assistance(given: Inputs) -> Beyond:
    """Wage of whoever comes to a robot that needs physical assistance."""
    wage = given.optional.operator_wage.value * given.optional.on_site_time.value
    return Beyond(opex=wage * given.measured.physical_assistance)


def _battery_wear(given: Inputs) -> Beyond:
    """Share of the battery that the energy of a delivery wears off.

    Price per cycle times energy drawn from it.
    """
    efficiency = given.prices.inverter_efficiency.value * given.prices.motor_efficiency.value
    # [kWh/run]
    energy = given.measured.avg_mechanical_power_kw * given.measured.avg_runtime_h / efficiency
    return Beyond(
        opex=given.optional.battery_price.value / given.optional.battery_cycles.value * energy
    )


# Term -> how it is worked out, and the prices that it rests on.
TERMS: dict[str, tuple[Callable[[Inputs], Beyond], tuple[str, ...]]] = {
    "mapping_survey": (_mapping_survey, ("survey_wage", "survey_time")),
    "operator": (_operator, ("operator_wage", "robots_per_operator")),
    "remote_assistance": (
        _remote_assistance,
        ("remote_assistance_rate", "remote_assistance_time", "operator_wage"),
    ),
    "on_site_assistance": (_on_site_assistance, ("on_site_time", "operator_wage")),
    "battery_wear": (_battery_wear, ("battery_price", "battery_cycles")),
}


def load_optional_prices(prices: Prices | None = None) -> OptionalPrices:
    """The shipped prices of the optional terms, and in their place those that a price set has of its own.

    Raises:
        InputError: the set has one that is not known, in another unit or out of its range.
    """
    path = shipped("params") / "prices" / "optional" / "terms.yaml"
    optional, own = load_dataclass(OptionalPrices, path), {} if prices is None else prices.optional
    for key in own:
        if key not in (known := price_keys(optional)):
            raise UnknownNameError("optional price", key, known)
    optional = dataclasses.replace(optional, **own)
    check_prices(optional, "optional" if own else str(path))
    return optional


def check_terms(names: Collection[str]) -> tuple[str, ...]:
    """The terms in their own order, each once.

    Raises:
        InputError: an unknown term, or two that pay for the same work.
    """
    for name in names:
        if name not in TERMS:
            raise UnknownNameError("optional term", name, TERMS)
    if "operator" in names and "remote_assistance" in names:
        raise InputError(
            "the optional term operator pays for remote_assistance, too; give one of the two"
        )
    return tuple(name for name in TERMS if name in names)


def together(terms: Collection[Beyond]) -> Beyond:
    """The sum of terms."""
    return Beyond(
        capex_usd=sum(term.capex_usd for term in terms), opex=sum(term.opex for term in terms)
    )
