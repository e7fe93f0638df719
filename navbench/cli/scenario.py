"""The command ``navbench scenario``: situations written down as data, driven and judged."""

import dataclasses
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click
from rich.console import Console
from rich.text import Text

from harness.report.tables import report_console, report_table
from harness.scenarios.runner import Result
from navbench.api import verify as api
from navbench.cli.options import JSON
from navbench.cli.streams import print_json
from navstack.errors import InputError

FOLDER = Path("tests/scenarios")


@click.command()
@click.argument("files", nargs=-1, type=click.Path(path_type=Path))
@click.option("--all", "everything", is_flag=True, help="Every file of tests/scenarios.")
@JSON
def scenario(files: tuple[Path, ...], everything: bool, as_json: bool) -> None:
    """Drive short situations in the physical world and check what comes of them.

    A FILE says who stands where, what happens and what must come of it; docs/scenarios.md describes
    it.

    \b
    Examples:
      navbench scenario tests/scenarios/kiosk.yaml
      navbench scenario --all --json

    Exit status: 0 everything came as the files expect; 1 something did not.
    """
    results = api.scenario(_chosen(files, everything))
    if as_json:
        print_json(document(results), ensure_ascii=False)
    else:
        print_results(results, report_console())
    others = [result.path.stem for result in results if not result.as_expected]
    if others:
        names = ", ".join(others)
        advice = "see the checks, or 'expect' in the files"
        sys.stderr.write(f"navbench: not as expected: {names}; {advice}\n")
        sys.exit(1)


def document(results: Sequence[Result]) -> dict[str, Any]:
    """What ``--json`` prints."""
    return {
        "schema": 1,
        "scenarios": [
            {
                "file": str(result.path),
                "title": result.scenario.title,
                "expect": result.scenario.expect,
                "reason": result.scenario.reason or None,
                "passed": result.holds,
                "as_expected": result.as_expected,
                "simulated_s": result.duration,
                "checks": [
                    {**dataclasses.asdict(finding), "asked": finding.asked or None}
                    for finding in result.findings
                ],
            }
            for result in results
        ],
    }


def print_results(results: Sequence[Result], console: Console) -> None:
    """Print a table of every check."""
    table = report_table()
    for name in ("Scenario", "Check", "Holds", "Measured"):
        table.add_column(
            name, ratio={"Scenario": 5, "Check": 3, "Measured": 5}.get(name), overflow="fold"
        )
    for result in results:
        for number, finding in enumerate(result.findings):
            title = Text(result.scenario.title if number == 0 else "")
            verdict = Text("yes") if finding.holds else Text("no", style="bold red")
            table.add_row(
                title,
                Text(f"{finding.check} {finding.asked}".strip()),
                verdict,
                Text(finding.measured),
            )
        table.add_row(Text(""), Text(""), Text(""), _verdict(result), end_section=True)
    console.print(table)
    expected = sum(result.as_expected for result in results)
    console.print(f"{expected} of {len(results)} scenarios came as expected")


def _verdict(result: Result) -> Text:
    if result.scenario.expect == "pass":
        return Text("passed", style="green") if result.holds else Text("FAILED", style="bold red")
    if not result.as_expected and not result.holds:
        return Text("FAILED in more than is known", style="bold red")
    if result.holds:
        return Text("known to fail, but PASSED: remove 'expect' from its file", style="bold red")
    return Text(f"known to fail: {result.scenario.reason}", style="yellow")


def _chosen(files: Sequence[Path], everything: bool) -> list[Path]:
    if bool(files) == everything:
        raise click.UsageError("give scenario files, or --all for those of tests/scenarios")
    if not everything:
        return list(files)
    found = sorted(FOLDER.glob("*.yaml"))
    if not found:
        raise InputError(
            f"folder '{FOLDER}' holds no scenario; run from the program's checkout, or give files"
        )
    return found
