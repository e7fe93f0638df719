"""The command ``navbench run``."""

import sys
from pathlib import Path
from typing import Any

import click

from harness.study.places import Where
from navbench.cli.driving import print_driven
from navbench.cli.options import LOCALIZER, refuse_others, study_options
from navstack.errors import InputError


@click.command()
@click.option(
    "--stack",
    "stacks",
    multiple=True,
    default=("nav2-gps",),
    show_default=True,
    help="A name of params/stacks, a stack file or a Nav2 parameter file; repeatable.",
)
@LOCALIZER
@study_options
@click.option(
    "--out", type=click.Path(path_type=Path), help="Run folder; default: results/<time>-<stack>."
)
@click.option(
    "--resume",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Go on with an interrupted run, from its folder alone.",
)
@click.option(
    "--force",
    "is_forced",
    is_flag=True,
    help="With --resume: also if its files were changed; run.json says so.",
)
@click.pass_context
def run(
    context: click.Context,
    /,
    out: Path | None,
    resume: Path | None,
    is_forced: bool,
    where: Where,
    as_json: bool,
    **choices: Any,
) -> None:
    """Drive deliveries and print what they did and what they cost.

    \b
    Examples:
      navbench run --stack nav2-gps --episodes 20
      navbench run --stack nav2-gps --localizer ground_truth --pedestrians 0 --episodes 5
      navbench run --world social --pedestrians 40 --episodes 5
      navbench run --people recorded.csv --episodes 5
      navbench run --start -67.9,-71.9,0 --goal -89.7,-63.5,0 --episodes 3
      navbench run --resume results/latest
    """
    from navbench.api.run import drive, drive_rest

    if resume is not None:
        refuse_others(context, "is_forced")
        driven = drive_rest(resume, where, is_forced)
    elif is_forced:
        raise InputError("--force goes with --resume DIR, whose files were changed")
    else:
        driven = drive(out=out, where=where, **choices)
    sys.exit(print_driven(driven, as_json))
