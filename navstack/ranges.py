"""What values a parameter may have: declared beside its field, checked when the dataclass is made.

@dataclass(frozen=True, slots=True)
class WheelParams(Parameters, whose="wheels"):
    radius: Positive = 0.1  # [m]
    side: Annotated[str, one_of(("left", "right"))] = "left"
"""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, fields
from functools import cache
from types import UnionType
from typing import Annotated, Any, Protocol, Union, get_args, get_origin, get_type_hints

from navstack.errors import ParameterError, UnknownNameError


class ValueRule(Protocol):
    """A rule for the value of one field, as it stands in the field's ``Annotated``."""

    def taken(self, name: str, value: Any, where: str) -> Any:
        """The value that counts for a given one.

        Args:
            name: of the parameter.
            value: as given.
            where: begins the message.

        Raises:
            InputError: the value is not allowed.
        """
        ...


@dataclass(frozen=True, slots=True)
class Allowed:
    """Refuses what it does not admit."""

    text: str  # as it follows "must be"
    admits: Callable[[Any], bool]

    def taken(self, name: str, value: Any, where: str) -> Any:
        """The value itself."""
        if not self.admits(value):
            raise ParameterError(f"{where}{name} {value} must be {self.text}")
        return value


@dataclass(frozen=True, slots=True)
class Needed:
    """Refuses an empty text."""

    reason: str  # as it follows "is missing"

    def taken(self, name: str, value: Any, where: str) -> Any:
        """The value itself."""
        if not value:
            raise ParameterError(f"{where}{name} is missing{self.reason}")
        return value


@dataclass(frozen=True, slots=True)
class Known:
    """Refuses other names than the known ones, and offers the nearest of them."""

    kind: str  # what the names stand for
    names: tuple[str, ...]

    def taken(self, name: str, value: Any, where: str) -> Any:
        """The value itself."""
        if value not in self.names:
            raise UnknownNameError(self.kind, value, self.names)
        return value


@dataclass(frozen=True, slots=True)
class Replaced:
    """Takes a usual value in place of any that is not known, as Nav2 does."""

    known: Sequence[int]
    usual: int

    def taken(self, name: str, value: Any, where: str) -> Any:
        """The value if it is known, else the usual one."""
        return value if value in self.known else self.usual


@dataclass(frozen=True, slots=True)
class NegativeReplaced:
    """Takes a usual number in place of a negative one, as Nav2 does after a warning."""

    usual: float

    def taken(self, name: str, value: Any, where: str) -> Any:
        """The number, or the usual one."""
        return self.usual if value < 0 else value


@dataclass(frozen=True, slots=True)
class Capped:
    """Takes the largest number that matters in place of any larger one, as of an infinite one."""

    most: float

    def taken(self, name: str, value: Any, where: str) -> Any:
        """The value, or the largest."""
        return min(value, self.most)


@dataclass(frozen=True, slots=True)
class Signed:
    """Takes a number of the other sign for one of the right sign, as Nav2 does after a warning."""

    sign: float  # 1 or -1

    def taken(self, name: str, value: Any, where: str) -> Any:
        """The value, or the same with the other sign."""
        return math.copysign(value, self.sign) if value else value


def at_least(least: float) -> Allowed:
    """A number of ``least`` or more."""
    return Allowed(f"{least:g} or more", lambda value: bool(value >= least))


def at_most(most: float) -> Allowed:
    """A number of ``most`` or less."""
    return Allowed(f"at most {most:g}", lambda value: bool(value <= most))


def less_than(limit: float) -> Allowed:
    """A number below ``limit``."""
    return Allowed(f"less than {limit:g}", lambda value: bool(value < limit))


def within(least: float, most: float) -> Allowed:
    """A number of a range."""
    return Allowed(f"{least:g} to {most:g}", lambda value: bool(least <= value <= most))


def up_to(most: float) -> Allowed:
    """A number above 0, up to ``most``."""
    return Allowed(f"more than 0 to {most:g}", lambda value: bool(0 < value <= most))


def one_of(known: Iterable[str]) -> Allowed:
    """One of some texts."""
    names = tuple(known)
    return Allowed(f"one of {', '.join(names)}", names.__contains__)


KEPT_OUT = {"kept_out": True}  # metadata of a field that a dump leaves out at its default
POSITIVE, NOT_NEGATIVE = Allowed("more than 0", lambda value: bool(value > 0)), at_least(0)
Positive = Annotated[float, POSITIVE]
NotNegative = Annotated[float, NOT_NEGATIVE]
# a length, speed, weight, ... of either sign, which Nav2 takes at any size: larger is a mistake
Quantity = Annotated[float, within(-1e9, 1e9)]
# for which files write .inf: a reach, a height or a time that limits nothing
_OPEN = within(-math.inf, math.inf)
OpenQuantity = Annotated[float, _OPEN]
Whole = Annotated[int, within(-(2**63), 2**63 - 1)]  # what a parameter of ROS 2 can hold
Share = Annotated[float, within(0, 1)]
PositiveInt = Annotated[int, POSITIVE]
NotNegativeInt = Annotated[int, NOT_NEGATIVE]
_FINITE = Allowed("a finite number", math.isfinite)


class Parameters:
    """Base of a frozen dataclass whose fields are checked by their rules; None is always right.

    Class keywords: ``whose`` names the part of the robot's program in messages, where the name of
    a field alone does not tell; with ``finite`` decimal numbers must be finite, but for
    :data:`OpenQuantity`.
    """

    __slots__ = ()
    _whose = ""
    _finite = False

    def __init_subclass__(cls, whose: str = "", finite: bool = False) -> None:
        # a dataclass with slots is made twice, the second time without keywords
        if whose:
            cls._whose = whose
        if finite:
            cls._finite = finite

    def __post_init__(self) -> None:
        where = f"{self._whose}: " if self._whose else ""
        kind: Any = type(self)
        for field, rules in _rules(kind):
            value = given = getattr(self, field)
            if value is None:
                continue
            name = field.rstrip("_")  # a keyword of Python has an underscore after it
            if self._finite and isinstance(value, float) and _OPEN not in rules:
                _FINITE.taken(name, value, where)
            for rule in rules:
                value = rule.taken(name, value, where)
            if value is not given:
                object.__setattr__(self, field, value)
        self._check_together()

    def _check_together(self) -> None:
        """Check what the rule of one field cannot say.

        Raises:
            InputError: values do not go together.
        """

    def _require(self, name: str, is_right: bool, allowed: str) -> None:
        """Refuse the value of a field that is not right: it must be ``allowed``.

        Raises:
            ParameterError: it is not.
        """
        where = f"{self._whose}: " if self._whose else ""
        Allowed(allowed, lambda _: is_right).taken(name, getattr(self, name), where)


@cache
def _rules(kind: Any) -> tuple[tuple[str, tuple[ValueRule, ...]], ...]:
    """The rules of each field of a dataclass."""
    hints = get_type_hints(kind, include_extras=True)
    return tuple((each.name, rules_of(hints[each.name])) for each in fields(kind))


def rules_of(hint: Any) -> tuple[ValueRule, ...]:
    """The rules in a type hint, those of an optional value among them."""
    rules: tuple[ValueRule, ...] = getattr(hint, "__metadata__", ())
    if get_origin(hint) in (Union, UnionType):
        for option in get_args(hint):
            rules += rules_of(option)
    return rules
