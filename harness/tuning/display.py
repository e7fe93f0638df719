"""The live table of a study on a terminal, or a line every ten seconds where there is none."""

import contextlib
import sys
import threading
from collections.abc import Iterator

from rich.console import Console
from rich.live import Live
from rich.table import Table

from harness.tuning.progress import Progress

LINE_PERIOD = 10.0  # [s] between lines where there is no terminal
SHOWN = 8  # trials of the live table


class LiveTable:
    """What rich draws again and again."""

    def __init__(self, progress: Progress) -> None:
        self._progress = progress

    def __rich__(self) -> Table:
        progress = self._progress
        table = Table(title=progress.text, title_justify="left", title_style="")
        for column in ("trial", "state", "episodes", "objective", "p"):
            table.add_column(column, justify="left" if column == "state" else "right")
        for trial in progress.trials[-SHOWN:]:
            value = progress.text_of(trial.told[0]) if trial.told else ""
            p = "" if trial.p is None else f"{trial.p:.3f}"
            mark = "*" if progress.best is trial else ""
            table.add_row(f"{mark}{trial.number}", trial.state, str(len(trial.missions)), value, p)
        return table


@contextlib.contextmanager
def shown(progress: Progress) -> Iterator[None]:
    """Show progress on standard error meanwhile."""
    console = Console(stderr=True, highlight=False)
    if console.is_terminal:
        with Live(LiveTable(progress), console=console, refresh_per_second=2.0):
            yield
        return
    stopped = threading.Event()
    thread = threading.Thread(target=_tell, args=(progress, stopped), daemon=True)
    thread.start()
    try:
        yield
    finally:
        stopped.set()
        thread.join()


def _tell(progress: Progress, stopped: threading.Event) -> None:
    said = ""
    while not stopped.wait(LINE_PERIOD):
        text = progress.text
        if text != said:
            sys.stderr.write(f"{text}\n")
            sys.stderr.flush()
        said = text
