"""The command ``navbench replay``."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from harness.storage.files import require_writable
from navbench.cli.report import PAGES, today, write_page
from navstack.errors import InputError, NavstackError

if TYPE_CHECKING:
    from harness.study.stored_run import StoredRun
    from harness.world.map.scene import Scene


# fmt: off
@click.command()
@click.argument("run", metavar="RUN")
@click.argument("episode", type=click.IntRange(min=0))
@click.option("--html", type=click.Path(path_type=Path), metavar="FILE.html", help="A page that plays it.")
@click.option("--mcap", type=click.Path(path_type=Path), metavar="FILE.mcap", help="ROS 2 messages.")
# fmt: on
def replay(run: str, episode: int, html: Path | None, mcap: Path | None) -> None:
    """Show one recorded delivery: as a page, or in the tools of ROS.

    RUN is a run folder of navbench run --record full, or RUN:STACK where it has several stacks;
    EPISODE is the number of the delivery. The page plays it with map, scan, people, tracks, plan,
    belief and costs. The MCAP file holds tf, map, scan, odom, path and markers as ROS 2 messages:
    Foxglove opens it, ros2 bag plays it.
    """
    from harness.report.page.document import replay_page
    from harness.report.page.replays import one_recorded, shown
    from harness.report.replay_bag import write_bag
    from harness.study.stored_run import load_run

    if not (html or mcap):
        raise InputError("nothing to make of the delivery; give --html FILE or --mcap FILE")
    for what, path, suffixes in (("page", html, PAGES), ("MCAP file", mcap, (".mcap",))):
        if path is not None:
            require_writable(what, path, suffixes)
    stored = load_run(run)
    recorded = one_recorded(stored, episode)
    if html:
        write_page(html, replay_page(recorded, today()))
    if mcap:
        delivery, scene = shown(recorded), map_of(stored, "the replay")
        grid = None
        if scene is not None:
            grid = scene.geometry
        count = write_bag(mcap, delivery, grid)
        click.echo(f"{mcap}: {count} messages, {mcap.stat().st_size / 1e6:.1f} MB")


def map_of(run: "StoredRun", what: str) -> "Scene | None":
    """The map of a run.

    None, and a note that ``what`` has none, where it is gone or has changed since.
    """
    from harness.report.page.scenery import scene_of_run

    try:
        return scene_of_run(run)
    except NavstackError as error:
        click.echo(f"note: {what} has no map: {error}", err=True)
        return None
