"""One tree of errors. A message says in one line what was given, what is allowed and what to do."""

import difflib
from collections.abc import Iterable, Mapping, Sequence

LONGEST = 1200  # [characters] of a message; what a file holds may be of any length
LONGEST_END = 300
MOST_NAMES = 8  # of a message that tells who shows all


class NavstackError(Exception):
    """Base of all errors of this project; the message is one clear line."""

    def __str__(self) -> str:
        """The message, its middle left out where it is long: the advice stands at the end."""
        text = super().__str__()
        if len(text) > LONGEST:
            text = f"{text[: LONGEST - LONGEST_END]} [...] {text[-LONGEST_END:]}"
        return text


class InputError(NavstackError):
    """Something a user gave cannot be used."""


class ParameterError(InputError):
    """A parameter file, key or value cannot be used."""


class PluginError(InputError):
    """An algorithm answered what is no answer of its kind."""


class MapError(InputError):
    """A map cannot be used."""


class UnknownNameError(InputError):
    """A name stands for nothing known; the message offers the nearest one.

    Args:
        kind: of name.
        given: the name.
        known: names.
        shown_by: command that lists them; then the message has the nearest few.
    """

    def __init__(self, kind: str, given: str, known: Iterable[str], shown_by: str = "") -> None:
        names = sorted(known)
        known_ones = few_of(given, names, shown_by)
        super().__init__(f"unknown {kind} '{given}'{did_you_mean(given, names)}; {known_ones}")


class PlanningError(NavstackError):
    """The planner found no path; ``code`` is Nav2's name of the reason."""

    code = "UNKNOWN"


class StartOccupiedError(PlanningError):
    """The start lies in an obstacle."""

    code = "START_OCCUPIED"


class GoalOccupiedError(PlanningError):
    """The goal lies in an obstacle."""

    code = "GOAL_OCCUPIED"


class StartOutsideMapError(PlanningError):
    """The start lies outside the costmap."""

    code = "START_OUTSIDE_MAP"


class GoalOutsideMapError(PlanningError):
    """The goal lies outside the costmap."""

    code = "GOAL_OUTSIDE_MAP"


class PlannerTimedOutError(PlanningError):
    """The search was ended by its limits."""

    code = "TIMEOUT"


class NoPathFoundError(PlanningError):
    """Start and goal are free, but nothing connects them."""

    code = "NO_VALID_PATH"


class ControlError(NavstackError):
    """The controller found no command; ``code`` is Nav2's name of the reason."""

    code = "UNKNOWN"


class InvalidPathError(ControlError):
    """The plan cannot be followed: empty, or nowhere near the robot."""

    code = "INVALID_PATH"


class NoProgressError(ControlError):
    """The robot is not getting anywhere."""

    code = "FAILED_TO_MAKE_PROGRESS"


class PatienceExceededError(ControlError):
    """The controller found no command for longer than ``failure_tolerance``."""

    code = "PATIENCE_EXCEEDED"


class NoLegalVelocity(ControlError):  # noqa: N818 - Nav2's name of it
    """Every sampled velocity was rejected; ``rejections`` counts them per critic."""

    code = "NO_VALID_CONTROL"

    def __init__(self, rejections: Mapping[str, int]) -> None:
        self.rejections = dict(rejections)
        counts = (
            ", ".join(f"{name} {count}" for name, count in self.rejections.items())
            or "none sampled"
        )
        super().__init__(f"no legal velocity; rejected by: {counts}")


class BehaviorError(NavstackError):
    """A behavior failed.

    ``code`` is Nav2's name of the reason, ``number`` Nav2's number of it (0: Nav2 has none).
    """

    def __init__(self, code: str, number: int, message: str) -> None:
        self.code = code
        self.number = number
        super().__init__(message)


def few_of(given: str, names: Sequence[str], shown_by: str) -> str:
    """The names, or the few nearest to a given one and the command that lists the others."""
    if not shown_by or len(names) <= MOST_NAMES:
        return f"known: {', '.join(names)}"
    nearest = difflib.get_close_matches(given, names, n=MOST_NAMES, cutoff=0.0)
    return f"nearest: {', '.join(nearest)}; {shown_by} shows all"


def did_you_mean(given: str, known: Iterable[str]) -> str:
    """The phrase ``; did you mean 'x'?`` for the nearest known name, or nothing."""
    nearest = difflib.get_close_matches(given, list(known), n=1, cutoff=0.5)
    return f"; did you mean '{nearest[0]}'?" if nearest else ""


class NavstackWarning(UserWarning):
    """Something that a user should know, and that stops nothing."""
