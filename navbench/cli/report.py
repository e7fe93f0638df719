"""The command ``navbench report``."""

import datetime
from pathlib import Path

import click

from harness.storage.files import require_writable, write_text, writing

REPLAYS = 20
PAGES = (".html", ".htm")  # suffixes


@click.command()
@click.argument("runs", nargs=-1, required=True, metavar="RUN...")
@click.option("--out", type=click.Path(path_type=Path), default=Path("report.html"), show_default=True,
              help="Page to write; an existing one is replaced.")  # fmt: skip
@click.option("--replays", type=click.IntRange(min=0, max=500), default=REPLAYS, show_default=True,
              help="Most recorded deliveries to carry, the costliest of each stack first.")  # fmt: skip
def report(runs: tuple[str, ...], out: Path, replays: int) -> None:
    """Write a report of finished runs as one HTML page that needs no server and no network.

    RUN is a run folder, or RUN:STACK for one stack of it; several are shown beside each other. The
    page holds what a delivery earns with its interval, both tables beside the paper's, the costs,
    outcomes, profit and break-even point, the comparison of the stacks, a map, every delivery with
    filters, and replays of recorded ones (navbench run --record full).
    """
    from harness.report.page.document import report_page
    from harness.report.page.entries import notes_of
    from harness.study.stored_run import load_run

    require_writable("page", out, PAGES)
    loaded = [load_run(each) for each in runs]
    page = report_page(loaded, replays, today())
    for note in notes_of(loaded):
        click.echo(f"note: {note}", err=True)
    write_page(out, page)


def write_page(out: Path, text: str) -> None:
    """Write a page whole, and say where it is and how large.

    Raises:
        InputError: it cannot be written.
    """
    with writing(out):
        write_text(out, text)
    click.echo(f"{out}: {len(text.encode()) / 1e6:.1f} MB")


def today() -> str:
    """Of the machine's clock."""
    return datetime.date.today().isoformat()
