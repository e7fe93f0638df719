"""``navbench suite``: every cell of a declared study, and the overview of all."""

import sys
from pathlib import Path

import click

from harness.economics.cost_terms import MARGIN
from harness.report.blocks import Table, declared
from harness.report.numbers import interval_text
from harness.report.suite.document import PAGE
from harness.report.suite.results import Results
from harness.report.tables import print_blocks, report_console
from harness.statistics.interval import wilson_interval
from harness.storage.texts import name_of
from harness.study.barn import BARN, Score
from harness.study.places import Where
from harness.study.suite import Portion
from navbench.api import suite as api
from navbench.api.suite import SuiteRun
from navbench.cli.driving import exit_status, say_how_to_go_on
from navbench.cli.options import JSON, path_option, refuse_others, where_options
from navbench.cli.streams import print_json
from navstack.errors import InputError


@click.command()
@click.argument("file", required=False)
@click.option(
    "--stack",
    "stacks",
    multiple=True,
    help="Drive this stack of the suite only; repeatable. Default: all.",
)
@click.option(
    "--map",
    "maps",
    multiple=True,
    help="Drive on this map of the suite only; repeatable. Default: all.",
)
@click.option(
    "--episodes",
    type=int,
    help="Drive the first so many deliveries of each cell only. Default: all.",
)
@click.option("--world", help="A name of params/worlds or a YAML file, instead of the suite's own.")
@click.option(
    "--worlds",
    "barn",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Of the BARN challenge, as maps in place of the suite's own.",
)
@where_options
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    help="Folder; one that holds the suite is added to. "
    "Default: results/<time>-<name of the file>.",
)
@path_option("--resume", "DIR", "Go on with a suite from its folder alone.")
@JSON
@click.pass_context
def suite(
    context: click.Context,
    /,
    file: str | None,
    stacks: tuple[str, ...],
    maps: tuple[str, ...],
    episodes: int | None,
    world: str | None,
    barn: Path | None,
    where: Where,
    out: Path | None,
    resume: Path | None,
    as_json: bool,
) -> None:
    """Drive a declared study, every stack in every condition, and print the overview.

    FILE names stacks, maps, worlds, people, sensors, seeds and episodes, as
    params/suites/example.yaml does; it may be a name of params/suites. --out may name a folder that
    holds part of the suite: what is there is kept and added to. The folder's index.html shows what
    there is, with tables, figures and replays.

    \b
    Examples:
      navbench suite example
      navbench suite my_suite.yaml --out results/my_suite
      navbench suite my_suite.yaml --out results/my_suite --stack nav2-gps --episodes 100
      navbench suite --resume results/my_suite
      navbench suite barn --worlds BARN_dataset
    """
    portion = Portion(stacks, maps, episodes)
    if resume is not None:
        refuse_others(context, "stacks", "maps", "episodes")
        found = api.resume_suite(resume, portion, where)
    else:
        if file is None:
            text = "no suite is given; give its file, or --resume DIR"
            raise click.UsageError(text, context)
        if file == BARN and barn is None:
            raise InputError(
                "the suite barn needs --worlds DIR, the folder with the challenge's "
                "world_<i>.world files"
            )
        found = api.suite(file, portion=portion, world=world, barn=barn, where=where, out=out)
    if as_json:
        print_json(found.as_json())
    else:
        _print(found)
    if found.is_interrupted:
        say_how_to_go_on("suite", found.folder, portion.options)
    sys.exit(exit_status(found.is_interrupted, found.has_errors))


def _print(found: SuiteRun) -> None:
    console = report_console()
    print_blocks([_sheet(found.results), _barn_sheet(found.barn)], console)
    page = Path(PAGE).with_suffix(".html")
    line = f"suite folder: {found.folder}, with its page {page}, as text in {PAGE}"
    console.print(line, soft_wrap=True)


def _barn_sheet(scores: dict[str, Score]) -> Table:
    return declared("barn", [(stack, *_barn_cells(each)) for stack, each in scores.items()])


def _barn_cells(score: Score) -> tuple[str, ...]:
    seconds = "--" if score.seconds is None else f"{score.seconds:.1f}"
    success = interval_text(wilson_interval(score.arrived, score.runs), 3)
    scores = f"{score.score:.3f}", f"{score.newer_score:.3f}"
    return str(score.runs), success, str(score.collided), *scores, seconds


def _sheet(results: Results) -> Table:
    rows = []
    for each in results.standings:
        if each.side is None:
            continue
        condition = each.condition
        where = Path(condition.map_name).stem, Path(condition.world).stem
        people = "own" if condition.pedestrians is None else str(condition.pedestrians)
        sensors = name_of(condition.sensors or "own")
        sla = interval_text(each.interval("sla"), 3)
        margin = interval_text(each.interval(MARGIN), 2)
        rate = interval_text(each.interval("contacts_per_1000_km"), 0)
        counts = str(each.n), str(each.errors)
        rows.append((*where, each.stack, people, sensors, *counts, sla, margin, rate))
    return declared("suite", rows, title=results.suite.title)
