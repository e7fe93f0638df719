"""The command ``navbench day``: what a fleet earns with the deliveries of a run."""

from pathlib import Path

import click

from harness.fleet.study import DAYS
from harness.report.fleet.screen import fleet_blocks
from harness.report.tables import print_blocks, report_console
from harness.storage.texts import quoted
from navbench.api import day as api
from navbench.api.runs import load
from navbench.cli.options import JSON, OTHER_PRICES, SETTINGS
from navbench.cli.streams import print_json
from navstack.errors import InputError


@click.command()
@click.option(
    "--legs",
    multiple=True,
    required=True,
    metavar="RUN",
    help="Run folder, or FOLDER:stack, whose deliveries ways are made of; repeatable, e.g. among "
    "different numbers of people.",
)
@click.option(
    "--legs-b",
    multiple=True,
    metavar="RUN",
    help="Of another stack, for the same days; repeatable.",
)
@click.option("--robots", type=int, help="Number of robots; default: the settings' own.")
@click.option("--operators", type=int, help="Number of operators; default: the settings' own.")
@click.option(
    "--settings",
    "file",
    default="city",
    show_default=True,
    metavar="NAME",
    help="Of the fleet: a name of params/fleet or a YAML file.",
)
@SETTINGS
@OTHER_PRICES
@click.option("--days", type=int, default=DAYS, show_default=True, help="Days to simulate.")
@click.option("--seed", type=int, default=0, show_default=True, help="Same seed, same days.")
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    help="Folder of the page; default: results/<time>-day.",
)
@JSON
def day(
    legs: tuple[str, ...],
    legs_b: tuple[str, ...],
    robots: int | None,
    operators: int | None,
    file: str,
    settings: dict[str, float],
    prices: str | None,
    days: int,
    seed: int,
    out: Path | None,
    as_json: bool,
) -> None:
    """Simulate days of a fleet: orders, robots, batteries, operators, money.

    Ways are made of a run's deliveries, drawn with replacement, by the number of people at the
    hour. --set changes a setting or a price. The page shows a day robot by robot, and what fleets
    of other sizes earn.

    \b
    Examples:
      navbench day --legs results/latest
      navbench day --legs results/both:evasive-gps-ekf --robots 50 --operators 2
      navbench day --legs results/both:nav2-gps --legs-b results/both:nav2-amcl --prices city_fleet
    """
    sizes = {"robots": robots, "operators": operators}
    values = {key: float(size) for key, size in sizes.items() if size is not None}
    for key in values:
        if key in settings:
            raise InputError(f"--set {key} and --{key} are the same; give one of them")
    found = api.day(
        [load(each) for each in legs],
        [load(each) for each in legs_b],
        settings=file,
        values={**settings, **values},
        prices=prices,
        days=days,
        seed=seed,
        out=out,
    )
    if as_json:
        print_json(found.as_json())
        return
    print_blocks(fleet_blocks(found.result), report_console())
    click.echo(f"next: open {quoted(found.page)}")
