"""What a rule is and what it finds.

A rule is one function. Its name is its id, its docstring has title and reason. Its parameters are
parts of the file by the names that :class:`Subject` gives them: it is asked only about a file that
has them all, and for each costmap if it takes a ``view``.
"""

import inspect
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

from navstack.params.lint.subject import Subject

HUGE = 1e9  # larger values are mistakes that other findings name


@dataclass(frozen=True, slots=True)
class Finding:
    """One place where a rule applies."""

    # dotted name of the parameter; of one that the file leaves out, the name it would have
    name: str
    found: str  # with the numbers, e.g. "3.0 m/s x 1.0 s = 3.0 m"
    advice: str  # with a concrete value
    node: str = ""  # empty: the costmap that the rule looks at, else the node of its group


def decimal(value: float, digits: int = 3) -> str:
    """A value as a Nav2 file wants it: rounded, with a decimal point."""
    return repr(round(float(value), digits) + 0.0)


def above(value: float, digits: int = 1) -> str:
    """The next value of so many digits, as a Nav2 file wants it."""
    return _stepped(value, digits, math.ceil)


def below(value: float, digits: int = 2) -> str:
    """The last value of so many digits, as a Nav2 file wants it."""
    return _stepped(value, digits, math.floor)


def _stepped(value: float, digits: int, to_whole: Callable[[float], int]) -> str:
    if abs(value) < HUGE:
        value = to_whole(value * 10**digits) / 10**digits
    return decimal(value, digits)


def whole_above(value: float) -> str:
    """The next whole number, as a Nav2 file wants it where it insists on one."""
    return str(math.ceil(min(value, HUGE)))


@dataclass(frozen=True, slots=True)
class Rule:
    """One combination to look for."""

    id: str  # stable, kebab-case
    title: str  # the combination, as a sentence
    why: str  # what it does to a real robot
    check: Callable[..., Iterator[Finding]]
    node: str  # of findings that name none
    is_error: bool  # no robot can work so, as opposed to: it works badly

    def findings(self, subject: Subject) -> Iterator[tuple[str, Finding]]:
        """What the rule finds in a file, each with its node.

        Nothing where a part is missing that it looks at.
        """
        names = set(inspect.signature(self.check).parameters)
        parts: dict[str, Any] = {name: getattr(subject, name) for name in names - {"view"}}
        if any(part is None for part in parts.values()):
            return
        if "view" not in names:
            for finding in self.check(**parts):
                yield finding.node or self.node, finding
            return
        for view in subject.costmaps:
            for finding in self.check(**parts, view=view):
                yield finding.node or view.node, finding


@dataclass(frozen=True, slots=True)
class RuleGroup:
    """The rules about one thing, as they follow each other in their module."""

    title: str
    node: str = ""  # of findings that name none
    rules: list[Rule] = field(default_factory=list)

    def warning(self, check: Callable[..., Iterator[Finding]]) -> Rule:
        """Add what works badly."""
        return self._add(check, is_error=False)

    def error(self, check: Callable[..., Iterator[Finding]]) -> Rule:
        """Add what cannot work."""
        return self._add(check, is_error=True)

    def _add(self, check: Callable[..., Iterator[Finding]], is_error: bool) -> Rule:
        title, _, why = (inspect.getdoc(check) or "").partition(".\n\nWhy: ")
        rule_id = check.__name__.replace("_", "-")
        reason = " ".join(why.split())[:-1]
        rule = Rule(rule_id, title, reason, check, self.node, is_error)
        self.rules.append(rule)
        return rule
