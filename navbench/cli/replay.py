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
@click.option("--gif", type=click.Path(path_type=Path), metavar="FILE.gif", help="An animation of all of it.")
@click.option("--mcap", type=click.Path(path_type=Path), metavar="FILE.mcap", help="ROS 2 messages.")
@click.option("--rerun", is_flag=True, help="Show it in the Rerun viewer (pip install 'navbench[rerun]').")
# fmt: on
def replay(
    run: str, episode: int, html: Path | None, gif: Path | None, mcap: Path | None, rerun: bool
) -> None:
    """Show one recorded delivery: as a page, in the tools of ROS, or in the Rerun viewer.

    RUN is a run folder of navbench run --record full, or RUN:STACK where it has several stacks;
    EPISODE is the number of the delivery. The page plays it with map, scan, people, tracks, plan,
    belief and costs. The MCAP file holds tf, map, scan, odom, path and markers as ROS 2 messages:
    Foxglove opens it, ros2 bag plays it. The GIF shows the whole delivery from above.
    """
    from harness.report.page.document import replay_page
    from harness.report.page.replays import one_recorded, shown
    from harness.report.replay_bag import write_bag
    from harness.report.replay_gif import write_gif
    from harness.report.replay_rerun import require_rerun, show_in_rerun
    from harness.study.stored_run import load_run

    if not (html or gif or mcap or rerun):
        raise InputError(
            "nothing to make of the delivery; give --html FILE, --gif FILE, --mcap FILE or --rerun"
        )
    for what, path, suffixes in (
        ("page", html, PAGES),
        ("MCAP file", mcap, (".mcap",)),
        ("animation", gif, (".gif",)),
    ):
        if path is not None:
            require_writable(what, path, suffixes)
    if rerun:
        require_rerun()
    stored = load_run(run)
    recorded = one_recorded(stored, episode)
    if html:
        write_page(html, replay_page(recorded, today()))
    if not (gif or mcap or rerun):
        return
    delivery, scene = shown(recorded), map_of(stored, "the replay")
    grid = None if scene is None else scene.geometry
    if mcap:
        _tell(mcap, write_bag(mcap, delivery, grid), "messages")
    if gif:
        _tell(gif, write_gif(gif, delivery, scene), "frames")
    if rerun:
        show_in_rerun(delivery, grid)


def _tell(path: Path, count: int, what: str) -> None:
    click.echo(f"{path}: {count} {what}, {path.stat().st_size / 1e6:.1f} MB")


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
