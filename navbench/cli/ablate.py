"""The command ``navbench ablate``: one localizer after the other on the same deliveries."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from navbench.cli.driving import asked_deliveries, exit_status, say_how_to_go_on
from navbench.cli.options import (
    ESTIMATOR,
    FULL,
    RETRY_ERRORS,
    path_option,
    refuse_others,
    study_options,
)
from navbench.cli.streams import print_json
from navbench.cli.values import names_of
from navstack.errors import InputError

if TYPE_CHECKING:
    from harness.ablation.meetings import MeetingsArms
    from harness.study.places import Where
    from navbench.api.ablate import Ablated


DEFAULT_STACK = "nav2-amcl"  # it drives as nav2-gps does, and its AMCL knows the wheels


@click.command()
@click.argument("more_errors", nargs=-1, metavar="[KIND=SIZE[,SIZE]]...")
@click.option(
    "--localizers",
    metavar="NAME[@MAP][,...]",
    help="Localizers, each on its own or another map of the "
    "stack (geometry, navigation_mesh); default: all, with --inject ground_truth.",
)
@click.option(
    "--stack",
    default=DEFAULT_STACK,
    show_default=True,
    help="What drives: a name of params/stacks, a stack file or a Nav2 parameter file.",
)
@click.option(
    "--inject",
    "errors",
    multiple=True,
    metavar="KIND=SIZE[,SIZE]",
    help="Errors on top of ground_truth, compared like localizers: position [m, RMS] or "
    "heading [deg, RMS]; repeatable, and more may follow.",
)
@click.option(
    "--correlation-time", type=float, help="[s] over which an injected error changes; default: 10."
)
@click.option(
    "--against", metavar="ARM", help="Arm to which the others are compared; default: the first."
)
@click.option(
    "--within",
    type=float,
    metavar="USD",
    help="Each arm drives until its margin is known so well, --episodes at most; "
    "default: all drive --episodes.",
)
@ESTIMATOR
@study_options
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    help="Run folder; default: results/<time>-ablate-<stack>.",
)
@path_option(
    "--resume",
    "DIR",
    "Go on with an interrupted ablation, or print a finished one, from its folder.",
)
@RETRY_ERRORS
@FULL
@click.pass_context
def ablate(
    context: click.Context,
    /,
    more_errors: tuple[str, ...],
    localizers: str | None,
    errors: tuple[str, ...],
    against: str | None,
    out: Path | None,
    resume: Path | None,
    retries_errors: bool,
    where: "Where",
    as_json: bool,
    is_full: bool,
    **choices: Any,
) -> None:
    """Drive one stack with one localizer after the other on the same missions, people and noise.

    The report tells what each knows of its position, what that earns, what its sensors cost, and
    which differences are more than chance.

    docs/ablation.md tells how to read the report and where its formulas are from.

    \b
    Examples:
      navbench ablate --localizers ground_truth,gps,amcl --episodes 200
      navbench ablate --localizers ground_truth,amcl,amcl@navigation_mesh --against amcl
      navbench ablate --inject position=0.1,0.3,1.0 heading=2,5 --episodes 100
      navbench ablate --localizers gps,gps-ekf --sensors rtk_urban --json
      navbench ablate --localizers gps-ekf,amcl-gps --within 0.5 --episodes 2000
      navbench ablate --localizers gps-ekf,amcl-gps --estimator meetings --episodes 60
      navbench ablate --resume results/latest
      navbench ablate --resume results/latest --episodes 400
    """
    from harness.ablation.meetings import MeetingsArms
    from navbench.api import ablate as api
    from navbench.api.driving import say_notes

    if resume is not None:
        refuse_others(context, "retries_errors", "is_full", "episodes", "within")
        more = asked_deliveries(context), choices["within"]
        found = api.resume_ablation(resume, against, where, *more, retries_errors)
    elif retries_errors:
        raise InputError("--retry-errors goes with --resume DIR, of an ablation that has some")
    else:
        if more_errors and not errors:
            first = more_errors[0]
            raise InputError(
                f"'{first}' follows no --inject; give --inject {first}, or leave it out"
            )
        names = names_of([] if localizers is None else [localizers])
        choices |= {"against": against, "out": out, "where": where}
        found = api.ablate(localizers=names, errors=(*errors, *more_errors), **choices)
    if as_json:
        print_json(found.as_json())
        say_notes(found.notes)
    elif isinstance(found, MeetingsArms):
        _print_arms(found)
    else:
        _print(found, is_full)
    ended = found if isinstance(found, MeetingsArms) else found.driven
    if ended.is_interrupted:
        say_how_to_go_on("ablate", ended.folder)
    sys.exit(exit_status(ended.is_interrupted, ended.has_errors))


def _print(found: "Ablated", is_full: bool) -> None:
    """The screen of whole deliveries."""
    from harness.report.ablations.screen import ablation_blocks, next_command
    from harness.report.blocks import Text
    from harness.report.short.findings import short_ablation
    from navbench.cli.common.ending import print_with_notes

    folder, ablation = found.driven.folder, found.ablation
    blocks = short_ablation(ablation, folder)
    if is_full:
        blocks = [*blocks[:1], *ablation_blocks(ablation, found.figures, folder)]
    last = f"page: {found.page}"
    if not found.driven.is_interrupted:
        last += f"; next: {next_command(ablation, folder)}"
    print_with_notes([*blocks, Text(last, "whole")], found.notes)


def _print_arms(found: "MeetingsArms") -> None:
    """The screen of meetings."""
    from harness.report.blocks import Text
    from harness.report.short.meetings_arms import next_command, short_arms
    from navbench.cli.common.ending import print_with_notes

    last = f"run folder: {found.folder}"
    if not found.is_interrupted:
        last += f"; next: {next_command(found)}"
    print_with_notes([*short_arms(found), Text(last, "whole")], found.notes)
