"""The command ``navbench price``: a finished run at other prices, without simulating again."""

import click

from harness.analysis.price_sets import under_price_sets
from harness.analysis.repricing import choose, reprice, repricing_document
from harness.report.repriced import price_set_blocks, repriced_blocks
from harness.report.tables import print_blocks, report_console
from harness.study.stored_run import load_run
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
    run: str, prices: str | None, settings: tuple[str, ...], terms: tuple[str, ...], as_json: bool
) -> None:
    """Price a finished run again, without simulating: other prices, other ways to count contacts, more costs.

    RUN is a run folder, or FOLDER:stack.

    \b
    Examples:
      navbench price results/latest --set delivery_fee_usd_per_run=4.99
      navbench price results/latest --prices my_prices.yaml --json
      navbench price results/latest --prices all
      navbench price results/latest --with operator,on_site_assistance,battery_wear --set on_site_time_h=0.5
    """
    stored = load_run(run)
    if prices == ALL:
        if settings or terms:
            raise InputError(
                "--prices all takes neither --set nor --with: give one set of prices with them"
            )
        sets = under_price_sets(stored)
        if as_json:
            print_json({"schema": 1, "sets": {name: each.as_json() for name, each in sets.items()}})
        else:
            print_blocks(price_set_blocks(stored, sets), report_console())
        return
    choices = choose(stored, prices, settings, terms)
    results = reprice(stored, choices)
    if not results:
        raise InputError(
            f"run folder '{stored.folder}' has no finished delivery; there is nothing to price"
        )
    if as_json:
        print_json(repricing_document(stored, results, choices))
        return
    print_blocks(repriced_blocks(stored, results, choices), report_console())
