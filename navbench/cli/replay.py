"""The command ``navbench replay``."""

from pathlib import Path

import click

from navbench.cli.report import print_size


@click.command()
@click.argument("run", metavar="RUN")
@click.argument("episode", type=click.IntRange(min=0))
@click.option(
    "--html", type=click.Path(path_type=Path), metavar="FILE.html", help="A page that plays it."
)
@click.option(
    "--mcap", type=click.Path(path_type=Path), metavar="FILE.mcap", help="ROS 2 messages."
)
def replay(run: str, episode: int, html: Path | None, mcap: Path | None) -> None:
    """Show one recorded delivery: as a page, or in the tools of ROS.

    RUN is a run folder of navbench run --record full, or RUN:STACK where it has several stacks;
    EPISODE is the number of the delivery. The page plays it with map, scan, people, tracks, plan,
    belief and costs. The MCAP file holds tf, map, scan, odom, path and markers as ROS 2 messages:
    Foxglove opens it, ros2 bag plays it.
    """
    from navbench.api import report as api
    from navbench.api.runs import load

    count = api.replay(load(run), episode, html=html, mcap=mcap)
    if html:
        print_size(html)
    if mcap:
        print_size(mcap, f"{count} messages, ")
