"""Options of commands that read a recorded drive."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

_OPTIONS = (
    click.argument(
        "bags", nargs=-1, required=True, metavar="BAG...", type=click.Path(path_type=Path)
    ),
    click.option(
        "--static-tf",
        multiple=True,
        metavar="TEXT",
        help="Where a sensor is: 'PARENT CHILD x y z roll pitch yaw', [m] and [rad]; repeatable.",
    ),
    click.option(
        "--remap",
        multiple=True,
        metavar="USUAL:=ACTUAL",
        help="Another topic, e.g. /cmd_vel:=/base/cmd_vel; repeatable.",
    ),
    click.option("--base-frame", help="Frame of the robot; default: the odometry's child frame."),
)


def bag_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Give a command the log that it reads."""
    for option in reversed(_OPTIONS):
        command = option(command)
    return command
