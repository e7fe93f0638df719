"""What a rule is and what it finds."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from navstack.params.lint.subject import Subject

HUGE = 1e9  # larger values are mistakes that other findings name


@dataclass(frozen=True, slots=True)
class Finding:
    """One place where a rule applies."""

    node: str
    name: str  # dotted name of the parameter; of one that the file leaves out, the name it would have
    found: str  # with the numbers, e.g. "3.0 m/s x 1.0 s = 3.0 m"
    advice: str  # with a concrete value


def decimal(value: float, digits: int = 3) -> str:
    """A value as a Nav2 file wants it: rounded, with a decimal point."""
    return repr(round(float(value), digits) + 0.0)


def above(value: float, digits: int = 1) -> str:
    """The next value of so many digits, as a Nav2 file wants it."""
    return decimal(math.ceil(value * 10**digits) / 10**digits if abs(value) < HUGE else value, digits)


def below(value: float, digits: int = 2) -> str:
    """The last value of so many digits, as a Nav2 file wants it."""
    return decimal(math.floor(value * 10**digits) / 10**digits if abs(value) < HUGE else value, digits)


def whole_above(value: float) -> str:
    """The next whole number, as a Nav2 file wants it where it insists on one."""
    return str(math.ceil(min(value, HUGE)))


Check = Callable[[Subject], Iterator[Finding]]


@dataclass(frozen=True, slots=True)
class Rule:
    """One combination to look for."""

    id: str  # stable, kebab-case
    title: str  # the combination, as a sentence
    why: str  # what it does to a real robot
    check: Check
    is_error: bool = False  # no robot can work so, as opposed to: it works badly
