"""Numbers, intervals and steps of a tuning study as text."""

from harness.tuning.paths import is_list
from harness.tuning.waterfall import Step

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
