"""The command ``navbench price``: a finished run at other prices, without simulating again."""

import click

from harness.report.repriced import price_set_blocks, repriced_blocks
from harness.report.tables import print_blocks, report_console
from navbench.api import money
from navbench.api.runs import Run, load
from navbench.cli.options import JSON, OTHER_PRICES, SETTINGS, TERMS
from navbench.cli.streams import print_json
from navstack.errors import InputError

ALL = "all"  # in place of a name of prices


@click.command()
@click.argument("run")
@OTHER_PRICES
@SETTINGS
@TERMS
@JSON
def price(
    run: str,
    prices: str | None,
    settings: dict[str, float],
    terms: tuple[str, ...],
    as_json: bool,
) -> None:
    """Price a finished run again, without simulating: other prices and accountings, more costs.

    RUN is a run folder, or FOLDER:stack.

    \b
    Examples:
      navbench price results/latest --set delivery_fee_usd_per_run=4.99
      navbench price results/latest --prices my_prices.yaml --json
      navbench price results/latest --prices all
      navbench price results/latest --with operator,on_site_assistance --set on_site_time_h=0.5
    """
    loaded = load(run)
    if prices == ALL:
        if settings or terms:
            raise InputError(
                "--prices all takes neither --set nor --with: give one set of prices with them"
            )
        _print_sets(loaded, as_json)
        return
    repricing = money.price(loaded, prices, settings, terms)
    if as_json:
        print_json(repricing.as_json())
    else:
        blocks = repriced_blocks(loaded.stored, repricing.results, repricing.choices)
        print_blocks(blocks, report_console())


def _print_sets(run: Run, as_json: bool) -> None:
    sets = money.price_sets(run)
    if as_json:
        print_json({"schema": 1, "sets": {name: each.as_json() for name, each in sets.items()}})
    else:
        print_blocks(price_set_blocks(run.stored, sets), report_console())
