"""The command ``navbench check``: a verdict on a changed Nav2 file."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from navbench.cli.common.brief import Brief
from navbench.cli.driving import exit_status
from navbench.cli.options import (
    ANY_ESTIMATOR,
    LOCALIZER,
    condition_options,
    path_option,
    refuse_others,
)
from navbench.cli.streams import print_json
from navbench.cli.values import Finite

if TYPE_CHECKING:
    from harness.study.places import Where

FAILED = 4  # exit status where --fail-if holds
SHOWN = (  # in the help
    *("budget", "fail_if", "markdown", "within", "estimator", "localizer", "seed", "map", "world"),
    *("workers", "out", "resume", "as_json"),
)


@click.command(cls=Brief, shown=SHOWN)
@click.argument("old", required=False)
@click.argument("new", required=False)
@click.option(
    "--budget",
    default="10m",
    show_default=True,
    help="Wall time, e.g. 90s, 10m, 1h; less where fewer missions decide.",
)
@click.option(
    "--fail-if",
    type=click.Choice(["worse"]),
    help="Leave with status 4 if that is the verdict.",
)
@path_option("--markdown", "FILE.md", "Also write the verdict as a comment for a pull request.")
@click.option(
    "--within",
    type=Finite(0.0, 100.0),
    default=1.0,
    show_default=True,
    help="USD a delivery; a difference that is surely no larger makes them alike.",
)
@ANY_ESTIMATOR
@LOCALIZER
@condition_options
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    help="Run folder; default: results/<time>-check-<new>.",
)
@path_option("--resume", "DIR", "Go on with a check, from its folder, for another --budget.")
@click.pass_context
def check(
    context: click.Context,
    /,
    old: str | None,
    new: str | None,
    budget: str,
    fail_if: str | None,
    markdown: Path | None,
    resume: Path | None,
    where: "Where",
    as_json: bool,
    **choices: Any,
) -> None:
    """Tell whether NEW earns more or less than OLD, in dollars a delivery.

    OLD and NEW are Nav2 files or stacks, which drive the same missions until the difference is
    clear or the budget is over; or finished run folders (FOLDER or FOLDER:STACK). The bound holds
    at all looks. A repeated check drives the same missions.

    Exit status beside those of navbench --help: 4, the verdict is the one of --fail-if.

    \b
    Examples:
      navbench check nav2.yaml nav2_new.yaml
      navbench check nav2.yaml nav2_new.yaml --budget 10m --fail-if worse --markdown comment.md
      navbench check results/before results/after --json
      navbench check nav2.yaml nav2_new.yaml --estimator deliveries
      navbench check --resume results/latest --budget 30m
    """
    from harness.analysis.meetings_check import MeetingsChecked
    from harness.report.short.check import short_check
    from harness.report.short.meetings import short_meetings
    from harness.tuning.declaration import parse_duration
    from navbench.api import check as api
    from navbench.api.driving import say_notes
    from navbench.cli.common.ending import print_with_notes

    seconds = parse_duration(budget)
    found: api.CheckResult | MeetingsChecked
    if resume is not None:
        refuse_others(context, "fail_if", "markdown")
        found = api.resume_check(resume, seconds, markdown, where)
    elif old is None or new is None:
        raise click.UsageError("Missing argument 'OLD' or 'NEW'.", context)
    elif api.is_run(old) and api.is_run(new):
        kept = ("within", "estimator")
        beside = ("old", "new", "fail_if", "markdown", "as_json")
        refuse_others(context, *kept, *beside, beside=(), why=api.NOT_DRIVEN)
        found = api.check(old, new, markdown=markdown, **{name: choices[name] for name in kept})
    else:
        found = api.check(old, new, budget=seconds, markdown=markdown, where=where, **choices)
    if as_json:
        print_json(found.as_json())
        say_notes(found.notes)
    elif isinstance(found, MeetingsChecked):
        print_with_notes(short_meetings(found), found.notes)
    else:
        print_with_notes(short_check(found.checked, found.declaration), found.notes)
    if found.verdict == fail_if and not found.is_interrupted:
        sys.exit(FAILED)
    sys.exit(exit_status(found.is_interrupted, found.has_errors))
