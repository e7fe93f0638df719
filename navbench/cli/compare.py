"""The command ``navbench compare``: two runs, or two stacks of one, mission by mission."""

import shlex

import click

from harness.analysis.compare import comparison_document
from harness.economics.cost_terms import MARGIN
from harness.report.comparison import comparison_blocks
from harness.report.short.findings import short_comparison
from harness.report.short.meetings_arms import next_command, short_arms
from harness.report.tables import print_blocks, report_console
from navbench.api import money
from navbench.api.meetings.compare import compare_by_meetings, is_by_meetings
from navbench.api.progress import say
from navbench.api.runs import load
from navbench.cli.options import FULL, JSON
from navbench.cli.streams import print_json
from navstack.errors import InputError


@click.command()
@click.argument("first", metavar="A")
@click.argument("second", metavar="B")
@click.option(
    "--metric",
    "metrics",
    multiple=True,
    help=(
        "Compare this one only, e.g. margin; repeatable, p adjusted for all that are named. "
        "Default: all metrics, of which the margin decides."
    ),
)
@FULL
@JSON
def compare(
    first: str, second: str, metrics: tuple[str, ...], is_full: bool, as_json: bool
) -> None:
    """Compare two runs, or two stacks of one, on their common missions: B minus A.

    A and B are run folders, or FOLDER:stack where a folder has several stacks. Two stacks of a
    folder made with --estimator meetings are compared by their meetings.

    \b
    Examples:
      navbench compare results/before results/after
      navbench compare results/both:nav2-gps results/both:parked
      navbench compare results/before results/after --metric sla --metric margin --json
    """
    if is_by_meetings(first) or is_by_meetings(second):
        if set(metrics) - {"margin", MARGIN}:
            raise InputError("meetings tell the margin alone; leave out --metric")
        _compare_by_meetings(first, second, as_json)
        return
    comparison = money.compare(load(first), load(second), metrics)
    for warning in comparison.warnings:
        say(f"note: not comparable: {warning}")
    if as_json:
        print_json(comparison_document(comparison))
    else:
        blocks = comparison_blocks if is_full else short_comparison
        print_blocks(blocks(comparison), report_console())
        sides = comparison.first, comparison.second
        folders = dict.fromkeys(str(side.run.folder) for side in sides)
        click.echo(f"next: navbench report {shlex.join(folders)}")


def _compare_by_meetings(first: str, second: str, as_json: bool) -> None:
    found = compare_by_meetings(first, second)
    if as_json:
        print_json(found.comparison_json())
    else:
        print_blocks(short_arms(found), report_console())
        click.echo(f"next: {next_command(found)}")
