"""The command ``navbench report``."""

import shlex
from pathlib import Path

import click

REPLAYS, AGAIN = 20, 3
MOST_RUNS = 8  # that are told of


@click.command()
@click.argument("runs", nargs=-1, required=True, metavar="RUN...")
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    default=Path("report.html"),
    show_default=True,
    help="Page to write; an existing one is replaced.",
)
@click.option(
    "--replays",
    type=click.IntRange(min=0, max=500),
    default=REPLAYS,
    show_default=True,
    help="Most recorded deliveries to carry, the costliest of each stack first.",
)
@click.option(
    "--again",
    type=click.IntRange(min=0, max=100),
    default=AGAIN,
    show_default=True,
    help="Dearest deliveries that are driven again for the page where they were not recorded.",
)
def report(runs: tuple[str, ...], out: Path, replays: int, again: int) -> None:
    """Write a report of finished runs as one HTML page that needs no server and no network.

    RUN is a run folder, or RUN:STACK for one stack of it; several are shown beside each other. The
    page holds what a delivery earns with its interval, both tables beside the paper's, the costs,
    outcomes, profit and break-even point, the comparison of the stacks, a map, every delivery with
    filters, and replays of recorded ones (navbench run --record full).
    """
    from harness.report.short.setup import setup_line
    from navbench.api import report as api
    from navbench.api.runs import load

    loaded = [load(each) for each in runs]
    api.report(loaded, out, replays, again)
    for each in loaded[:MOST_RUNS]:
        folder = f"{each.stored.folder}: " if len(loaded) > 1 else ""
        click.echo(f"{folder}{setup_line(each.stored)}")
    if len(loaded) > MOST_RUNS:
        click.echo(f"and {len(loaded) - MOST_RUNS} more runs")
    print_size(out, "page, ")
    following = ["explain", runs[0]]
    if loaded[0].stored.has_legs:
        following = ["map", "losses", loaded[0].stored.first_stack]
    click.echo(f"next: navbench {shlex.join(following)}")


def print_size(out: Path, content: str = "") -> None:
    """Print where a file is, what it holds and how large it is."""
    click.echo(f"{out}: {content}{out.stat().st_size / 1e6:.1f} MB")
