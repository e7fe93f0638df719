"""Finished runs as a page, and a recorded delivery as a page or as messages."""

import datetime
import tempfile
from collections.abc import Sequence
from pathlib import Path

from harness.analysis.compare import side_of
from harness.analysis.dearest import dearest
from harness.execution.process_cache import forget_changed
from harness.report.page.document import replay_page, report_page
from harness.report.page.entries import notes_of
from harness.report.page.replays import one_recorded, shown
from harness.report.page.scenery import scene_of_run
from harness.report.replay_bag import write_bag
from harness.storage.files import require_writable, write_text, writing
from harness.study.stored_run import StoredRun, require_different
from harness.world.map.scene import Scene
from navbench.api.driving import say_notes
from navbench.api.progress import count_shown, say
from navbench.api.runs import Run
from navstack.errors import InputError, NavstackError

REPLAYS = 20
AGAIN = 3  # dearest deliveries that a page plays
PAGES = (".html", ".htm")  # suffixes


def report(
    runs: Sequence[Run],
    out: Path = Path("report.html"),
    replays: int = REPLAYS,
    again: int = AGAIN,
) -> None:
    """Write a report of runs as one HTML page that needs no server and no network.

    Args:
        runs: they are shown beside each other.
        out: the page; an existing one is replaced.
        replays: most recorded deliveries in it, the costliest of each stack first.
        again: dearest deliveries that are driven again for the page where they were not recorded.

    Raises:
        InputError: the page cannot be written, or a stack of a run is given twice.
    """
    require_writable("page", out, PAGES)
    stored = [run.stored for run in runs]
    require_different(stored)
    with tempfile.TemporaryDirectory(prefix="navbench-") as folder:
        recordings, notes = _drive_again(stored, min(again, replays), Path(folder))
        page = report_page(stored, replays, today(), recordings, notes)
    say_notes([*notes_of(stored), *notes])
    with writing(out):
        write_text(out, page)


def _drive_again(
    runs: Sequence[StoredRun], most: int, folder: Path
) -> tuple[dict[tuple[Path, str, int], Path], list[str]]:
    """Drive the dearest deliveries again that were not recorded.

    Returns:
        Their recordings, and why some could not be driven.
    """
    # the simulator is loaded only where something is driven
    from harness.explain.evidence import record_again, recording_file
    from harness.explain.moments import costly_episodes

    recordings: dict[tuple[Path, str, int], Path] = {}
    on_maps = [run for run in runs if not run.has_legs]
    missing = [
        each
        for each in dearest(on_maps, most)
        if not recording_file(each.run, each.episode).is_file()
    ]
    if not missing:
        return recordings, []
    forget_changed()
    say(f"for the page the {len(missing)} dearest deliveries are driven again, recorded")
    with count_shown("of them", len(missing)) as has_driven:
        for number, each in enumerate(missing):
            own = folder / str(number)
            own.mkdir()
            try:
                # why it was costly is told of those that were
                is_costly = each.episode in costly_episodes(each.run)
                path = record_again(each.run, each.episode, own, is_costly)
            except NavstackError as error:
                return recordings, [f"the dearest deliveries cannot be driven again: {error}"]
            recordings[each.run.folder, each.stack, each.episode] = path
            has_driven()
    return recordings, []


def replay(run: Run, episode: int, *, html: Path | None = None, mcap: Path | None = None) -> int:
    """One recorded delivery as a page, or as ROS 2 messages.

    Args:
        run: with one stack; what was not recorded with ``record="full"`` is driven again.
        episode: number of the delivery.
        html: a page that plays it.
        mcap: ROS 2 messages.

    Returns:
        How many messages were written.

    Raises:
        InputError: nothing is asked for, a file cannot be written, or the delivery cannot be
            driven again.
    """
    if not (html or mcap):
        raise InputError("nothing to make of the delivery; give --html FILE or --mcap FILE")
    for what, path, suffixes in (("page", html, PAGES), ("MCAP file", mcap, (".mcap",))):
        if path is not None:
            require_writable(what, path, suffixes)
    with tempfile.TemporaryDirectory(prefix="navbench-") as folder:
        return _replay(run.stored, episode, html, mcap, Path(folder))


def _replay(
    run: StoredRun, episode: int, html: Path | None, mcap: Path | None, folder: Path
) -> int:
    from harness.explain.evidence import (
        delivery_row,
        record_again,
        recording_file,
        require_one_map,
    )

    require_one_map(run, "replay")
    forget_changed()
    path = recording_file(side_of(run).run, episode)
    delivery_row(run, episode)
    if path.exists() and not path.is_file():
        raise InputError(f"{path} is not a file; remove it, and the delivery is driven again")
    if not path.is_file():
        say(f"episode {episode} of {run.stacks[0].name} is driven again")
        path = record_again(run, episode, folder)
    recorded = one_recorded(run, episode, path)
    if html:
        with writing(html):
            write_text(html, replay_page(recorded, today()))
    if not mcap:
        return 0
    delivery, scene = shown(recorded), map_of(run, "the replay")
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
