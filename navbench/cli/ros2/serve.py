"""The command ``navbench serve``: the harness as a ROS 2 robot."""

import sys
from pathlib import Path
from typing import Any

import click

from harness.study.places import Where
from navbench.cli.driving import print_driven
from navbench.cli.options import FULL, study_options
from navstack.errors import InputError


@click.command()
@click.option("--name", default="ros2", show_default=True, help="What drives, as rows call it.")
@click.option(
    "--stack",
    default="ros2",
    show_default=True,
    help="A stack file with navigator: ros2: sensors, map, frames and limits.",
)
@click.option(
    "--controller-frequency",
    type=float,
    help="[Hz] of the peer's commands, as in its file; 20, and 0 for one at every tick.",
)
@click.option("--lockstep", is_flag=True, help="The clock waits for commands: so without --rate.")
@click.option("--rate", type=float, help="The clock runs so many times as fast as wall time.")
@click.option("--wait", type=float, help="[s] of wall time for a command in lockstep; 1.")
@click.option("--start-limit", type=float, help="[s] of wall time for the first command; 60.")
@click.option(
    "--settle", type=float, help="[s] of the clock that the robot stands before its goal; 3."
)
@click.option(
    "--localization",
    type=click.Choice(["own", "truth"]),
    help="truth: map -> odom is published by the true pose; own, the default: the peer's.",
)
@study_options
@click.option(
    "--out", type=click.Path(path_type=Path), help="Run folder; default: results/<time>-<name>."
)
@FULL
def serve(
    name: str,
    stack: str,
    out: Path | None,
    is_full: bool,
    where: Where,
    as_json: bool,
    controller_frequency: float | None,
    lockstep: bool,
    rate: float | None,
    wait: float | None,
    start_limit: float | None,
    settle: float | None,
    localization: str | None,
    **choices: Any,
) -> None:
    """Drive deliveries by the commands of your own Nav2, and price them.

    The world is a ROS 2 robot on this machine: it publishes /clock, /tf, /odom, /scan, /imu,
    /gps/fix and /map, sends each goal on /goal_pose, and takes /cmd_vel. docs/ros2.md tells how
    to start Nav2 beside it.

    \b
    Examples:
      navbench serve --name my-nav2 --episodes 20
      navbench serve --name my-nav2 --controller-frequency 30 --localization truth
      navbench serve --name my-nav2 --rate 1 --robot nova_carter --map depot.yaml
    """
    from navbench.api.ros2 import serve as drive

    if lockstep and rate:
        raise InputError(f"--lockstep and --rate {rate:g} exclude each other; give one of them")
    settings = {
        "controller_frequency": controller_frequency,
        "rate": 0.0 if lockstep else rate,
        "wait": wait,
        "start_limit": start_limit,
        "settle": settle,
        "publishes_map_frame": localization and localization == "truth",
    }
    driven = drive(name, stack=stack, settings=settings, out=out, where=where, **choices)
    sys.exit(print_driven(driven, as_json, is_full, False))
