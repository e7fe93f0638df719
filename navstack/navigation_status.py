"""How a navigation stands, and what happened on the way; goes into the episode's row."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from itertools import groupby


class Status(Enum):
    """How a navigation stands."""

    RUNNING = "running"
    SUCCEEDED = "succeeded"
    FAILED = "failed"


@dataclass(frozen=True, slots=True)
class Counts:
    """What happened on the way.

    Recoveries count when they begin, whether they then succeed or fail.
    """

    plans: int = 0
    failed_plans: int = 0
    failed_controls: int = 0
    # times that the tree turned to its recoveries; in one, several may be tried
    recoveries: int = 0
    # of both costmaps; the clearing of one before a second attempt does not count here
    clearings: int = 0
    spins: int = 0
    waits: int = 0
    backups: int = 0
    failed_recoveries: int = 0  # that the next in turn took over from


@dataclass(frozen=True, slots=True)
class Trouble:
    """What went wrong last, in Nav2's words; empty: nothing did."""

    error: str = ""  # name of the last failure to plan or to follow that called for a recovery
    error_code: int | None = None  # Nav2's number of it
    recovery_error: str = ""  # name of the last failure of a recovery
    recovery_error_code: int | None = None  # Nav2's number of it; 0: the behavior does not exist
    gave_up: str = ""  # why the tree ended without success
    history: str = (
        ""  # failures, recoveries and the end, in order of time, see :func:`history_text`
    )


def history_text(history: Sequence[tuple[float, str]]) -> str:
    """What happened when [s], in one line.

    What is repeated stands once, with its number and last time.
    """
    runs = [
        (what, [stamp for stamp, _ in group])
        for what, group in groupby(history, key=lambda each: each[1])
    ]
    parts = []
    for what, stamps in runs:
        part = f"{stamps[0]:.1f} s {what}"
        if len(stamps) > 1:
            part += f" ({len(stamps)} times until {stamps[-1]:.1f} s)"
        parts.append(part)
    return "; ".join(parts)
