"""The command ``navbench compare``: two runs, or two stacks of one, mission by mission."""

import json
import sys
from collections.abc import Sequence

from rich.console import Console

from harness.analysis.compare import compare, document, side_of
from harness.report.comparison import print_comparison
from harness.report.tables import report_console
from harness.study.stored_run import load_run


def compare_command(first: str, second: str, metrics: Sequence[str], as_json: bool) -> None:
    """Print B minus A, or one JSON document; what makes them incomparable goes to standard error.

    Raises:
        InputError: no readable run, several stacks to choose from, no mission in common, or an unknown metric.
    """
    comparison = compare(side_of(load_run(first)), side_of(load_run(second)), metrics)
    errors = Console(stderr=True, highlight=False)
    for warning in comparison.warnings:
        errors.print(f"warning: not comparable: {warning}", markup=False, soft_wrap=True)
    if as_json:
        sys.stdout.write(json.dumps(document(comparison), indent=2, allow_nan=False) + "\n")
        return
    print_comparison(comparison, report_console(sys.stdout))
