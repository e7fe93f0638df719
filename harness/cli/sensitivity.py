"""The command ``navbench sensitivity``: what the money of a finished run hangs on."""

import json
import sys
from collections.abc import Sequence
from pathlib import Path

from harness.analysis.repricing import choose
from harness.analysis.sensitivity import document, sensitivities
from harness.study.stored_run import load_run


def sensitivity_command(
    run: str,
    prices: str | None,
    settings: Sequence[str],
    terms: Sequence[str],
    maps: Sequence[str],
    out: Path | None,
    as_json: bool,
) -> None:
    """Print tornado and break-even, or one JSON document; draw the figures into ``out``.

    Raises:
        InputError: no readable run, prices, settings or terms that cannot be used, or figures that cannot be written.
    """
    stored = load_run(run)
    choices = choose(stored, prices, settings, terms)
    results = sensitivities(stored, choices, maps)
    figures: list[str] = []
    if out is not None:
        from harness.report.sensitivity_figures import draw_figures

        figures = [str(path) for result in results for path in draw_figures(result, out)]
    if as_json:
        sys.stdout.write(json.dumps(document(stored, results, choices, figures), indent=2, allow_nan=False) + "\n")
        return
    from harness.report.sensitivity import print_sensitivity
    from harness.report.tables import report_console

    print_sensitivity(results, figures, report_console(sys.stdout))
