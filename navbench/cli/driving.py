"""What the commands that drive print, and the exit status that they leave."""

from typing import TYPE_CHECKING

from navbench.cli.streams import print_json

if TYPE_CHECKING:
    from navbench.api.driving import Driven

INTERRUPTED, SOME_ERRORS = 130, 3


def exit_status(is_interrupted: bool, has_errors: bool) -> int:
    """What the program leaves with."""
    if is_interrupted:
        return INTERRUPTED
    if has_errors:
        return SOME_ERRORS
    return 0


def print_driven(driven: "Driven", as_json: bool) -> int:
    """Print what deliveries came to; returns the exit status."""
    from harness.episode.factory import prices_of
    from harness.report.run_tables import run_blocks
    from harness.report.tables import print_blocks, report_console
    from harness.study.drive import run_document

    study, folder, results = driven.study, driven.folder, driven.results
    if as_json:
        runs = [run_document(result, study, folder) for result in results]
        print_json({"schema": 1, "runs": runs})
    else:
        prices = prices_of(study.template.prices)
        print_blocks(run_blocks(results, study, prices, folder), report_console())
    return exit_status(driven.is_interrupted, driven.has_errors)
