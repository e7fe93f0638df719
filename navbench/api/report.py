"""Finished runs as a page, and a recorded delivery as a page or as messages."""

import datetime
from collections.abc import Sequence
from pathlib import Path

from harness.report.page.document import replay_page, report_page
from harness.report.page.entries import notes_of
from harness.report.page.replays import one_recorded, shown
from harness.report.page.scenery import scene_of_run
from harness.report.replay_bag import write_bag
from harness.storage.files import require_writable, write_text, writing
from harness.study.stored_run import StoredRun
from harness.world.map.scene import Scene
from navbench.api.driving import say_notes
from navbench.api.progress import say
from navbench.api.runs import Run
from navstack.errors import InputError, NavstackError

REPLAYS = 20
PAGES = (".html", ".htm")  # suffixes


def report(runs: Sequence[Run], out: Path = Path("report.html"), replays: int = REPLAYS) -> None:
    """Write a report of runs as one HTML page that needs no server and no network.

    Args:
        runs: they are shown beside each other.
        out: the page; an existing one is replaced.
        replays: most recorded deliveries in it, the costliest of each stack first.

    Raises:
        InputError: the page cannot be written.
    """
    require_writable("page", out, PAGES)
    stored = [run.stored for run in runs]
    page = report_page(stored, replays, today())
    say_notes(notes_of(stored))
    with writing(out):
        write_text(out, page)


def replay(run: Run, episode: int, *, html: Path | None = None, mcap: Path | None = None) -> int:
    """One recorded delivery as a page, or as ROS 2 messages.

    Args:
        run: with one stack, driven with ``record="full"``.
        episode: number of the delivery.
        html: a page that plays it.
        mcap: ROS 2 messages.

    Returns:
        How many messages were written.

    Raises:
        InputError: nothing is asked for, a file cannot be written, or it was not recorded.
    """
    if not (html or mcap):
        raise InputError("nothing to make of the delivery; give --html FILE or --mcap FILE")
    for what, path, suffixes in (("page", html, PAGES), ("MCAP file", mcap, (".mcap",))):
        if path is not None:
            require_writable(what, path, suffixes)
    recorded = one_recorded(run.stored, episode)
    if html:
        with writing(html):
            write_text(html, replay_page(recorded, today()))
    if not mcap:
        return 0
    delivery, scene = shown(recorded), map_of(run.stored, "the replay")
    grid = None
    if scene is not None:
        grid = scene.geometry
    return write_bag(mcap, delivery, grid)


def map_of(run: StoredRun, what: str) -> Scene | None:
    """The map of a run.

    None, and a note that ``what`` has none, where it is gone or has changed since.
    """
    try:
        return scene_of_run(run)
    except NavstackError as error:
        say(f"note: {what} has no map: {error}")
        return None


def today() -> str:
    """Of the machine's clock."""
    return datetime.date.today().isoformat()
