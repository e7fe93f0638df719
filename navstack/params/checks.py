"""What parameters may be: stated beside their types, as in ``max_speed: Positive = 2.0``, and checked by name."""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any, get_type_hints

from navstack.errors import ParameterError


@dataclass(frozen=True, slots=True)
class Allowed:
    """What the value of a field may be, where its type alone does not say it.

    A field that is None may be so.
    """

    text: str  # as it follows "must be"
    admits: Callable[[Any], bool]


def at_least(least: float) -> Allowed:
    """A number of ``least`` or more."""
    return Allowed(f"{least:g} or more", lambda value: bool(value >= least))


def within(least: float, most: float) -> Allowed:
    """A number of a range."""
    return Allowed(f"{least:g} to {most:g}", lambda value: bool(least <= value <= most))


def one_of(known: Iterable[str]) -> Allowed:
    """One of some texts."""
    names = tuple(known)
    return Allowed(f"one of {', '.join(names)}", names.__contains__)


POSITIVE, NOT_NEGATIVE = Allowed("more than 0", lambda value: bool(value > 0)), at_least(0)
Positive = Annotated[float, POSITIVE]
NotNegative = Annotated[float, NOT_NEGATIVE]
PositiveInt = Annotated[int, POSITIVE]
NotNegativeInt = Annotated[int, NOT_NEGATIVE]


def check(params: Any, whose: str = "", *, finite: bool = False) -> None:
    """Refuse a dataclass of parameters with a value that its fields do not allow.

    Args:
        params: the dataclass.
        whose: as in :func:`require`.
        finite: whether every number must be finite, too.

    Raises:
        ParameterError: a value is not allowed.
    """
    kind: Any = type(params)
    for name, allowed in _checked_fields(kind):
        value = getattr(params, name)
        if finite and isinstance(value, float):
            require(params, name, math.isfinite(value), "a finite number", whose)
        if allowed is not None and value is not None:
            require(params, name, allowed.admits(value), allowed.text, whose)


@cache
def _checked_fields(kind: Any) -> tuple[tuple[str, Allowed | None], ...]:
    """Name of each field of a dataclass, and what it allows beside its type."""
    hints = get_type_hints(kind, include_extras=True)
    return tuple(
        (name, next(iter(getattr(hint, "__metadata__", ())), None)) for name, hint in hints.items()
    )


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
