"""One price with its unit, source and range; and groups of prices, read and changed by key."""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, TypeVar

from navstack.errors import ParameterError, UnknownNameError

LEAST = 1e-9  # of what formulas divide by; less is a slip of the pen
MOST = 1e12

Group = TypeVar("Group")


@dataclass(frozen=True, slots=True)
class Price:
    """One number of a price file."""

    value: float
    unit: str
    source: str  # the paper's symbol and where its number comes from
    low: float | None = None  # the source's own range; None: it gives none
    high: float | None = None


def price_field(unit: str, *, positive: bool = False, at_most: float = MOST) -> Any:
    """A field of type :class:`Price` in this unit.

    Never negative, ``positive`` where a formula divides by it.
    """
    return field(
        metadata={"unit": unit, "at_least": LEAST if positive else 0.0, "at_most": at_most}
    )


def price_keys(group: Any) -> dict[str, Price]:
    """Every price of a group under its key.

    Field names joined by dots, e.g. ``property_damage.mailbox``.
    """
    keys: dict[str, Price] = {}
    for entry in dataclasses.fields(group):
        value = getattr(group, entry.name)
        if isinstance(value, Price):
            keys[entry.name] = value
        elif dataclasses.is_dataclass(value):
            keys |= {f"{entry.name}.{key}": price for key, price in price_keys(value).items()}
    return keys


def with_unit(key: str, price: Price) -> str:
    """The key with its unit as in the names of columns, e.g. ``delivery_fee_usd_per_run``."""
    unit = price.unit.lower().removeprefix("1").replace("/", "_per_").strip("_")
    if unit:
        return f"{key}_{unit}"
    return key


def names_of(group: Any) -> dict[str, str]:
    """Every name of a price, its key with and without its unit, and the key."""
    known = price_keys(group)
    return {with_unit(key, price): key for key, price in known.items()} | {
        key: key for key in known
    }


def limits_of(group: Any, key: str) -> tuple[float, float]:
    """Least and largest value that a price of a group may have."""
    *path, name = key.split(".")
    for part in path:
        group = getattr(group, part)
    metadata = next(entry.metadata for entry in dataclasses.fields(group) if entry.name == name)
    return metadata["at_least"], metadata["at_most"]


def with_values(group: Group, values: Mapping[str, float]) -> Group:
    """The same group with other values under some keys, without a range; sources say so.

    Raises:
        UnknownNameError: a key that is not one of :func:`price_keys`, with or without its unit.
        ParameterError: a key that is given twice, with and without its unit.
    """
    known, names = price_keys(group), names_of(group)
    given: dict[str, str] = {}  # name by key
    for name, value in values.items():
        if name not in names:
            raise UnknownNameError("price", name, names)
        key = names[name]
        if key in given:
            raise ParameterError(f"{given[key]} and {name} are the same price; give one of them")
        given[key] = name
        before = known[key]
        has_range = before.low is not None or before.high is not None
        if value != before.value or has_range:
            group = _replaced(group, key.split("."), value)
    return group


def _replaced(group: Any, path: list[str], value: float) -> Any:
    inner = getattr(group, path[0])
    if len(path) > 1:
        return dataclasses.replace(group, **{path[0]: _replaced(inner, path[1:], value)})
    changed = Price(value, inner.unit, f"set by the user; before: {inner.value:g}, {inner.source}")
    return dataclasses.replace(group, **{path[0]: changed})


def check_prices(group: Any, where: str) -> None:
    """Check units and ranges of every price of a group.

    Raises:
        ParameterError: a price in another unit or out of its range; names ``where`` and the path to
            it.
    """
    for entry in dataclasses.fields(group):
        value, path = getattr(group, entry.name), f"{where}: {entry.name}"
        if isinstance(value, Price):
            _check_price(value, entry.metadata, path)
        elif dataclasses.is_dataclass(value):
            check_prices(value, path)


def _check_price(price: Price, allowed: Mapping[str, Any], where: str) -> None:
    if price.unit != allowed["unit"]:
        raise ParameterError(
            f"{where}: is given in '{price.unit}'; convert it to '{allowed['unit']}'"
        )
    if not allowed["at_least"] <= price.value <= allowed["at_most"]:
        raise ParameterError(
            f"{where}: {price.value:g} lies outside {allowed['at_least']:g}..{allowed['at_most']:g}"
        )
    if price.low is None:
        low = price.value
    else:
        low = price.low
    if price.high is None:
        high = price.value
    else:
        high = price.high
    if not allowed["at_least"] <= low <= price.value <= high <= allowed["at_most"]:
        raise ParameterError(
            f"{where}: its range {low:g}..{high:g} does not hold {price.value:g}, or is not allowed"
        )
