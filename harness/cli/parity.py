"""The command ``navbench parity``: the certificate that navstack computes what Nav2's own C++ computes."""

import json
import os
import sys
from collections.abc import Sequence
from pathlib import Path

import click
from rich.console import Console
from rich.text import Text

from harness.cli.options import JSON
from harness.parity.certificate import PartResult, certify, document, passes
from harness.parity.golden import GoldenError, read_folder
from harness.report.sheet import Sheet, print_sheet
from harness.report.tables import report_console

DEFAULT_FOLDER = Path("tests/golden")


@click.command()
@click.option("--golden", "folder", type=click.Path(path_type=Path),
              help="Folder of golden vectors (.npz); default: $NAVSTACK_GOLDEN, else tests/golden.")  # fmt: skip
@JSON
def parity(folder: Path | None, as_json: bool) -> None:
    """Run recorded inputs of Nav2's own C++ through navstack and compare: a certificate, part by part.

    \b
    Examples:
      navbench parity
      navbench parity --golden my_vectors --json

    Exit status: 0 all cases are equal or their deviations explained; 1 otherwise.
    """
    folder = folder or golden_folder()
    results = certify(read_folder(folder))
    if not results:
        raise GoldenError(f"golden folder '{folder}' holds no case of any part; see docs/parity.md for their names")
    if as_json:
        sys.stdout.write(json.dumps(document(results), indent=2, allow_nan=False) + "\n")
    else:
        print_certificate(results, report_console(sys.stdout))
    if passes(results):
        return
    unexplained = sum(not deviation.is_explained for result in results for deviation in result.deviations)
    sys.stderr.write(f"navbench: no parity: {unexplained} unexplained deviations; the certificate names them\n")
    sys.exit(1)


def golden_folder() -> Path:
    """The folder of golden vectors: ``NAVSTACK_GOLDEN``, else ``tests/golden``."""
    return Path(os.environ.get("NAVSTACK_GOLDEN") or DEFAULT_FOLDER)


def print_certificate(results: Sequence[PartResult], console: Console) -> None:
    """Print one line per part, then every deviation with its reason."""
    rows = []
    for result in results:
        explained = sum(deviation.is_explained for deviation in result.deviations)
        largest = "--" if result.largest_deviation is None else f"{result.largest_deviation:.1e} {result.unit}".rstrip()
        counts = (result.cases, result.equal, explained, len(result.deviations) - explained)
        rows.append((result.part, *map(str, counts), largest))
    headers = ("Part", "Cases", "Equal", "Explained", "Unexplained", "Largest deviation")
    print_sheet(Sheet("Parity with Nav2's own C++: recorded inputs, run through navstack", headers, rows), console)
    deviations = [deviation for result in results for deviation in result.deviations]
    for title, is_explained in (("Explained", True), ("Unexplained", False)):
        cases = [deviation for deviation in deviations if deviation.is_explained == is_explained]
        if cases:
            console.print(Text(f"{title} deviations", style="bold"))
        for deviation in cases:
            console.print(Text(f"  {deviation.case}: {deviation.why}"))
        if cases:
            console.print()
    console.print("every case is equal, or its deviation explained" if passes(results) else "no parity")
