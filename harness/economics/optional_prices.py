"""The prices of the costs that the paper leaves out."""

import dataclasses
from dataclasses import dataclass
from functools import cache

from harness.economics.price import Price, check_prices, price_keys
from harness.economics.price import price_field as _price
from harness.economics.prices import Prices
from harness.storage.shipped import shipped
from navstack.errors import UnknownNameError
from navstack.params.strict import load_dataclass


@dataclass(frozen=True, slots=True)
class OptionalPrices:
    """The prices of the optional terms."""

    operator_wage: Price = _price("USD/h")
    operator_shift: Price = _price("h/day")
    robots_per_operator: Price = _price("robot/operator", positive=True)
    remote_assistance_rate: Price = _price("1/run")
    remote_assistance_time: Price = _price("h")
    on_site_time: Price = _price("h")
    survey_wage: Price = _price("USD/h")
    survey_time: Price = _price("h")
    battery_price: Price = _price("USD/kWh")
    battery_cycles: Price = _price("1", positive=True)
    distance_fee: Price = _price("USD/km")
    idle_power: Price = _price("W")


def load_optional_prices(prices: Prices | None = None) -> OptionalPrices:
    """The shipped prices of the optional terms, replaced by those that a price set has of its own.

    Raises:
        InputError: the set has one that is not known, in another unit or out of its range.
    """
    shipped_prices = _shipped_prices()
    if prices is None or not prices.optional:
        return shipped_prices
    known = price_keys(shipped_prices)
    for key in prices.optional:
        if key not in known:
            raise UnknownNameError("optional price", key, known)
    optional = dataclasses.replace(shipped_prices, **prices.optional)
    check_prices(optional, "optional")
    return optional


@cache
def _shipped_prices() -> OptionalPrices:
    path = shipped("params") / "prices" / "optional" / "terms.yaml"
    prices = load_dataclass(OptionalPrices, path)
    check_prices(prices, str(path))
    return prices
