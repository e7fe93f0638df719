"""The command ``navbench tune``: from a Nav2 file to one that earns more."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from navbench.cli.common.brief import Brief
from navbench.cli.driving import INTERRUPTED, SOME_ERRORS
from navbench.cli.options import (
    ESTIMATOR,
    FULL,
    LOCALIZER,
    completed,
    condition_options,
    path_option,
    refuse_others,
)
from navbench.cli.streams import print_json

if TYPE_CHECKING:
    from harness.study.places import Where
    from navbench.api.tuning.written import Tuned

DEFAULT_STACK = "nav2-stock"
MOST_LINT = 4  # findings that are printed
SHOWN = (  # in the help
    *("stack", "localizer", "spaces", "objective", "estimator", "trials", "budget", "episodes"),
    *("test_episodes", "map", "world", "out", "resume", "is_full"),
)


@click.command(cls=Brief, shown=SHOWN)
@click.option(
    "--stack",
    shell_complete=completed("stacks"),
    default=DEFAULT_STACK,
    show_default=True,
    help="What is tuned: a name of params/stacks, a stack file or a Nav2 parameter file.",
)
@LOCALIZER
@click.option(
    "--space",
    "spaces",
    shell_complete=completed("spaces"),
    multiple=True,
    default=("dwb_critics",),
    show_default=True,
    help="What may change: a name of params/search_spaces or a YAML file; may be repeated.",
)
@click.option(
    "--objective",
    default="margin",
    show_default=True,
    help="margin, capped_margin, shared_margin, cvar, lower_bound, margin@sla>=SHARE, or a "
    "metric such as "
    "-duration_s; several, separated by commas, for a Pareto front.",
)
@ESTIMATOR
@click.option("--sampler", default="tpe", show_default=True, help="tpe, cmaes, random or grid.")
@click.option(
    "--trials", type=int, default=100, show_default=True, help="Files to try, beside the original."
)
@click.option(
    "--budget",
    help=(
        "Wall time of everything, e.g. 30m; trials and test missions for which there is no "
        "time are left out."
    ),
)
@click.option(
    "--episodes",
    type=int,
    show_default="32, fewer for a short --budget",
    help="Training missions, the same for every trial; racing likes 40, 80 and the like.",
)
@click.option(
    "--test-episodes",
    type=int,
    show_default="400, fewer for a small search",
    help="Unseen missions on which original and result are compared; 0: none.",
)
@click.option(
    "--finalists",
    type=int,
    default=4,
    show_default=True,
    help="Trials that meet the original on further training missions at the end; 0: none.",
)
@click.option(
    "--final-episodes",
    type=int,
    show_default="128, fewer for a small search",
    help="Such missions; the worse half of the finalists drops out after each round.",
)
@click.option(
    "--racing/--no-racing",
    "is_raced",
    default=True,
    help="Whether hopeless trials are dropped early.",
)
@click.option(
    "--waterfall",
    "waterfall_missions",
    type=click.IntRange(0, 1000),
    show_default="40, fewer",
    help="Missions on which the explanation drives mixtures of old and new; 0: no waterfall.",
)
@condition_options
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    help="Study folder; default: results/<time>-tune-<stack>.",
)
@path_option(
    "--resume", "DIR", "Go on with an interrupted study, or print a finished one, from its folder."
)
@FULL
@click.pass_context
def tune(
    context: click.Context,
    /,
    budget: str | None,
    out: Path | None,
    resume: Path | None,
    where: "Where",
    as_json: bool,
    is_full: bool,
    **choices: Any,
) -> None:
    """Tune a Nav2 file for what its deliveries earn, and test it on missions it never saw.

    Your file drives the training missions first; where no file can earn 0.50 USD more on them, the
    search stops. Every trial drives the same ones, until it is worse than the best so far. The best
    few meet again on further ones, and original and result are compared on test missions. The study
    folder has the tuned file with your comments, its lint, every trial, and the line that drives
    the test again. Ctrl-C keeps what is finished; --resume goes on.

    \b
    Examples:
      navbench tune --stack my_nav2.yaml --localizer gps-ekf --space dwb_critics --trials 100
      navbench tune --space dwb_critics --world social_force --objective shared_margin --budget 2h
      navbench tune --stack nav2-stock --space dwb_sampling --objective cvar --budget 30m
      navbench tune --stack nav2-gps --space inflation --estimator meetings --budget 1h
      navbench tune --stack mpc-gps-ekf --space mpc_weights --objective "margin@sla>=0.9"
      navbench tune --stack nav2-gps --space inflation --objective margin,-pedestrian_delay_s
      navbench tune --resume results/latest --test-episodes 800

    Exit status: 0 finished; 1 bad input; 3 finished, but some deliveries ended in an error; 130
    interrupted.
    """
    from harness.tuning.declaration import SIZES, parse_duration
    from navbench.api.driving import say_notes
    from navbench.api.progress import say
    from navbench.api.tuning import tune as api

    seconds = None if budget is None else parse_duration(budget)
    if resume is not None:
        refuse_others(context, "is_full", *SIZES)
        more = {name: choices[name] for name in SIZES}
        found = api.resume_tuning(resume, seconds, where, **more)
    else:
        found = api.tune(budget=seconds, out=out, where=where, **choices)
    if found is None:
        sys.exit(INTERRUPTED)
    if as_json:
        print_json(found.as_json())
        say_notes(found.notes)
    else:
        _print(found, is_full)
    if found.errors:
        count, first = len(found.errors), found.errors[0]
        say(f"episodes that ended in an error: {count}, e.g. {first}")
        sys.exit(SOME_ERRORS)


def _print(found: "Tuned", is_full: bool) -> None:
    from harness.report.tables import print_blocks, report_console
    from harness.report.tuning.document import lint_lines, short_tuning, tuning_blocks
    from navbench.api.driving import say_notes

    path = found.folder
    blocks = short_tuning(found.result, found.scores, found.explanation, found.about, path)
    if is_full:
        blocks = tuning_blocks(
            found.result, found.scores, found.explanation, found.run_command, path
        )
    print_blocks(blocks, report_console())
    if found.result.incumbent.values:
        first, *rest = lint_lines(found.lint)
        lines = [f"lint of the tuned file: {first}", *(f"  {line}" for line in rest[:MOST_LINT])]
        sys.stdout.write("".join(f"{line}\n" for line in lines))
    sys.stdout.flush()
    say_notes(found.notes)
    sys.stdout.write(f"next: {found.next_command}\n")
