"""Progress on standard error: live on a terminal, else a line every ten seconds."""

import contextlib
import sys
import threading
import time
from collections.abc import Callable, Iterator
from typing import Protocol

from rich.console import Console, RenderableType
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table

from harness.report.numbers import counted, interval_text
from harness.statistics.interval import Interval
from harness.storage.texts import time_text

LINE_PERIOD = 10.0  # [s] between lines where there is no terminal
BAR_WIDTH = 16  # [characters], so that the words beside it fit into 80


class Progress(Protocol):
    """Progress of a task."""

    @property
    def text(self) -> str:
        """In one line."""

    def __rich__(self) -> RenderableType:
        """As a terminal shows it."""


class Bar:
    """Amount done of a total, and the time left at the present pace.

    The time left also falls between two updates: one long delivery does not lower the pace.

    Args:
        form: of its text, e.g. ``{done} of {total} deliveries``.
        total: amount at the end.
        done: amount at the beginning.
    """

    def __init__(self, form: str, total: float, done: float = 0) -> None:
        self._form, self._done_before, self._began = form, done, time.monotonic()
        self.total, self.done = total, done

    @property
    def note(self) -> str:
        """What else there is to say."""
        return ""

    @property
    def done(self) -> float:
        """The amount done."""
        return self._done

    @done.setter
    def done(self, amount: float) -> None:
        self._done, self._moved = amount, time.monotonic()

    @property
    def left(self) -> float:
        """Time [s] that is left; 0: it is over, or nothing tells."""
        driven = self.done - self._done_before
        if not driven:
            return 0.0
        pace = (self._moved - self._began) / driven
        return max(pace * (self.total - self.done) - (time.monotonic() - self._moved), 0.0)

    @property
    def _amount(self) -> str:
        amount = self._form.format(done=self.done, total=self.total)
        if self.left < 0.5:
            return amount
        return f"{amount}, about {time_text(self.left)} left"

    @property
    def text(self) -> str:
        """Amount, time left, and the note."""
        return f"{self._amount}: {self.note}" if self.note else self._amount

    def __rich__(self) -> Table:
        """A bar before the same words."""
        row = Table.grid(padding=(0, 1))
        row.add_row(ProgressBar(self.total, self.done, width=BAR_WIDTH), self._amount, self.note)
        return row

    def move(self, done: float) -> None:
        """Take in how much is done."""
        self.done = done

    def step(self) -> None:
        """Take in that one more is done."""
        self.done += 1


@contextlib.contextmanager
def shown(progress: Progress, tells_end: bool = True) -> Iterator[None]:
    """Show progress meanwhile; ``tells_end``: where there is no terminal, also where it ended."""
    console = Console(stderr=True, highlight=False, emoji=False)
    if console.is_terminal:
        with Live(progress, console=console, refresh_per_second=2.0):
            yield
        return
    said, stopped = progress.text, threading.Event()

    def tell() -> None:
        nonlocal said
        if (text := progress.text) != said:
            sys.stderr.write(f"{text}\n")
            sys.stderr.flush()
        said = text

    def tell_now_and_then() -> None:
        while not stopped.wait(LINE_PERIOD):
            tell()

    teller = threading.Thread(target=tell_now_and_then, daemon=True)
    teller.start()
    try:
        yield
    finally:
        stopped.set()
        teller.join()
        if tells_end:
            tell()


@contextlib.contextmanager
def share_shown(what: str) -> Iterator[Callable[[float], None]]:
    """Show meanwhile how large a share of something is done; yields what has to hear of it."""
    bar = Bar(f"{{done:.0%}} of the {what}", 1.0)
    with shown(bar, tells_end=False):
        yield bar.move


@contextlib.contextmanager
def count_shown(what: str, total: int) -> Iterator[Callable[[], None]]:
    """Show meanwhile how many of something are done; yields what has to hear of each."""
    bar = Bar(f"{{done}} of {{total}} {what}", total)
    with shown(bar, tells_end=False):
        yield bar.step


def say(line: str) -> None:
    """Write a line on standard error."""
    Console(stderr=True, highlight=False, emoji=False).print(line, markup=False, soft_wrap=True)


class HasBound(Protocol):
    """Missions so far, and the bound of the last look at them."""

    bound: Interval

    @property
    def missions(self) -> int:
        """How many there are."""


class Watch(Bar):
    """Seconds of the budget, missions and the bound so far."""

    def __init__(self, looks: HasBound, budget: float) -> None:
        self._looks, self._start = looks, time.monotonic()
        self.until = self._start + budget  # [s] of the monotonic clock
        super().__init__("{done:.0f} of {total:.0f} s", budget)

    @property
    def text(self) -> str:
        """Seconds, missions and bound."""
        seconds = f"{time.monotonic() - self._start:.0f} of {self.total:.0f} s"
        return f"{seconds}: {self.note}"

    @property
    def note(self) -> str:
        """Missions and bound."""
        self.done = time.monotonic() - self._start
        if not self._looks.missions:
            return "no mission is finished yet"
        missions = counted(self._looks.missions, "mission")
        bound = interval_text(self._looks.bound, 2, True, "no look yet")
        return f"{missions}, NEW less OLD [USD]: {bound}"
