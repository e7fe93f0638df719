"""The command ``navbench price``: a finished run at other prices, and what its money depends on."""

import shlex
from pathlib import Path

import click

from harness.analysis.sensitivity import Sensitivity, sensitivities
from harness.report.repriced import price_set_blocks, repriced_blocks
from harness.report.sensitivity import sensitivity_blocks, short_sensitivity
from harness.report.tables import print_blocks, report_console
from navbench.api import money
from navbench.api.runs import Run, load
from navbench.cli.options import FULL, JSON, OTHER_PRICES, SETTINGS, TERMS
from navbench.cli.streams import print_json
from navbench.cli.values import pairs_of
from navstack.errors import InputError

ALL = "all"  # in place of a name of prices
MOST_TOLD = 2  # stacks of which the short text tells what their money depends on


@click.command()
@click.argument("run")
@OTHER_PRICES
@SETTINGS
@TERMS
@click.option(
    "--sensitivity",
    "is_sensitivity",
    is_flag=True,
    help="Show which prices the profit depends on, every one and by chance.",
)
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
    help="Folder for the figures of --sensitivity (PDF and PNG); default: none.",
)
@FULL
@JSON
def price(
    run: str,
    prices: str | None,
    settings: dict[str, float],
    terms: tuple[str, ...],
    is_sensitivity: bool,
    maps: list[tuple[str, str]],
    out: Path | None,
    is_full: bool,
    as_json: bool,
) -> None:
    """Price a finished run again, without simulating: other prices and accountings, more costs.

    RUN is a run folder, or FOLDER:stack.

    \b
    Examples:
      navbench price results/latest
      navbench price results/latest --set delivery_fee_usd_per_run=4.99
      navbench price results/latest --prices all
      navbench price results/latest --with operator,on_site_assistance --set on_site_time_h=0.5
      navbench price results/latest --sensitivity --map delivery_fee,property_damage --out figures
    """
    loaded = load(run)
    if prices == ALL:
        if settings or terms or is_sensitivity or maps or out:
            raise InputError(
                "--prices all takes none of --set, --with, --sensitivity, --map and --out: give "
                "one set of prices with them"
            )
        _print_sets(loaded, as_json)
        return
    if is_sensitivity or maps or out:
        found = money.sensitivity(loaded, prices, settings, terms, maps=maps, out=out)
        if as_json:
            print_json(found.as_json())
        else:
            shown = sensitivity_blocks if is_full else short_sensitivity
            print_blocks(shown(found.results, found.figures), report_console())
        return
    repricing = money.price(loaded, prices, settings, terms)
    if as_json:
        print_json(repricing.as_json())
        return
    # which reads worlds, and so the simulator's parameters
    from harness.report.short.findings import short_repricing

    told = loaded.stored, repricing.results, repricing.choices
    blocks = repriced_blocks(*told) if is_full else short_repricing(*told, _depends(repricing))
    print_blocks(blocks, report_console())
    following = ["navbench", "report", run]
    if repricing.has_margins:
        following = [*_words(run, prices, settings, terms), "--sensitivity"]
    click.echo(f"next: {shlex.join(following)}")


def _words(
    run: str, prices: str | None, settings: dict[str, float], terms: tuple[str, ...]
) -> list[str]:
    """The command that prices a run so, without what it prints."""
    words = ["navbench", "price", run]
    if prices is not None:
        words += ["--prices", prices]
    for key, value in settings.items():
        words += ["--set", f"{key}={value!r}"]
    if terms:
        words += ["--with", ",".join(terms)]
    return words


def _depends(repricing: money.Repricing) -> list[Sensitivity]:
    """What the profit of a few stacks depends on; none: there are many, or it is undefined."""
    if len(repricing.results) > MOST_TOLD:
        return []
    try:
        return sensitivities(repricing.run.stored, repricing.choices, ())
    except InputError:
        return []


def _print_sets(run: Run, as_json: bool) -> None:
    sets = money.price_sets(run)
    if as_json:
        print_json({"schema": 1, "sets": {name: each.as_json() for name, each in sets.items()}})
    else:
        print_blocks(price_set_blocks(run.stored, sets), report_console())
