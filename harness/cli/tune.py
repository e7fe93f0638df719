"""The command ``navbench tune``: from a Nav2 file to one that earns more, with proof on missions it never saw."""

import dataclasses
import datetime
import math
import sys
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import click

from harness.cli.options import LOCALIZER, condition_options, refuse_others
from harness.cli.streams import print_json
from navstack.errors import InputError

if TYPE_CHECKING:
    from harness.metrics.columns import Row
    from harness.study.places import Where
    from harness.task.study import Study
    from harness.tuning.journal import Journal
    from harness.tuning.partings import Parting
    from harness.tuning.progress import Progress
    from harness.tuning.result import StudyResult
    from harness.tuning.stack_evaluator import StackEvaluator
    from harness.tuning.study import TuningStudy


DEFAULT_STACK = "nav2-stock"
OWN_OPTIONS = (
    "objective",
    "sampler",
    "trials",
    "episodes",
    "test_episodes",
    "finalists",
    "final_episodes",
    "is_raced",
    "waterfall_missions",
)  # that run does not have
RUN_OPTIONS = ("map", "pedestrians", "people", "world", "rules", "missions", "start", "goal", "prices")


@click.command()
@click.option("--stack", default=DEFAULT_STACK, show_default=True,
              help="What is tuned: a name of params/stacks, a stack file or a Nav2 parameter file.")  # fmt: skip
@LOCALIZER
@click.option("--space", "spaces", multiple=True, default=("dwb_critics",), show_default=True,
              help="What may change: a name of params/search_spaces or a YAML file; may be repeated.")  # fmt: skip
@click.option("--objective", default="margin", show_default=True,
              help="margin, capped_margin, shared_margin, cvar, lower_bound, margin@sla>=SHARE, or a metric such as "
              "-duration_s; several, separated by commas, for a Pareto front.")  # fmt: skip
@click.option("--sampler", default="tpe", show_default=True, help="tpe, cmaes, random or grid.")
@click.option("--trials", type=int, default=100, show_default=True, help="Files to try, beside the original.")
@click.option(
    "--budget",
    help="Wall time of search, final choice and test, e.g. 30m; trials for which there is no time are left out.",
)
@click.option("--episodes", type=int, default=32, show_default=True,
              help="Training missions, the same for every trial; racing likes 32, 64 and the like.")  # fmt: skip
@click.option("--test-episodes", type=int, show_default="400, fewer for a small search",
              help="Unseen missions on which original and result are compared; 0: none.")  # fmt: skip
@click.option("--finalists", type=int, default=4, show_default=True,
              help="Trials that meet the original on further training missions at the end; 0: none.")  # fmt: skip
@click.option("--final-episodes", type=int, show_default="128, fewer for a small search",
              help="Such missions; the worse half of the finalists drops out after each round.")  # fmt: skip
@click.option("--racing/--no-racing", "is_raced", default=True, help="Whether hopeless trials are dropped early.")
@click.option("--waterfall", "waterfall_missions", type=click.IntRange(0, 1000), show_default="40, fewer",
              help="Missions on which the explanation drives mixtures of old and new; 0: no waterfall.")  # fmt: skip
@condition_options
@click.option("--out", type=click.Path(path_type=Path), help="Study folder; default: results/<time>-tune-<stack>.")
@click.option("--resume", type=click.Path(path_type=Path), metavar="DIR",
              help="Go on with an interrupted study, or print a finished one, from its folder.")  # fmt: skip
@click.pass_context
def tune(
    context: click.Context,
    /,
    budget: str | None,
    out: Path | None,
    resume: Path | None,
    where: "Where",
    as_json: bool,
    **choices: Any,
) -> None:
    """Tune a Nav2 parameter file for what its deliveries earn, and test the result on missions it never saw.

    Every trial drives the same training missions; one that is worse than the best so far is dropped early. The best few
    meet again on further ones, and original and result are compared on test missions. The study folder has the tuned
    file with your comments, its lint, every trial, and the line that drives the test again. Ctrl-C keeps what is
    finished; --resume goes on.

    \b
    Examples:
      navbench tune --stack my_nav2.yaml --localizer gps-ekf --space dwb_critics --trials 100
      navbench tune --stack nav2-stock --space dwb_critics --space local_layers --objective shared_margin --budget 2h
      navbench tune --stack nav2-stock --space dwb_sampling --objective cvar --budget 30m
      navbench tune --stack mpc-gps-ekf --space mpc_weights --objective "margin@sla>=0.9"
      navbench tune --stack nav2-gps --space inflation --objective margin,-pedestrian_delay_s --sampler tpe
      navbench tune --resume results/latest

    Exit status: 0 finished; 1 bad input; 3 finished, but some deliveries ended in an error; 130 interrupted.
    """
    from harness.tuning.declaration import parse_duration

    seconds = None if budget is None else parse_duration(budget)
    if resume is not None:
        refuse_others(context)
        folder = resume.resolve()  # a link may point elsewhere before the study ends
    else:
        folder = create_study(seconds, out, {**choices, "workers": where.workers})
    sys.exit(drive(folder, where, seconds, as_json))


def create_study(budget: float | None, out: Path | None, choices: dict[str, Any]) -> Path:
    """Check what a user asks for, and write down all of it; returns the study's folder.

    Raises:
        InputError: a value that ``navbench run`` would refuse too, or a search space that does not fit the file.
    """
    from harness.cli.progress import say
    from harness.episode.factory import nav2_parameters
    from harness.storage.run_folder import TUNING, create_run, default_folder, require_usable
    from harness.storage.shipped import resolve, shipped
    from harness.study.manifest import about, parameters
    from harness.study.preflight import check
    from harness.task.study import make_study
    from harness.tuning.declaration import ORIGINAL, SPACE, Declaration, sizes
    from harness.tuning.objective import parse_objectives
    from harness.tuning.paths import with_absolute_files
    from harness.tuning.sampler import make_sampler
    from harness.tuning.space import fit_space
    from harness.tuning.space_file import read_spaces
    from harness.tuning.study import check_space, notes_before
    from navstack.params.strict import dump_dataclass, read_text

    own = {name: choices.pop(name) for name in OWN_OPTIONS}
    own |= {name: size for name, size in sizes(own["trials"], own["episodes"]).items() if own[name] is None}
    stack, spaces = choices.pop("stack"), choices.pop("spaces")
    space_files = [resolve(space, shipped("params") / "search_spaces", "search space") for space in spaces]
    space, content = read_spaces(space_files)
    declaration = Declaration(
        stack=stack, space=space, budget=budget, sensors="", robot="", options=_run_options(choices), **own
    )
    objectives = parse_objectives(declaration.objective)
    study = make_study(stacks=[stack], episodes=max(declaration.test_episodes, declaration.episodes), **choices)
    original = study.stacks[0]
    if not original.is_nav2:
        raise InputError(f"stack '{original.name}' does not drive by a Nav2 file that could be tuned; give another")
    declaration = dataclasses.replace(declaration, sensors=_short(original.sensors), robot=_short(original.robot))
    nav2 = nav2_parameters(original.nav2_file, study.template.allow_unknown)
    fitted = fit_space(space, content, nav2, study.template.allow_unknown)
    sampler = make_sampler(declaration.sampler, fitted, study.template.seed, declaration.trials, len(objectives))
    check_space(fitted, nav2, sampler, study.template.allow_unknown)
    path = out or default_folder(f"tune-{original.name}")
    require_usable(path)
    for note in (*check(study), *fitted.notes, *notes_before(declaration, choices)):
        say(f"note: {note}")
    texts = {
        TUNING: dump_dataclass(declaration),
        SPACE: read_text(space_files[0]) if len(space_files) == 1 else dump_dataclass(content),
        ORIGINAL: with_absolute_files(nav2, study.template.allow_unknown).document.text,
    }
    create_run(path, about(study, sys.argv), {**parameters(study), **texts})
    return path


def drive(path: Path, where: "Where", budget: float | None, as_json: bool) -> int:
    """Drive what a study lacks, show progress on stderr, tell the result on stdout; returns the exit status."""
    from harness.cli.driving import INTERRUPTED, SOME_ERRORS
    from harness.cli.progress import say, shown
    from harness.study.manifest import load_study, version_notes
    from harness.study.places import open_workers
    from harness.tuning.journal import Journal
    from harness.tuning.progress import Progress
    from harness.tuning.stack_evaluator import StackEvaluator
    from harness.tuning.study import load_tuning

    base = load_study(path, where.workers)
    study = load_tuning(path, base, budget)
    for note in version_notes(path):
        say(f"note: {note}")
    searched, runs = study.declaration.episodes, {path: base}
    with Journal(path, searched) as journal, open_workers(where, base.workers, path, runs) as pool:
        later = study.episodes_after_search + study.episodes_of_explanation
        progress = Progress(study.plan, journal, study.declaration.budget, later)
        searching = study.declaration.trials * searched
        say(f"up to {searching:,d} deliveries of the search, then up to {later:,d} to choose, test and explain")
        if len(journal):
            say(f"going on after {len(journal)} episodes")
        shared = None if where.is_local else path
        with TemporaryDirectory(prefix="navbench-tune-", dir=shared) as files:
            evaluator = StackEvaluator(study.template, pool, journal, progress.episode, Path(files))
            try:
                with shown(progress):
                    result = _search_and_test(study, evaluator, journal, progress)
                    journal.stop_clock()
                    document, report = _explain(study, base, result, evaluator, progress, path)
            except KeyboardInterrupt:
                kept = f"{len(journal)} finished episodes are kept in {path}; go on with --resume {path}"
                say(f"interrupted {progress.when}; {kept}")
                return INTERRUPTED
    if as_json:
        print_json(document)
    else:
        report()
    if journal.errors:
        count, first = len(journal.errors), journal.errors[0]
        say(f"episodes that ended in an error: {count}, e.g. {first}")
    return SOME_ERRORS if journal.errors else 0


def _search_and_test(
    study: "TuningStudy", evaluator: "StackEvaluator", journal: "Journal", progress: "Progress"
) -> "StudyResult":
    from harness.cli.progress import say
    from harness.tuning.study import finish, notes_after_search, run_search

    search = run_search(study, evaluator, journal, lambda trial, best: progress.trial(trial, best, evaluator))
    for note in notes_after_search(study, search, journal):
        say(note)
    progress.begin("final choice and test" if study.plan.final_episodes else "test")
    return finish(study, search, evaluator)


def _explain(
    study: "TuningStudy",
    base: "Study",
    result: "StudyResult",
    evaluator: "StackEvaluator",
    progress: "Progress",
    path: Path,
) -> "tuple[Row, Any]":
    """Write everything; returns the JSON document and what prints the report."""
    from harness.episode.factory import prices_of, world_params
    from harness.report.page.document import write_study_page
    from harness.report.tables import report_console
    from harness.report.tuning import print_tuning, write_tuning
    from harness.storage.documents import write_document
    from harness.study.stored_run import load_run
    from harness.tuning.dashboard import write_dashboard
    from harness.tuning.explanation import explain
    from harness.tuning.output import DOCUMENT, run_command, study_document, test_command, write_files
    from harness.tuning.scores import scores_document

    declaration = study.declaration
    write_files(result, study.nav2, base.stacks[0], declaration, path)
    write_dashboard(result, path)
    lint = lint_of(path, base.stacks[0].robot, study.template.allow_unknown)
    scores = scores_document(result)
    document = study_document(result, study.nav2, declaration, scores, lint, path)
    write_document(path / DOCUMENT, document)
    progress.begin("explanation")
    template = base.template
    world = world_params(template.world, template.pedestrians, template.people)
    explanation = explain(
        result,
        evaluator,
        path,
        prices_of(template.prices),
        world.contacts.counted_impulse,
        declaration.waterfall_missions,
        world.pedestrian_bodies.max_contact_impulse or math.inf,
    )
    command, again = run_command(declaration, path), test_command(declaration, result.seed, path)
    markdown = write_tuning(result, scores, explanation, command, path, again, lint)
    progress.begin("replays")
    runs = [load_run(str(each)) for each in _record_partings(explanation.partings, base, evaluator, path)]
    write_study_page(markdown, runs, datetime.date.today().isoformat())

    def report() -> None:
        console = report_console()
        print_tuning(result, scores, explanation, command, path, console)
        _print_files(lint, again, path)

    return {**document, "explanation": explanation.document}, report


def _record_partings(
    partings: "Sequence[Parting]", base: "Study", evaluator: "StackEvaluator", path: Path
) -> "list[Path]":
    """Drive the missions on which the files part ways once more, recorded; returns the run folder, if there are any."""
    from harness.study.again import PARTINGS, record_again
    from harness.tuning.declaration import ORIGINAL
    from harness.tuning.output import TUNED

    if not partings:
        return []
    files = {"original": path / "params" / ORIGINAL, "tuned": path / TUNED}
    stacks = [dataclasses.replace(base.stacks[0], name=name, nav2_file=str(file)) for name, file in files.items()]
    template = dataclasses.replace(base.template, seed=partings[0].seed)
    numbers = [each.episode for each in partings if each.seed == template.seed]
    return [record_again(path / PARTINGS, "files", stacks, template, numbers, evaluator.workers)]


def lint_of(folder: Path, robot: str, allow_unknown: bool) -> "Row":
    """What the check of the tuned file finds, and which of it the original did not have."""
    from harness.cli.lint import robot_limits
    from harness.tuning.declaration import ORIGINAL
    from harness.tuning.output import TUNED
    from navstack.params.lint.rules import lint
    from navstack.params.nav2_file.file import inspect_nav2

    limits = robot_limits(robot)
    known, found = (
        lint(inspect_nav2(file, allow_unknown), limits) for file in (folder / "params" / ORIGINAL, folder / TUNED)
    )
    before = {(notice.id, notice.path) for notice in known}
    return {
        "errors": sum(notice.is_error for notice in found),
        "warnings": sum(not notice.is_error for notice in found),
        "new": [str(notice) for notice in found if (notice.id, notice.path) not in before],
        "gone": [str(each) for each in known if (each.id, each.path) not in {(new.id, new.path) for new in found}],
    }


def _print_files(lint: "Row", command: str, path: Path) -> None:
    from harness.report.tuning import lint_lines
    from harness.tuning.output import DIFF, TUNED

    first, *rest = lint_lines(lint)
    lines = [f"tuned file: {path / TUNED}", f"difference: {path / DIFF}", f"lint of the tuned file: {first}"]
    lines += [f"  {line}" for line in rest]
    sys.stdout.write("\n".join((*lines, "drive its test again:", f"  {command}", "")))


def _run_options(choices: dict[str, Any]) -> tuple[str, ...]:
    """The options of ``navbench run`` that differ from its defaults, as one writes them."""
    from harness.task.study import is_recording

    files = {"map", "world", "rules", "prices"}
    given: list[str] = []
    for name in RUN_OPTIONS:
        value = choices["map_name" if name == "map" else name]
        default = next(each.default for each in tune.params if f"--{name}" in each.opts)
        if value is None or value == default:
            continue
        is_file = (name in files and Path(value).is_file()) or (name == "people" and is_recording(value))
        given += [f"--{name}", str(Path(value).resolve()) if is_file else str(value)]
    return tuple(given) if choices["allow_unknown"] else (*given, "--strict")


def _short(file: str) -> str:
    """The name of a file that comes with the program; the path of another."""
    from harness.storage.shipped import shipped

    path = Path(file)
    return path.stem if path.parent.parent == shipped("params").resolve() else file
