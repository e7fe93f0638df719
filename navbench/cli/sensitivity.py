"""The command ``navbench sensitivity``: what the money of a finished run depends on."""

from collections.abc import Iterable
from pathlib import Path

import click

from harness.report.sensitivity import sensitivity_blocks
from harness.report.tables import print_blocks, report_console
from navbench.api import money
from navbench.api.runs import load
from navbench.cli.options import JSON, OTHER_PRICES, SETTINGS, TERMS
from navbench.cli.streams import print_json
from navstack.errors import InputError


def pairs_of(texts: Iterable[str]) -> list[tuple[str, str]]:
    """Two prices of each text ``X,Y``.

    Raises:
        InputError: one is something else.
    """
    pairs = []
    for text in texts:
        x, _, y = (part.strip() for part in text.partition(","))
        if not x or not y:
            raise InputError(
                f"--map '{text}' is not two prices X,Y, e.g. delivery_fee,injury.costs"
            )
        pairs.append((x, y))
    return pairs


@click.command()
@click.argument("run")
@OTHER_PRICES
@SETTINGS
@TERMS
@click.option(
    "--map",
    "maps",
    multiple=True,
    metavar="X,Y",
    callback=lambda _, __, texts: pairs_of(texts),
    help="Two prices, or groups such as injury.costs, to vary together; repeatable.",
)
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    help="Folder for the figures (PDF and PNG); default: none.",
)
@JSON
def sensitivity(
    run: str,
    prices: str | None,
    settings: dict[str, float],
    terms: tuple[str, ...],
    maps: list[tuple[str, str]],
    out: Path | None,
    as_json: bool,
) -> None:
    """Show what the money of a finished run depends on: every price, pairs of prices, chance.

    RUN is a run folder, or FOLDER:stack.

    \b
    Examples:
      navbench sensitivity results/latest
      navbench sensitivity results/latest --out figures
      navbench sensitivity results/latest --map delivery_fee,property_damage --out figures --json
    """
    found = money.sensitivity(load(run), prices, settings, terms, maps=maps, out=out)
    if as_json:
        print_json(found.as_json())
    else:
        print_blocks(sensitivity_blocks(found.results, found.figures), report_console())
