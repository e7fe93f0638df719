"""The command ``navbench replay``."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from harness.cli.report import PAGES, today, write_page
from harness.storage.files import require_writable
from navstack.errors import InputError, NavstackError

if TYPE_CHECKING:
    from harness.study.stored_run import StoredRun
    from navstack.costmap.occupancy_grid import OccupancyGrid


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

    RUN is a run folder of navbench run --record full, or RUN:STACK where it has several stacks; EPISODE is the number
    of the delivery. The page plays it with map, scan, people, tracks, plan, belief and costs. The MCAP file holds tf,
    map, scan, odom, path and markers as ROS 2 messages: Foxglove opens it, ros2 bag plays it. The GIF shows the whole
    delivery from above.
    """
    from harness.analysis.compare import side_of
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
        from harness.report.replay_rerun import require_rerun

        require_rerun()
    stored = load_run(run)
    side_of(stored)  # one stack
    if html:
        _write_html(stored, episode, html)
    if mcap:
        _write_mcap(stored, episode, mcap)
    if gif:
        _write_gif(stored, episode, gif)
    if rerun:
        _show_rerun(stored, episode)


def _write_html(run: "StoredRun", episode: int, path: Path) -> None:
    from harness.report.page.document import one_recorded, replay_page

    write_page(path, replay_page(*one_recorded(run, episode), today()))


def _write_mcap(run: "StoredRun", episode: int, path: Path) -> None:
    from harness.report.page.document import one_recorded
    from harness.report.page.replays import bodies
    from harness.report.replay_bag import write_bag

    recorded, arrays = one_recorded(run, episode)
    robot, radius = bodies(recorded.entry)
    grid = _map_of(run, "the file")
    count = write_bag(path, arrays, recorded.entry.events_of(episode), grid, robot.polygon, radius)
    click.echo(f"{path}: {count} messages, {path.stat().st_size / 1e6:.1f} MB")


def _write_gif(run: "StoredRun", episode: int, path: Path) -> None:
    from harness.report.page.document import one_recorded
    from harness.report.page.replays import bodies
    from harness.report.page.scenery import scene_of_run
    from harness.report.replay_gif import write_gif

    recorded, arrays = one_recorded(run, episode)
    if "scan_mm" not in arrays:
        raise InputError("this recording holds trajectories only: it is an older one; make the run again")
    robot, radius = bodies(recorded.entry)
    ending = f"{recorded.row['outcome'].replace('_', ' ')} after {recorded.row['duration_s']:.1f} s"
    if recorded.entry.margin is not None:
        ending += f": {-recorded.loss:+.2f} $"
    scene, events = scene_of_run(run), recorded.entry.events_of(episode)
    count = write_gif(path, arrays, events, scene, robot.polygon, radius, ending)
    click.echo(f"{path}: {count} frames, {path.stat().st_size / 1e6:.1f} MB")


def _show_rerun(run: "StoredRun", episode: int) -> None:
    from harness.report.page.document import one_recorded
    from harness.report.page.replays import bodies
    from harness.report.replay_rerun import show_in_rerun

    recorded, arrays = one_recorded(run, episode)
    robot, radius = bodies(recorded.entry)
    events, grid = recorded.entry.events_of(episode), _map_of(run, "the viewer")
    show_in_rerun(f"{recorded.entry.stack.name}-{episode}", arrays, events, grid, robot.polygon, radius)


def _map_of(run: "StoredRun", where: str) -> "OccupancyGrid | None":
    """The map of a run; None, and a note, where it is gone or has changed since."""
    from harness.report.page.scenery import scene_of_run

    try:
        return scene_of_run(run).geometry
    except NavstackError as error:
        click.echo(f"note: {where} has no map: {error}", err=True)
        return None
