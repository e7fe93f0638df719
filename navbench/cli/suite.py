"""``navbench suite``: every cell of a declared study one after the other, and the overview of all."""

import dataclasses
import sys
from collections import defaultdict
from pathlib import Path

import click

from harness.economics.cost_terms import MARGIN
from harness.execution.workers import Workers
from harness.report.blocks import Table, declared
from harness.report.numbers import interval_text
from harness.report.page.document import write_study_page
from harness.report.suite.document import PAGE, write_results
from harness.report.suite.results import Results, overview, read_results
from harness.report.tables import print_blocks, report_console
from harness.statistics.interval import wilson_interval
from harness.storage.documents import write_document
from harness.storage.rows import Row, Rows
from harness.storage.run_folder import (
    RunFolder,
    count_finished,
    default_folder,
    point_latest,
    require_usable,
)
from harness.storage.shipped import resolve, shipped
from harness.study.again import PARTINGS, record_again, recorded_again
from harness.study.barn import BARN, Score, make_maps, map_names, optimal_times, score_of
from harness.study.drive import TABLES, finish, require_own
from harness.study.manifest import load_study, version_notes
from harness.study.places import Where, open_workers
from harness.study.preflight import check
from harness.study.stored_run import load_run
from harness.study.suite import (
    DECLARATION,
    Cell,
    Portion,
    Suite,
    begin,
    cell_study,
    cells,
    declare,
    is_begun,
    load_suite,
    require_alike,
    require_same,
    stored_suite,
)
from harness.study.suite_log import note_session, session_of, sessions_of
from harness.task.study import Study, usable_workers
from navbench.cli.driving import (
    INTERRUPTED,
    SOME_ERRORS,
    Tally,
    is_interrupted,
    say_interrupted,
    say_what_failed,
)
from navbench.cli.options import JSON, refuse_others, where_options
from navbench.cli.progress import say, shown
from navbench.cli.report import today
from navbench.cli.streams import print_json
from navstack.errors import InputError

MANY = 20  # cells that take a while to look at


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
@click.option("--worlds", "barn", type=click.Path(path_type=Path), metavar="DIR",
              help="Of the BARN challenge, as maps in place of the suite's own.")  # fmt: skip
@where_options
@click.option("--out", type=click.Path(path_type=Path),
              help="Folder; one that holds the suite is added to. "
              "Default: results/<time>-<name of the file>.")  # fmt: skip
@click.option("--resume", type=click.Path(path_type=Path), metavar="DIR",
              help="Go on with a suite from its folder alone.")  # fmt: skip
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
    """Drive a declared study: every stack in every world, density of people and seed; and print the overview.

    FILE names stacks, maps, worlds, pedestrians, seeds and episodes, as params/suites/example.yaml does; it may be a
    name of params/suites. --out may name a folder that holds part of the suite: what is there is kept and added to. The
    folder's index.html shows what there is, with tables, figures and replays.

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
        sys.exit(resume_suite(resume, portion, where, as_json))
    if file is None:
        raise InputError("no suite is given; give its file, or --resume DIR")
    if file == BARN and barn is None:
        raise InputError(
            "the suite barn needs --worlds DIR, the folder with the challenge's world_<i>.world files"
        )
    sys.exit(begin_suite(file, world, portion, where, out, as_json, barn))


def begin_suite(
    file: str,
    world: str | None,
    portion: Portion,
    where: Where,
    out: Path | None,
    as_json: bool,
    barn: Path | None = None,
) -> int:
    """Drive a suite, show progress on stderr, print the overview on stdout.

    Returns the exit status.

    Args:
        file: of the suite, or its name.
        world: a name of params/worlds or a file in place of the suite's own; None: those.
        portion: of the suite that is driven now.
        where: it is driven.
        out: folder; one that holds this suite already is added to.
        as_json: whether the overview is printed as JSON.
        barn: folder of the BARN challenge's worlds, to be driven in place of the suite's maps.
    """
    source = resolve(file, shipped("params") / "suites", "suite")
    path = (out or default_folder(source.stem)).resolve()
    suite = load_suite(source, [] if barn is None else map_names(barn, path))
    if world is not None:
        suite = dataclasses.replace(
            suite, worlds=(str(Path(world).absolute()) if Path(world).is_file() else world,)
        )
    if (path / DECLARATION).is_file():
        require_same(path, suite)
    else:
        require_usable(path)
    if barn is not None:
        make_maps(barn, path)
    studies = {
        cell: cell_study(suite, cell, portion.episodes or suite.episodes)
        for cell in portion.cells(suite)
    }
    for cell, study in studies.items():
        if is_begun(path, cell):
            require_alike(path, cell, study)
    if len(studies) > MANY:
        say(f"checking the files of {len(studies)} cells before the first delivery")
    notes = [
        note
        for cell, study in studies.items()
        if cell.seed == suite.seeds[0]
        for note in check(study)
    ]
    for note in dict.fromkeys(notes):
        say(f"note: {note}")
    declare(path, suite)
    return _drive(path, suite, portion, where, as_json)


def resume_suite(path: Path, portion: Portion, where: Where, as_json: bool) -> int:
    """Go on with a suite folder; otherwise as :func:`begin_suite`."""
    path = path.resolve()  # a link may point elsewhere before the suite ends
    suite = stored_suite(path)
    begun = [cell for cell in portion.cells(suite) if is_begun(path, cell)]
    for note in dict.fromkeys(note for cell in begun for note in version_notes(path / cell.name)):
        say(f"note: {note}")
    return _drive(path, suite, portion, where, as_json)


def _drive(path: Path, suite: Suite, portion: Portion, where: Where, as_json: bool) -> int:
    chosen = portion.cells(suite)
    sessions_of(path)  # a damaged list is told before anything is driven
    for cell in chosen:
        begin(path, suite, cell, portion.episodes or suite.episodes, sys.argv)
    studies = {cell: load_study(path / cell.name, where.workers) for cell in chosen}
    failed: list[Row] = []
    interrupted = False
    now = {cell: _first(study, portion.episodes) for cell, study in studies.items()}
    tally = _tally(path, now)
    before = {cell: count_finished(path / cell.name) for cell in studies}
    count = usable_workers(where.workers, sum(study.total for study in now.values()))
    # a cluster is not needed to tell of a finished suite
    where = Where() if tally.done == tally.total else where
    runs = {path / cell.name: study for cell, study in studies.items()}
    try:
        with open_workers(where, count, path, runs) as workers, shown(tally):
            for cell, study in studies.items():
                own, interrupted = _drive_cell(path / cell.name, study, now[cell], workers, tally)
                failed += own.where(bool, "error")
                if interrupted:
                    break
            everything = suite.episodes * len(cells(suite))
            if (
                not interrupted
                and sum(count_finished(path / cell.name) for cell in cells(suite)) == everything
            ):
                interrupted = not record_partings(path, read_results(path), workers)
    finally:
        # also what was kept and not yet counted
        after = {cell: count_finished(path / cell.name) for cell in studies}
        tally.done = sum(min(count, now[cell].total) for cell, count in after.items())
        driven = {
            cell.name: count - before[cell] for cell, count in after.items() if count > before[cell]
        }
        if driven:
            note_session(path, session_of(driven))
    say_what_failed(failed)
    if interrupted:
        say_interrupted(tally, path, portion.options)
    results = write_overview(path)
    _print(results, path, as_json)
    if interrupted:
        return INTERRUPTED
    return SOME_ERRORS if failed else 0


def write_overview(path: Path) -> Results:
    """Write what a suite folder comes to into it: ``suite.json``, page, figures and table."""
    results = read_results(path)
    write_document(path / "suite.json", overview(results))
    write_results(results, path)
    runs = [load_run(str(folder)) for folder in recorded_again(path / PARTINGS)]
    write_study_page(path / PAGE, runs, today())
    point_latest(path)
    return results


def record_partings(path: Path, results: Results, workers: Workers) -> bool:
    """Drive the missions on which stacks part ways most once more, recorded.

    A run folder for each condition.

    Returns:
        False: it was interrupted.
    """
    try:
        for parting in results.partings:
            runs = [each for each in parting.runs if each.seed == parting.seed]
            studies = [load_study(run.folder) for run in runs]
            stacks = [study.stacks[0] for study in studies]
            name = runs[0].folder.name.removesuffix(f"-{stacks[0].name}")
            record_again(
                path / PARTINGS, name, stacks, studies[0].template, parting.episodes, workers
            )
    except KeyboardInterrupt:
        return False
    return True


def _tally(path: Path, studies: dict[Cell, Study]) -> Tally:
    """Count what is finished already, and tell it."""
    total = sum(study.total for study in studies.values())
    done = sum(
        min(count_finished(path / cell.name), study.total) for cell, study in studies.items()
    )
    if done == total:
        say(f"suite {path} is complete: all of its {total} deliveries are finished")
    elif done:
        say(f"going on after {done} of {total} deliveries")
    return Tally(total, done)


def _first(study: Study, episodes: int | None) -> Study:
    """The first so many deliveries of each stack; None: all."""
    return (
        study
        if episodes is None
        else dataclasses.replace(study, episodes=min(study.episodes, episodes))
    )


def _drive_cell(
    path: Path, study: Study, now: Study, workers: Workers, tally: Tally
) -> tuple[Rows, bool]:
    """The rows of a cell of which a part is to be driven now, and whether it was interrupted."""
    with RunFolder(path, TABLES, study.total) as folder:
        for note in folder.notes:
            say(f"note: {note}")
        require_own(study, folder)
        interrupted = is_interrupted(now, folder, workers, tally)
        finish(study, folder)
        return folder.rows, interrupted


def _print(results: Results, path: Path, as_json: bool) -> None:
    if as_json:
        scores = {
            stack: dataclasses.asdict(each) for stack, each in _barn_scores(results, path).items()
        }
        print_json(
            {**overview(results), "folder": str(path)} | ({"barn": scores} if scores else {})
        )
        return
    console = report_console()
    print_blocks([_sheet(results), _barn_sheet(results, path)], console)
    console.print(
        f"suite folder: {path}, with its page {Path(PAGE).with_suffix('.html')}, as text in {PAGE}",
        soft_wrap=True,
    )


def _barn_scores(results: Results, path: Path) -> dict[str, Score]:
    """What the BARN challenge says of the stacks; nothing where its worlds were not driven."""
    times, rows = optimal_times(path), defaultdict[str, list[Row]](list)
    for each in results.standings:
        if times and each.side is not None:
            rows[each.stack] += each.side.stack.rows
    return {stack: score_of(driven, times) for stack, driven in rows.items() if driven}


def _barn_sheet(results: Results, path: Path) -> Table:
    rows = [
        (
            stack,
            str(each.runs),
            interval_text(wilson_interval(each.arrived, each.runs), 3),
            str(each.collided),
            *(f"{value:.3f}" for value in (each.score, each.newer_score)),
            "--" if each.seconds is None else f"{each.seconds:.1f}",
        )
        for stack, each in _barn_scores(results, path).items()
    ]
    return declared("barn", rows)


def _sheet(results: Results) -> Table:
    rows = []
    for each in results.standings:
        if each.side is None:
            continue
        condition = each.condition
        where = Path(condition.map_name).stem, Path(condition.world).stem
        people = "own" if condition.pedestrians is None else str(condition.pedestrians)
        sla, margin = (
            interval_text(each.interval("sla"), 3),
            interval_text(each.interval(MARGIN), 2),
        )
        rows.append((*where, each.stack, people, str(each.n), str(each.errors), sla, margin))
    return declared("suite", rows, title=results.suite.title)
