"""The command ``python -m tools.parity``.

The certificate that navstack computes what Nav2's own C++ computes.
"""

import sys
from collections.abc import Sequence
from pathlib import Path

import click
from rich.console import Console
from rich.text import Text

from harness.report.blocks import Table
from harness.report.tables import print_blocks, report_console
from navbench.cli.app import main
from navbench.cli.options import JSON
from navbench.cli.streams import print_json
from tools.parity.certificate import PartResult, certify, document, passes
from tools.parity.golden import GoldenError, golden_folder, read_folder

TITLE = "Parity with Nav2's own C++: recorded inputs, run through navstack"
HEADERS = (
    *("Part", "Cases", "Equal", "Explained", "Unexplained", "Not compared", "Largest deviation"),
)


@click.command("python -m tools.parity")
@click.option(
    "--golden",
    "folder",
    type=click.Path(path_type=Path),
    help="Folder of golden vectors (.npz); default: $NAVSTACK_GOLDEN, else tests/golden.",
)
@JSON
def parity(folder: Path | None, as_json: bool) -> None:
    """Run recorded inputs of Nav2's own C++ through navstack and compare, part by part.

    \b
    Examples:
      python -m tools.parity
      python -m tools.parity --golden my_vectors --json

    Exit status: 0 all cases are equal or their deviations explained; 1 otherwise.
    """
    folder = folder or golden_folder()
    results = certify(read_folder(folder))
    if not results:
        raise GoldenError(
            f"golden folder '{folder}' holds no case of any part; see docs/parity.md for their "
            "names"
        )
    if as_json:
        print_json(document(results))
    else:
        print_certificate(results, report_console())
    if passes(results):
        return
    deviations = [
        deviation
        for result in results
        for deviation in result.deviations
        if not deviation.is_explained
    ]
    lost = sum(not deviation.is_compared for deviation in deviations)
    said = f"{len(deviations) - lost} unexplained deviations, {lost} cases that cannot be compared"
    sys.stderr.write(f"navbench: no parity: {said}; the certificate names them\n")
    sys.exit(1)


def print_certificate(results: Sequence[PartResult], console: Console) -> None:
    """Print one line per part, then every deviation with its reason."""
    rows = []
    for result in results:
        explained = sum(deviation.is_explained for deviation in result.deviations)
        unit = f" {result.largest_deviation_unit}" if result.largest_deviation_unit else ""
        largest = (
            "--" if result.largest_deviation is None else f"{result.largest_deviation:.1e}{unit}"
        )
        not_compared = sum(not deviation.is_compared for deviation in result.deviations)
        unexplained = len(result.deviations) - explained - not_compared
        counts = (result.cases, result.equal, explained, unexplained, not_compared)
        rows.append((result.part, *map(str, counts), largest))
    print_blocks([Table(TITLE, HEADERS, rows)], console)
    deviations = [deviation for result in results for deviation in result.deviations]
    kinds = {
        "Explained deviations": (True, True),
        "Unexplained deviations": (False, True),
        "Not compared": (False, False),
    }
    for title, kind in kinds.items():
        cases = [each for each in deviations if (each.is_explained, each.is_compared) == kind]
        if cases:
            console.print(Text(title, style="bold"))
            for deviation in cases:
                console.print(Text(f"  {deviation.case}: {deviation.why}"))
            console.print()
    console.print(
        "every case is equal, or its deviation explained" if passes(results) else "no parity"
    )


if __name__ == "__main__":
    main(program=parity)
