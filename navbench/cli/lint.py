"""``navbench lint``: what is wrong with a Nav2 parameter file, and what hurts on a real robot."""

import shlex
import sys
from collections import defaultdict
from collections.abc import Sequence

import click
from rich.console import Console
from rich.table import Table
from rich.text import Text

from harness.report.numbers import counted
from harness.report.tables import report_console
from navbench.api import lint as api
from navbench.api.lint import Linted
from navbench.cli.options import FULL, JSON
from navbench.cli.streams import print_json
from navstack.errors import ParameterError
from navstack.params.lint import rules
from navstack.params.nav2_file.findings import Notice

MOST_FINDINGS = 22  # with a line each
LONGEST = 120  # [characters] of why


def _print_rules(context: click.Context, _: click.Parameter, is_asked: bool) -> None:
    """Print every finding there is, and end."""
    if is_asked:
        sys.stdout.write(rules.catalog())
        context.exit()


@click.command()
@click.argument("file")
@click.option("--robot", help="A name of params/robots or a file, to hold the file against.")
@click.option(
    "--rules",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_print_rules,
    help="Print all it looks for.",
)
@click.option(
    "--strict",
    is_flag=True,
    help="Names that Nav2 does not know are errors; Nav2 and navbench run let them pass.",
)
@FULL
@JSON
def lint(file: str, robot: str | None, strict: bool, is_full: bool, as_json: bool) -> None:
    """Check a Nav2 parameter file: errors, and combinations of values that will cause trouble.

    FILE is a path or a name of params/nav2.

    \b
    Examples:
      navbench lint my_robot_nav2.yaml
      navbench lint my_robot_nav2.yaml --robot segway_e1
      navbench lint tuned --json
      navbench lint --rules

    Exit status: 0 no errors (there may be warnings); 1 errors, for which navbench run refuses it.
    """
    found = api.lint(file, robot, strict=strict)
    if as_json:
        print_json(found.as_json(), ensure_ascii=False)
    elif is_full:
        _print(found, report_console())
    else:
        for line in _short(found):
            click.echo(line)
        again = ["navbench", "lint", file]
        if robot is not None:
            again += ["--robot", robot]
        if strict:
            again.append("--strict")
        click.echo(f"next: {shlex.join([*again, '--full'])}")
    if found.errors:
        first, *others = found.errors
        more = f" (and {len(others)} more)" if others else ""
        advice = "" if first.advice else "; correct it, or see navbench lint --help"
        raise ParameterError(f"{found.path}: {first}{more}{advice}")


def _short(found: Linted) -> list[str]:
    """How much was found, and a line for each finding: why, shortened, and advice."""
    notices = [*found.errors, *found.warnings]
    lines = [_counts(found)]
    for notice in notices[:MOST_FINDINGS]:
        begin = "error" if notice.is_error else "warning"
        if notice.line:
            begin += f", line {notice.line}"
        if notice.path:
            begin += f": {notice.path}"
        why = notice.message
        if len(why) > LONGEST:
            why = why[:LONGEST].rpartition("; ")[0] or why.partition("; ")[0]
        advice = f" > {notice.advice}" if notice.advice else ""
        lines.append(f"{begin}: {why}{advice} [{notice.id}]")
    if len(notices) > MOST_FINDINGS:
        lines.append(f"and {len(notices) - MOST_FINDINGS} more")
    return lines


def _print(found: Linted, console: Console) -> None:
    for title, notices, style in (
        ("Errors", found.errors, "bold red"),
        ("Warnings", found.warnings, "bold yellow"),
    ):
        if notices:
            console.print(Text(title, style=style))
            console.print(_table(notices))
            console.print()
    if found.ignored:
        console.print(Text("Not modelled here", style="bold"))
        for node, names in _by_node(found.ignored).items():
            line = f"{node}: {', '.join(names)}" if names else node
            console.print(Text(line, style="dim"))
        console.print()
    console.print(Text(_counts(found)))


def _counts(found: Linted) -> str:
    counts = (
        counted(len(found.errors), "error"),
        counted(len(found.warnings), "warning"),
        f"{len(found.ignored)} ignored",
    )
    text = f"{found.path}: {', '.join(counts)}"
    if found.releases:
        text += f"; reads like a file of Nav2 {' or '.join(found.releases)}"
    return text


def _table(notices: Sequence[Notice]) -> Table:
    """Line and finding side by side: id and path, what was found, the advice."""
    table = Table.grid(padding=(0, 2, 0, 0), expand=True)
    table.add_column(justify="right", no_wrap=True)
    table.add_column(ratio=1)
    for notice in notices:
        lines = [Text.assemble((notice.id, "bold"), "  ", notice.path), Text(notice.message)]
        if notice.advice:
            lines.append(Text.assemble(("> ", "green"), notice.advice))
        table.add_row(Text(str(notice.line or ""), style="dim"), Text("\n").join(lines))
    return table


def _by_node(ignored: Sequence[str]) -> dict[str, list[str]]:
    """``node: parameter`` grouped by node; what has no parameter is ignored as a whole."""
    groups: dict[str, list[str]] = defaultdict(list)
    for each in ignored:
        node, _, name = each.partition(": ")
        names = groups[node]
        if name:
            names.append(name)
    return groups
