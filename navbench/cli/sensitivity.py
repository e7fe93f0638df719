"""The command ``navbench sensitivity``: what the money of a finished run depends on."""

from pathlib import Path

import click

from harness.analysis.repricing import choose
from harness.analysis.sensitivity import sensitivities, sensitivity_document
from harness.report.sensitivity import draw_figures, sensitivity_blocks
from harness.report.tables import print_blocks, report_console
from harness.study.stored_run import load_run
from navbench.cli.options import JSON, OTHER_PRICES, SETTINGS, TERMS
from navbench.cli.streams import print_json


@click.command()
@click.argument("run")
@OTHER_PRICES
@SETTINGS
@TERMS
@click.option("--map", "maps", multiple=True, metavar="X,Y",
              help="Two prices, or groups such as injury.costs, to vary together; repeatable.")  # fmt: skip
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    help="Folder for the figures (PDF and PNG); default: none.",
)
@JSON
def sensitivity(
    run: str,
    prices: str | None,
    settings: tuple[str, ...],
    terms: tuple[str, ...],
    maps: tuple[str, ...],
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
    stored = load_run(run)
    choices = choose(stored, prices, settings, terms)
    results = sensitivities(stored, choices, maps)
    figures: list[str] = []
    if out is not None:
        figures = [str(path) for result in results for path in draw_figures(result, out)]
    if as_json:
        print_json(sensitivity_document(stored, results, choices, figures))
        return
    print_blocks(sensitivity_blocks(results, figures), report_console())
