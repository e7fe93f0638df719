"""Kinds of the parameters that this program does not read, by name."""

from navstack.params.registry.block import words
from navstack.params.registry.nav2 import NAV2

SWITCHES, DECIMALS, WHOLE_NUMBERS, _EITHER = (
    words(NAV2["kinds"][kind])
    for kind in ("switches", "decimals", "whole_numbers", "either_number")
)
NUMBERS = DECIMALS | WHOLE_NUMBERS | _EITHER


def wrong_kind(name: str, value: object) -> str:
    """What a value should be and is not; empty if it is, or if nothing is known about its name."""
    is_switch = isinstance(value, bool)
    if name in SWITCHES and not is_switch:
        return "true or false"
    if name in NUMBERS and (is_switch or not isinstance(value, int | float)):
        return "a number"
    return ""
