"""The command ``navbench price``: a finished run at other prices, without simulating again."""

import json
import sys
from collections.abc import Sequence

from harness.analysis.repricing import choose, document, reprice
from harness.study.stored_run import load_run
from navstack.errors import InputError


def price_command(run: str, prices: str | None, settings: Sequence[str], terms: Sequence[str], as_json: bool) -> None:
    """Print the tables of a run at other prices, or one JSON document.

    Raises:
        InputError: no readable run, or prices, settings or terms that cannot be used.
    """
    stored = load_run(run)
    choices = choose(stored, prices, settings, terms)
    results = reprice(stored, choices)
    if not results:
        raise InputError(f"run folder '{stored.folder}' has no finished delivery; there is nothing to price")
    if as_json:
        sys.stdout.write(json.dumps(document(stored, results, choices), indent=2, allow_nan=False) + "\n")
        return
    from harness.report.repriced import print_repriced
    from harness.report.tables import report_console

    print_repriced(stored, results, choices, report_console(sys.stdout))
