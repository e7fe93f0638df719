"""Progress of a replay on standard error: a bar on a terminal, else a line every ten seconds."""

import contextlib
import sys
import time
from collections.abc import Callable, Iterator

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

LINE_PERIOD = 10.0  # [s] between lines where there is no terminal
_BAR_PERIOD = 0.1  # [s] between updates of the bar


@contextlib.contextmanager
def shown() -> Iterator[Callable[[float], None]]:
    """Show progress meanwhile; yields what has to hear of the share that is done."""
    console = Console(stderr=True, highlight=False)
    if not console.is_terminal:
        yield _every(LINE_PERIOD, _line_teller())
        return
    columns = (TextColumn("replaying"), BarColumn(), TaskProgressColumn(), TextColumn("ETA"), TimeRemainingColumn())
    with Progress(*columns, console=console) as progress:
        task = progress.add_task("replay", total=1.0)
        yield _every(_BAR_PERIOD, lambda share: progress.update(task, completed=share))


def _line_teller() -> Callable[[float], None]:
    start = time.monotonic()

    def tell(share: float) -> None:
        left = (time.monotonic() - start) * (1.0 - share) / share
        sys.stderr.write(f"{share:.0%} of the messages, about {left:.0f} s left\n")
        sys.stderr.flush()

    return tell


def _every(period: float, tell: Callable[[float], None]) -> Callable[[float], None]:
    """Let through one call per period."""
    due = time.monotonic() + period

    def update(share: float) -> None:
        nonlocal due
        if (now := time.monotonic()) >= due:
            due = now + period
            tell(share)

    return update
