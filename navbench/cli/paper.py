"""The command ``navbench paper``: the cost model applied to what the paper measured."""

import click
from rich.console import Console

from harness.economics.break_even import Thresholds
from harness.report.blocks import Table, Text, declared
from harness.report.paper_tables import paper_blocks
from harness.report.published import published_columns
from harness.report.tables import print_blocks, report_console
from navbench.api import paper as api
from navbench.api.paper import Paper
from navbench.cli.options import JSON, PRICES
from navbench.cli.streams import print_json


@click.command()
@PRICES
@JSON
def paper(prices: str, as_json: bool) -> None:
    """Print the paper's two tables from its published measurements, and its thresholds."""
    found = api.paper(prices)
    if as_json:
        print_json(found.as_json())
    else:
        print_paper(report_console(), found)


def print_paper(console: Console, paper: Paper) -> None:
    """Print both tables for the seven methods and the real robot, then the thresholds."""
    columns = published_columns(paper.published, paper.prices)
    blocks = [*paper_blocks(columns), Text(""), _thresholds(paper.thresholds)]
    print_blocks(blocks, console)


def _thresholds(limits: Thresholds) -> Table:
    injury = "fee / cost of such an injury"
    ais = (limits.ais1_contact_rate, limits.ais2_contact_rate, limits.ais3_contact_rate)
    both = limits.timeout_and_physical_assistance_rate
    rows = (
        (
            "Pedestrian safety",
            "the delivery fee itself",
            f"{limits.pedestrian_safety_usd_per_run:.2f} $/run",
        ),
        *(
            (f"  contacts with AIS {grade}", injury, _percent(rate))
            for grade, rate in enumerate(ais, start=1)
        ),
        ("Spoilage", "fee / (food price + fee)", _percent(limits.spoilage_rate)),
        ("Timeout + physical assistance", "fee / (fee refunded + fee lost)", _percent(both)),
        (
            "Property contact",
            "fee / mean damage of the four published types",
            _percent(limits.property_contact_rate),
        ),
        (
            "Physical assistance",
            "fee / repair per event",
            _percent(limits.physical_assistance_rate),
        ),
    )
    return declared("thresholds", rows)


def _percent(rate: float) -> str:
    return f"{100.0 * rate:.2f} %"
