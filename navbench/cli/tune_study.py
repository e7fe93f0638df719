"""A tuning study as ``navbench tune`` begins it, goes on with it and tells of it."""

import dataclasses
import math
import sys
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import click

from harness.episode.factory import nav2_parameters, prices_of, world_params
from harness.metrics.columns import Row
from harness.report.page.document import write_study_page
from harness.report.tables import print_blocks, report_console
from harness.report.tuning.document import lint_lines, tuning_blocks, write_tuning
from harness.storage.documents import write_document
from harness.storage.run_folder import TUNING, create_run, default_folder, require_usable
from harness.storage.shipped import resolve, shipped
from harness.study.again import PARTINGS, record_again
from harness.study.manifest import about, load_study, parameters, version_notes
from harness.study.places import Where, open_workers
from harness.study.preflight import check
from harness.study.stored_run import load_run
from harness.task.study import Study, is_recording, make_study
from harness.tuning.dashboard import write_dashboard
from harness.tuning.declaration import ORIGINAL, SPACE, StudyDeclaration, sizes
from harness.tuning.explanation import explain
from harness.tuning.journal import Journal
from harness.tuning.mission_differences import MissionDifference
from harness.tuning.objective import parse_objectives
from harness.tuning.output import (
    DIFF,
    DOCUMENT,
    TUNED,
    run_command,
    study_document,
    test_command,
    write_files,
)
from harness.tuning.progress import StudyProgress
from harness.tuning.result import StudyResult
from harness.tuning.sampler import make_sampler
from harness.tuning.scores import scores_document
from harness.tuning.space.file import read_spaces
from harness.tuning.space.paths import with_absolute_files
from harness.tuning.space.space import fit_space
from harness.tuning.stack_evaluator import StackEvaluator
from harness.tuning.study import (
    TuningStudy,
    check_space,
    finish,
    load_tuning,
    notes_after_search,
    notes_before,
    run_search,
)
from navbench.cli.driving import INTERRUPTED, SOME_ERRORS
from navbench.cli.lint import robot_limits
from navbench.cli.progress import say, shown
from navbench.cli.report import today
from navbench.cli.streams import print_json
from navstack.errors import InputError
from navstack.params.lint.rules import lint
from navstack.params.nav2_file.file import inspect_nav2
from navstack.params.strict import dump_dataclass, read_text

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
RUN_OPTIONS = (
    "map",
    "pedestrians",
    "people",
    "world",
    "rules",
    "missions",
    "start",
    "goal",
    "prices",
)


def create_study(budget: float | None, out: Path | None, choices: dict[str, Any]) -> Path:
    """Check what a user asks for, and write down all of it; returns the study's folder.

    Raises:
        InputError: a value that ``navbench run`` would refuse too, or a search space that does not
            fit the file.
    """
    own = {name: choices.pop(name) for name in OWN_OPTIONS}
    own |= {
        name: size
        for name, size in sizes(own["trials"], own["episodes"]).items()
        if own[name] is None
    }
    stack, spaces = choices.pop("stack"), choices.pop("spaces")
    space_files = [
        resolve(space, shipped("params") / "search_spaces", "search space") for space in spaces
    ]
    space, content = read_spaces(space_files)
    declaration = StudyDeclaration(
        stack=stack,
        space=space,
        budget=budget,
        sensors="",
        robot="",
        options=_run_options(choices),
        **own,
    )
    objectives = parse_objectives(declaration.objective)
    study = make_study(
        stacks=[stack], episodes=max(declaration.test_episodes, declaration.episodes), **choices
    )
    original = study.stacks[0]
    if not original.is_nav2:
        raise InputError(
            f"stack '{original.name}' does not drive by a Nav2 file that could be tuned; give another"
        )
    declaration = dataclasses.replace(
        declaration, sensors=_short(original.sensors), robot=_short(original.robot)
    )
    nav2 = nav2_parameters(original.nav2_file, study.template.allow_unknown)
    fitted = fit_space(space, content, nav2, study.template.allow_unknown)
    sampler = make_sampler(
        declaration.sampler, fitted, study.template.seed, declaration.trials, len(objectives)
    )
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


def drive(path: Path, where: Where, budget: float | None, as_json: bool) -> int:
    """Drive what a study lacks, show progress on stderr, tell the result on stdout.

    Returns the exit status.
    """
    base = load_study(path, where.workers)
    study = load_tuning(path, base, budget)
    for note in version_notes(path):
        say(f"note: {note}")
    searched, runs = study.declaration.episodes, {path: base}
    with Journal(path, searched) as journal, open_workers(where, base.workers, path, runs) as pool:
        later = study.episodes_after_search + study.episodes_of_explanation
        progress = StudyProgress(study.plan, journal, study.declaration.budget, later)
        searching = study.declaration.trials * searched
        say(
            f"up to {searching:,d} deliveries of the search, then up to {later:,d} to choose, test and explain"
        )
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
    study: TuningStudy, evaluator: StackEvaluator, journal: Journal, progress: StudyProgress
) -> StudyResult:
    search = run_search(
        study, evaluator, journal, lambda trial, best: progress.trial(trial, best, evaluator)
    )
    for note in notes_after_search(study, search, journal):
        say(note)
    progress.begin("final choice and test" if study.plan.final_episodes else "test")
    return finish(study, search, evaluator)


def _explain(
    study: TuningStudy,
    base: Study,
    result: StudyResult,
    evaluator: StackEvaluator,
    progress: StudyProgress,
    path: Path,
) -> tuple[Row, Any]:
    """Write everything; returns the JSON document and what prints the report."""
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
    runs = [
        load_run(str(each))
        for each in _record_partings(explanation.partings, base, evaluator, path)
    ]
    write_study_page(markdown, runs, today())

    def report() -> None:
        blocks = tuning_blocks(result, scores, explanation, command, path)
        print_blocks(blocks, report_console())
        _print_files(lint, again, path)

    return {**document, "explanation": explanation.document}, report


def _record_partings(
    partings: Sequence[MissionDifference], base: Study, evaluator: StackEvaluator, path: Path
) -> list[Path]:
    """Drive the missions on which the files part ways once more, recorded.

    Returns the run folder, if there are any.
    """
    if not partings:
        return []
    files = {"original": path / "params" / ORIGINAL, "tuned": path / TUNED}
    stacks = [
        dataclasses.replace(base.stacks[0], name=name, nav2_file=str(file))
        for name, file in files.items()
    ]
    template = dataclasses.replace(base.template, seed=partings[0].seed)
    numbers = [each.episode for each in partings if each.seed == template.seed]
    return [record_again(path / PARTINGS, "files", stacks, template, numbers, evaluator.workers)]


def lint_of(folder: Path, robot: str, allow_unknown: bool) -> Row:
    """What the check of the tuned file finds, and which of it the original did not have."""
    limits = robot_limits(robot)
    known, found = (
        lint(inspect_nav2(file, allow_unknown), limits)
        for file in (folder / "params" / ORIGINAL, folder / TUNED)
    )
    before = {(notice.id, notice.path) for notice in known}
    return {
        "errors": sum(notice.is_error for notice in found),
        "warnings": sum(not notice.is_error for notice in found),
        "new": [str(notice) for notice in found if (notice.id, notice.path) not in before],
        "gone": [
            str(each)
            for each in known
            if (each.id, each.path) not in {(new.id, new.path) for new in found}
        ],
    }


def _print_files(lint: Row, command: str, path: Path) -> None:
    first, *rest = lint_lines(lint)
    lines = [
        f"tuned file: {path / TUNED}",
        f"difference: {path / DIFF}",
        f"lint of the tuned file: {first}",
    ]
    lines += [f"  {line}" for line in rest]
    sys.stdout.write("\n".join((*lines, "drive its test again:", f"  {command}", "")))


def _run_options(choices: dict[str, Any]) -> tuple[str, ...]:
    """The options of ``navbench run`` that differ from its defaults, as one writes them."""
    files = {"map", "world", "rules", "prices"}
    given: list[str] = []
    for name in RUN_OPTIONS:
        value = choices["map_name" if name == "map" else name]
        default = next(
            each.default
            for each in click.get_current_context().command.params
            if f"--{name}" in each.opts
        )
        if value is None or value == default:
            continue
        is_file = (name in files and Path(value).is_file()) or (
            name == "people" and is_recording(value)
        )
        given += [f"--{name}", str(Path(value).resolve()) if is_file else str(value)]
    return tuple(given) if choices["allow_unknown"] else (*given, "--strict")


def _short(file: str) -> str:
    """The name of a file that comes with the program; the path of another."""
    path = Path(file)
    return path.stem if path.parent.parent == shipped("params").resolve() else file
