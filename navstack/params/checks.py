"""What the dataclasses of parameters hold their values against."""

from collections.abc import Mapping
from typing import Any

from navstack.errors import ParameterError


def require(params: Any, name: str, is_right: bool, allowed: str, whose: str = "") -> None:
    """Refuse a value.

    Args:
        params: a dataclass of parameters.
        name: the field; a keyword of Python has an underscore after it there.
        is_right: whether the value may be.
        allowed: what it must be.
        whose: the part of the robot's program, where the name alone does not tell.

    Raises:
        ParameterError: it may not be.
    """
    if not is_right:
        of = f"{whose}: " if whose else ""
        raise ParameterError(f"{of}{name.rstrip('_')} {getattr(params, name)} must be {allowed}")


def check_signs(params: Any, positive: str, not_negative: str, whose: str) -> None:
    """Refuse numbers of the wrong sign.

    Args:
        params: a dataclass of parameters.
        positive: names, separated by blanks, of those that must be more than 0.
        not_negative: of those that must be 0 or more.
        whose: as in :func:`require`.

    Raises:
        ParameterError: a value has the wrong sign, or is no number.
    """
    for name in positive.split():
        require(params, name, getattr(params, name) > 0, "more than 0", whose)
    for name in not_negative.split():
        require(params, name, getattr(params, name) >= 0, "0 or more", whose)


def check_ranges(params: Any, ranges: Mapping[str, tuple[float, float]]) -> None:
    """Refuse what no formula can use.

    Args:
        params: a dataclass of parameters; those that are None are left out.
        ranges: least and most allowed value by name; names that ``params`` does not have are left out.

    Raises:
        ParameterError: a value lies outside its range, or is no finite number.
    """
    for name, (least, most) in ranges.items():
        value = getattr(params, name, None)
        if value is not None:
            require(params, name, least <= value <= most, f"{least:g} to {most:g}")
