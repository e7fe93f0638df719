"""The command ``navbench ablate``: one localizer after the other on the same deliveries."""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from harness.cli.options import refuse_others, study_options
from harness.cli.streams import print_json
from navstack.errors import InputError

if TYPE_CHECKING:
    from harness.ablation.analysis import Declaration
    from harness.study.places import Where
    from harness.task.study import Study


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
@click.option("--correlation-time", type=float, help="[s] over which an injected error changes; default: 10.")
@click.option("--against", metavar="ARM", help="Arm to which the others are compared; default: the first.")
@study_options
@click.option("--out", type=click.Path(path_type=Path), help="Run folder; default: results/<time>-ablate-<stack>.")
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
    if resume is not None:
        refuse_others(context)
        sys.exit(resume_ablation(resume, against, where, as_json))
    if more_errors and not errors:
        raise InputError(f"'{more_errors[0]}' follows no --inject; give --inject {more_errors[0]}, or leave it out")
    names = [name.strip() for name in localizers.split(",")] if localizers is not None else []
    study = ablation_study(
        names, (*errors, *more_errors), correlation_time, stack=stack, workers=where.workers, **choices
    )
    sys.exit(start_ablation(study, Path(stack).stem, against, out, where, as_json))


def ablation_study(
    localizers: Sequence[str], errors: Sequence[str], correlation_time: float | None, stack: str, **choices: Any
) -> "Study":
    """The study of an ablation: arms in place of stacks.

    Raises:
        InputError: a value that ``navbench run`` would refuse too, or arms that cannot be had.
    """
    from harness.ablation.arms import arms_of, with_arms
    from harness.task.study import make_study

    study = make_study(stacks=[stack], **choices)
    arms = arms_of(study.stacks[0], localizers, errors, correlation_time, study.template.allow_unknown)
    return with_arms(study, arms, choices["workers"])


def start_ablation(
    study: "Study", stack: str, against: str | None, out: Path | None, where: "Where", as_json: bool
) -> int:
    """Drive a new ablation, show progress on stderr, print the report on stdout; returns the exit status."""
    from harness.ablation.analysis import Declaration
    from harness.cli.progress import say
    from harness.storage.run_folder import ABLATION, create_run, default_folder, require_usable
    from harness.study.manifest import about, load_study, parameters
    from harness.study.preflight import check
    from navstack.params.strict import dump_dataclass

    declaration = Declaration(stack, against or study.stacks[0].name)
    declaration.check(study.stacks)
    path = out or default_folder(f"ablate-{stack}")
    require_usable(path)
    first = study.stacks[0].name
    for note in check(study):
        if note.startswith(f"{first}: "):  # all arms share the Nav2 file and the robot that notes are about
            say(f"note: {stack}: {note.removeprefix(f'{first}: ')}")
    create_run(path, about(study, sys.argv), {**parameters(study), ABLATION: dump_dataclass(declaration)})
    return _drive(declaration, load_study(path, study.workers), path, where, as_json)


def resume_ablation(path: Path, against: str | None, where: "Where", as_json: bool) -> int:
    """Go on with the ablation of a run folder; otherwise as :func:`start_ablation`."""
    from harness.ablation.analysis import Declaration
    from harness.cli.progress import say
    from harness.storage.run_folder import ABLATION
    from harness.study.manifest import load_study, version_notes
    from navstack.params.strict import load_dataclass

    path = path.resolve()  # a link may point elsewhere before the run ends
    study = load_study(path, where.workers)
    stored = path / "params" / ABLATION
    if not stored.is_file():
        raise InputError(f"'{path}' is no ablation: params/{ABLATION} is missing; use navbench run --resume")
    declaration = load_dataclass(Declaration, stored)
    declaration = Declaration(declaration.stack, against or declaration.against)
    declaration.check(study.stacks)
    for note in version_notes(path):
        say(f"note: {note}")
    return _drive(declaration, study, path, where, as_json)


def _drive(declaration: "Declaration", study: "Study", path: Path, where: "Where", as_json: bool) -> int:
    from harness.ablation.analysis import analyse
    from harness.ablation.document import document
    from harness.cli.driving import drive_folder, exit_status
    from harness.episode.factory import prices_of
    from harness.report.ablation import draw_ablation, print_ablation
    from harness.report.tables import report_console
    from harness.study.stored_run import load_run
    from harness.study.suite import write_document

    results, interrupted = drive_folder(study, path, where)
    prices = prices_of(study.template.prices)
    ablation = analyse(declaration, results, load_run(str(path)), prices, study.episodes)
    figures = draw_ablation(ablation, path)
    content = document(ablation, study, prices)
    write_document(path / "ablation.json", content)
    if as_json:
        content = {**content, "figures": [str(figure) for figure in figures], "folder": str(path)}
        print_json(content)
    else:
        print_ablation(ablation, figures, path, report_console())
    return exit_status(results, interrupted)
