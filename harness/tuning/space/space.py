"""Search spaces on a Nav2 file: parameters, their ranges, and constraints between them.

A file of ``params/search_spaces`` (:mod:`harness.tuning.space.file`) gives each parameter a name,
its path (:mod:`harness.tuning.space.paths`) and what it may be: a range ``low`` to ``high``
(``log``: evenly in the logarithm; ``step``: multiples above ``low``), some ``levels``, some texts
(``choices``), true and false (``switch``), or a list of names as it could be otherwise (``lists``).
Whether a number is whole follows from Nav2. The value that the user's file has is always possible:
a range that lacks it is widened, a list is lengthened.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from harness.tuning.evaluation import Value
from harness.tuning.space.constraint import Constraint

DIGITS = 4  # significant ones of a tuned number


@dataclass(frozen=True, slots=True)
class Parameter:
    """One dimension of a search space on a certain Nav2 file."""

    name: str
    paths: tuple[str, ...]  # ``node.parameter`` each; they all take the value
    original: Value  # what the file says, or Nav2's default
    low: float = 0.0
    high: float = 0.0
    is_log: bool = False
    step: float | None = None
    is_int: bool = False
    choices: tuple[Value, ...] = ()  # not empty: one of these instead of a range
    unit: str = ""
    # name of a list's parameter, and with which of its choices
    needs: tuple[tuple[str, tuple[Value, ...]], ...] = ()
    # this one has an effect; () with all

    def rounded(self, value: Value) -> Value:
        """The value as it is written into a file: a decimal to a few digits, within the range."""
        if self.choices or self.is_int or not isinstance(value, float) or value == 0.0:
            return value
        finest = min(abs(value), self.step or math.inf)
        digits = DIGITS - 1 - math.floor(math.log10(finest))
        return min(max(round(value, digits), self.low), self.high)

    @property
    def is_ordered(self) -> bool:
        """Whether its values have an order: numbers do, texts and switches do not."""
        return not any(isinstance(choice, str | bool) for choice in self.choices)

    @property
    def is_fixed(self) -> bool:
        """Whether it has one value only."""
        return len(self.choices) == 1 or (not self.choices and self.low == self.high)

    def place(self, value: Value) -> float:
        """Where a value lies in its range, 0 at the low end and 1 at the high one.

        Choices are evenly spaced.
        """
        if self.choices:
            return self.choices.index(value) / max(len(self.choices) - 1, 1)
        low, high, number = self.low, self.high, float(value)
        if self.is_log:
            low, high, number = math.log(low), math.log(high), math.log(number)
        if high > low:
            return (number - low) / (high - low)
        return 0.0

    def has_effect(self, point: Mapping[str, Value]) -> bool:
        """Whether it does anything beside the lists that a point chooses."""
        return all(point[name] in choices for name, choices in self.needs)


@dataclass(frozen=True, slots=True)
class Space:
    """A search space on a certain Nav2 file."""

    name: str
    title: str
    parameters: tuple[Parameter, ...]
    constraints: tuple[Constraint, ...] = ()
    # numbers of the file that the constraints speak of
    constants: tuple[tuple[str, Value], ...] = ()
    notes: tuple[str, ...] = ()  # what was fitted to the file

    @property
    def original(self) -> dict[str, Value]:
        """The user's own values, by name."""
        return {parameter.name: parameter.original for parameter in self.parameters}

    def values(self, point: Mapping[str, Value]) -> dict[str, Value]:
        """What a point changes in the file.

        Paths and values, without those that it leaves as they are.
        """
        return {
            path: point[parameter.name]
            for parameter in self.parameters
            for path in parameter.paths
            if point[parameter.name] != parameter.original and parameter.has_effect(point)
        }

    def allows(self, point: Mapping[str, Value]) -> bool:
        """Whether a point keeps every constraint."""
        return all(
            constraint.holds({**dict(self.constants), **point}) for constraint in self.constraints
        )
