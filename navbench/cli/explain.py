"""The command ``navbench explain``."""

from pathlib import Path
from typing import Any

import click

from navbench.cli.options import JSON, Finite


# fmt: off
@click.command()
@click.argument("run", metavar="RUN")
@click.argument("episode", type=click.IntRange(min=0))
@click.option("--stack", help="Of a run of several.")
@click.option("--event", type=click.IntRange(min=1), help="Number of the event; default: all, and the costliest for "
              "--plot and --rewind.")
@click.option("--before", type=Finite(min=0.2, max=60.0), default=5.0, show_default=True,
              help="Seconds shown before the event, and rewound.")
@click.option("--again", is_flag=True, help="Drive it again even if it was recorded: also shows DWB's alternatives.")
@click.option("--rewind", "settings", multiple=True, metavar="PATH=VALUE",
              help="What a parameter of the Nav2 file would have saved, e.g. "
              "controller_server.FollowPath.max_vel_x=1.5; repeatable.")
@click.option("--plot", type=click.Path(path_type=Path), metavar="FILE", help="Figure (PNG, PDF or SVG).")
@click.option("--out", type=click.Path(path_type=Path), metavar="FOLDER",
              help="Folder for explanation.json, explanation.txt and a figure (PDF and PNG) of each event.")
@JSON
# fmt: on
def explain(**choices: Any) -> None:
    """Tell why a delivery cost what it cost: the seconds before each event that had to be paid for.

    RUN is a run folder, or RUN:STACK; EPISODE is the number of the delivery. Where it was not recorded (--record full),
    it is driven again. With --rewind it is driven once more, with another parameter from some seconds before the event
    on.

    \b
    Examples:
      navbench explain results/latest 7
      navbench explain results/latest 7 --stack nav2-gps --event 2 --before 8 --plot event.png
      navbench explain results/latest 7 --rewind controller_server.FollowPath.max_vel_x=1.5
    """
    from navbench.cli.explain_delivery import explain_delivery

    explain_delivery(**choices)
