"""Numbers, intervals and steps of a tuning study as text."""

from harness.statistics.interval import Interval
from harness.tuning.paths import is_list
from harness.tuning.waterfall import Step

NOTHING = "--"
LONG = 1_000_000  # from here on whole numbers are told by their power of ten


def step_title(step: Step) -> str:
    """A step's parameters with their old and new values; a group by its names alone."""
    names = ", ".join(step.changes)
    if len(step.changes) > 1:
        return f"{step.player} ({names})" if step.player not in (names, " + ".join(step.changes)) else step.player
    ((before, after),) = step.changes.values()
    return step.player if is_list(before) else f"{step.player} {value_text(before)} -> {value_text(after)}"


def value_text(value: object) -> str:
    """A parameter's value as a reader wants it."""
    if isinstance(value, float):
        return f"{value:.4g}"
    is_long = isinstance(value, int) and abs(value) >= LONG
    return f"{value:.4g}".replace("e+0", "e") if is_long else str(value)


def span(interval: Interval, decimals: int = 2) -> str:
    """A value with its interval."""
    if interval.value is None:
        return NOTHING
    return f"{number_text(interval.value, decimals)} {bounds(interval, decimals)}".rstrip()


def bounds(interval: Interval, decimals: int = 2) -> str:
    """The interval alone; empty where there is none."""
    if interval.low is None or interval.high is None:
        return ""
    return f"[{number_text(interval.low, decimals)}, {number_text(interval.high, decimals)}]"


def number_text(number: float, decimals: int = 2, sign: str = "") -> str:
    """A number to so many decimals; ``sign`` "+" shows that of positive ones, too."""
    return f"{number:{sign}z.{decimals}f}"


def p_text(p: float, difference: Interval | None = None) -> str:
    """A p value; of a difference only where some pairs are apart."""
    if difference is not None and difference.low is None:
        return NOTHING
    return "<.001" if p < 0.001 else f"{p:.3f}"
