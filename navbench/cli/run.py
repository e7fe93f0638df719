"""The command ``navbench run``."""

import sys
from pathlib import Path
from typing import Any

import click

from harness.study.places import Where
from navbench.cli.common.brief import Brief
from navbench.cli.driving import asked_deliveries, print_driven
from navbench.cli.options import (
    FULL,
    LOCALIZER,
    RETRY_ERRORS,
    completed,
    path_option,
    refuse_others,
    study_options,
)
from navstack.errors import InputError

SHOWN = (  # in the help
    *("stacks", "localizer", "robot", "sensors", "map", "world", "pedestrians", "episodes"),
    *("seed", "prices", "out", "resume", "is_full", "has_page", "as_json"),
)


@click.command(cls=Brief, shown=SHOWN)
@click.option(
    "--stack",
    "stacks",
    shell_complete=completed("stacks"),
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
@path_option("--resume", "DIR", "Go on with an interrupted run, from its folder alone.")
@click.option(
    "--force",
    "is_forced",
    is_flag=True,
    help="With --resume: also if its files were changed; run.json says so.",
)
@RETRY_ERRORS
@FULL
@click.option(
    "--page",
    "has_page",
    is_flag=True,
    help="Write the run's page into its folder, with the three dearest deliveries to watch.",
)
@click.pass_context
def run(
    context: click.Context,
    /,
    out: Path | None,
    resume: Path | None,
    is_forced: bool,
    retries_errors: bool,
    is_full: bool,
    has_page: bool,
    where: Where,
    as_json: bool,
    **choices: Any,
) -> None:
    """Drive deliveries and print what they did and what they cost.

    \b
    Examples:
      navbench run --stack nav2-gps --episodes 20
      navbench run --stack nav2-gps --localizer ground_truth --pedestrians 0 --episodes 5
      navbench run --world social_force --pedestrians 40 --episodes 5
      navbench run --people recorded.csv --episodes 5
      navbench run --start -67.9,-71.9,0 --goal -89.7,-63.5,0 --episodes 3
      navbench run --resume results/latest
      navbench run --resume results/latest --episodes 100
    """
    from navbench.api.run import drive, drive_rest

    if resume is not None:
        refuse_others(context, "is_forced", "retries_errors", "is_full", "has_page", "episodes")
        asked = asked_deliveries(context)
        driven = drive_rest(resume, where, is_forced, retries_errors, asked)
    elif is_forced:
        raise InputError("--force goes with --resume DIR, whose files were changed")
    elif retries_errors:
        raise InputError("--retry-errors goes with --resume DIR, of a run that has some")
    else:
        driven = drive(out=out, where=where, **choices)
    sys.exit(print_driven(driven, as_json, is_full, has_page))
