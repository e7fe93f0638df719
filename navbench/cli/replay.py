"""The command ``navbench replay``."""

from pathlib import Path

import click

from harness.storage.texts import quoted
from navbench.cli.options import path_option
from navbench.cli.report import print_size

PAGE = Path("replay.html")


@click.command()
@click.argument("run", metavar="RUN")
@click.argument("episode", type=click.IntRange(min=0), required=False)
@path_option(
    "--html", "FILE.html", f"A page that plays it; default: {PAGE}, where --mcap is not given."
)
@path_option("--mcap", "FILE.mcap", "ROS 2 messages.")
def replay(run: str, episode: int | None, html: Path | None, mcap: Path | None) -> None:
    """Show one delivery: as a page, or in the tools of ROS.

    RUN is a run folder, or RUN:STACK; EPISODE is the number of the delivery, by default the one
    that lost most. What was not recorded (navbench run --record full) is driven again. The page
    plays it with map, scan, people, tracks, plan, belief and costs. The MCAP file holds tf, map,
    scan, odom, path and markers as ROS 2 messages: Foxglove opens it, ros2 bag plays it.

    \b
    Examples:
      navbench replay results/latest
      navbench replay results/latest:nav2-gps 3 --mcap delivery.mcap
    """
    from harness.report.short.setup import delivery_line
    from navbench.api import report as api
    from navbench.cli.common.dearest import chosen

    loaded, episode = chosen(run, episode)
    if not (html or mcap):
        html = PAGE
    count = api.replay(loaded, episode, html=html, mcap=mcap)
    click.echo(delivery_line(loaded.stored, episode))
    if html:
        print_size(html, "page, ")
    if mcap:
        print_size(mcap, f"{count} messages, ")
    place = f"{loaded.folder}:{loaded.stacks[0]}"
    click.echo(f"next: navbench explain {quoted(place)} {episode}")
