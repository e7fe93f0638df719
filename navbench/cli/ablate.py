"""The command ``navbench ablate``: one localizer after the other on the same deliveries."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from navbench.cli.options import refuse_others, study_options
from navstack.errors import InputError

if TYPE_CHECKING:
    from harness.study.places import Where


DEFAULT_STACK = "nav2-amcl"  # it drives as nav2-gps does, and its AMCL knows the wheels


@click.command()
@click.argument("more_errors", nargs=-1, metavar="[KIND=SIZE[,SIZE]]...")
@click.option("--localizers", metavar="NAME[@MAP][,...]", help="Localizers, each on its own or another map of the "
              "stack (geometry, navigation_mesh); default: all, with --inject ground_truth.")  # fmt: skip
@click.option("--stack", default=DEFAULT_STACK, show_default=True,
              help="What drives: a name of params/stacks, a stack file or a Nav2 parameter file.")  # fmt: skip
@click.option("--inject", "errors", multiple=True, metavar="KIND=SIZE[,SIZE]",
              help="Errors on top of ground_truth, an arm each: position [m, RMS] or heading [deg, RMS]; repeatable, "
              "and more may follow.")  # fmt: skip
@click.option(
    "--correlation-time", type=float, help="[s] over which an injected error changes; default: 10."
)
@click.option(
    "--against", metavar="ARM", help="Arm to which the others are compared; default: the first."
)
@study_options
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    help="Run folder; default: results/<time>-ablate-<stack>.",
)
@click.option("--resume", type=click.Path(path_type=Path), metavar="DIR",
              help="Go on with an interrupted ablation, or print a finished one, from its folder.")  # fmt: skip
@click.pass_context
def ablate(
    context: click.Context,
    /,
    more_errors: tuple[str, ...],
    localizers: str | None,
    stack: str,
    errors: tuple[str, ...],
    correlation_time: float | None,
    against: str | None,
    out: Path | None,
    resume: Path | None,
    where: "Where",
    as_json: bool,
    **choices: Any,
) -> None:
    """Drive one stack with one localizer after the other on the same missions, people and noise.

    The report tells what each knows of its position, what that earns, what its sensors cost, and which differences are
    more than chance.

    docs/ablation.md tells how to read the report and where its formulas are from.

    \b
    Examples:
      navbench ablate --localizers ground_truth,gps,amcl --episodes 200
      navbench ablate --localizers ground_truth,amcl,amcl@navigation_mesh --against amcl
      navbench ablate --inject position=0.1,0.3,1.0 heading=2,5 --episodes 100
      navbench ablate --localizers gps,gps-ekf --sensors rtk_urban --json
      navbench ablate --resume results/latest
    """
    from navbench.cli.ablate_study import create_ablation, drive, stored_ablation

    if resume is not None:
        refuse_others(context)
        path, study, declaration = stored_ablation(resume, against, where)
    else:
        if more_errors and not errors:
            raise InputError(
                f"'{more_errors[0]}' follows no --inject; give --inject {more_errors[0]}, or leave it out"
            )
        names = [name.strip() for name in localizers.split(",")] if localizers is not None else []
        arms = names, (*errors, *more_errors), correlation_time
        path, study, declaration = create_ablation(
            stack, *arms, against, out, {**choices, "workers": where.workers}
        )
    sys.exit(drive(declaration, study, path, where, as_json))
