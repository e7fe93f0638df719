"""``navbench lint``: what is wrong with a Nav2 parameter file, and what hurts on a real robot."""

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import click
from rich.console import Console
from rich.table import Table
from rich.text import Text

from harness.report.numbers import counted
from harness.report.tables import report_console
from harness.storage.shipped import resolve, shipped
from harness.world.physics.robot import RobotParams
from navbench.cli.options import JSON
from navbench.cli.streams import print_json
from navstack.errors import ParameterError
from navstack.params.lint import rules
from navstack.params.lint.subject import RobotLimits
from navstack.params.nav2_file.file import inspect_nav2
from navstack.params.nav2_file.findings import UNKNOWN_KEY, Notice
from navstack.params.strict import load_dataclass


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
    help="Every key that Nav2 does not know is an error, not the misspelt ones alone.",
)
@JSON
def lint(file: str, robot: str | None, strict: bool, as_json: bool) -> None:
    """Check a Nav2 parameter file: errors, and combinations of values that will cause trouble.

    FILE is a path or a name of params/nav2.

    \b
    Examples:
      navbench lint my_robot_nav2.yaml
      navbench lint my_robot_nav2.yaml --robot segway_e1
      navbench lint tuned --json
      navbench lint --rules

    Exit status: 0 no errors (there may be warnings); 1 errors.
    """
    limits = None if robot is None else robot_limits(robot)
    path = Path(file) if Path(file).is_file() else resolve(file, shipped("params") / "nav2", "Nav2")
    notices, ignored = _findings(path, limits, strict)
    errors = [notice for notice in notices if notice.is_error]
    warnings = [notice for notice in notices if not notice.is_error]
    if as_json:
        document = {
            "errors": _plain(errors),
            "warnings": _plain(warnings),
            "ignored": list(ignored),
        }
        print_json(document, ensure_ascii=False)
    else:
        _print(path, errors, warnings, ignored, report_console())
    if errors:
        more = f" and {len(errors) - 1} more" if len(errors) > 1 else ""
        advice = "" if errors[0].advice else "; correct it, or see navbench lint --help"
        raise ParameterError(f"{path}: {errors[0]}{more}{advice}")


def robot_limits(name_or_file: str) -> RobotLimits:
    """What a robot's body can do.

    Raises:
        InputError: no such robot, or its file cannot be used.
    """
    path = resolve(name_or_file, shipped("params") / "robots", "robot")
    body = load_dataclass(RobotParams, path)
    return RobotLimits(
        path.stem,
        body.polygon,
        body.max_speed,
        body.max_yaw_rate,
        body.max_acceleration,
        body.max_deceleration,
        body.max_yaw_acceleration,
    )


def _findings(
    path: Path, limits: RobotLimits | None, strict: bool
) -> tuple[Sequence[Notice], Sequence[str]]:
    try:
        nav2 = inspect_nav2(path)
    except ParameterError as error:
        message = str(error).removeprefix(f"{path}: ")
        return [
            Notice("unreadable-file", "", message, "give a Nav2 parameter file", is_error=True)
        ], ()
    notices = rules.lint(nav2, limits)
    if not strict:
        notices = tuple(
            replace(each, is_error=each.is_error and each.id != UNKNOWN_KEY) for each in notices
        )
    return notices, nav2.ignored


def _plain(notices: Sequence[Notice]) -> list[dict[str, Any]]:
    return [
        {
            "id": each.id,
            "path": each.path,
            "line": each.line or None,
            "message": each.message,
            "advice": each.advice,
        }
        for each in notices
    ]


def _print(
    path: Path,
    errors: Sequence[Notice],
    warnings: Sequence[Notice],
    ignored: Sequence[str],
    console: Console,
) -> None:
    for title, notices, style in (
        ("Errors", errors, "bold red"),
        ("Warnings", warnings, "bold yellow"),
    ):
        if notices:
            console.print(Text(title, style=style))
            console.print(_table(notices))
            console.print()
    if ignored:
        console.print(Text("Without effect here", style="bold"))
        for node, names in _by_node(ignored).items():
            console.print(Text(f"{node}: {', '.join(names)}" if names else node, style="dim"))
        console.print()
    counts = f"{counted(len(errors), 'error')}, {counted(len(warnings), 'warning')}, {len(ignored)} ignored"
    console.print(Text(f"{path}: {counts}"))


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
    groups: dict[str, list[str]] = {}
    for each in ignored:
        node, _, name = each.partition(": ")
        groups.setdefault(node, []).extend([name] if name else [])
    return groups
