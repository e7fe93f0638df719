"""From a Nav2 file to one that earns more, tested on missions it never saw."""

import dataclasses
import inspect
import sys
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from harness.episode.files import nav2_parameters, prices_of
from harness.execution.executors import ParentProcess
from harness.execution.workers import Workers
from harness.meetings.allowed import require_meetings
from harness.meetings.estimators import DELIVERIES
from harness.report.numbers import counted
from harness.report.tuning.summary import starting_point
from harness.storage.new_run import TUNING, create_run, default_folder, require_usable
from harness.storage.shipped import resolve, shipped
from harness.storage.texts import quoted, time_text
from harness.study.manifest import about, load_study, parameters, version_notes
from harness.study.places import Where, open_workers
from harness.study.preflight import check
from harness.task.own_body import is_own
from harness.task.stack import Stack
from harness.task.study import Study, is_recording, make_study
from harness.tuning.budget import LEAST_STUDY, Budget, enough_for
from harness.tuning.declaration import MARGIN_OBJECTIVE, ORIGINAL, SPACE, StudyDeclaration, sizes
from harness.tuning.journal import Journal
from harness.tuning.notes import notes_after_search, notes_before
from harness.tuning.objective import parse_objectives
from harness.tuning.progress import StudyProgress
from harness.tuning.result import COMPLETE, StudyResult, Trial
from harness.tuning.sampler import make_sampler
from harness.tuning.space.checking import check_space
from harness.tuning.space.file import SpaceFile, read_spaces
from harness.tuning.space.fitting import fit_space
from harness.tuning.space.paths import with_absolute_files
from harness.tuning.stack_evaluator import StackEvaluator
from harness.tuning.study import (
    TuningStudy,
    finish,
    fitted,
    load_tuning,
    run_search,
)
from harness.tuning.training import USUAL_MISSIONS
from navbench.api.driving import say_notes
from navbench.api.meetings.driving import require_local
from navbench.api.progress import say, shown
from navbench.api.tuned import Tuned, written
from navstack.errors import InputError
from navstack.params.strict import dump_dataclass, read_text

DEFAULT_STACK = "nav2-stock"
FILES = ("map", "world", "rules", "prices")  # options that may be files
RUN_OPTIONS = (
    *("map", "pedestrians", "people", "world", "rules", "missions", "distance", "start", "goal"),
    "prices",
)


def tune(
    stack: str = DEFAULT_STACK,
    spaces: Sequence[str] = ("dwb_critics",),
    *,
    objective: str = MARGIN_OBJECTIVE,
    estimator: str = DELIVERIES,
    sampler: str = "tpe",
    trials: int = 100,
    budget: float | None = None,
    episodes: int | None = None,
    test_episodes: int | None = None,
    finalists: int = 4,
    final_episodes: int | None = None,
    is_raced: bool = True,
    waterfall_missions: int | None = None,
    out: Path | None = None,
    where: Where | None = None,
    map: str = "sidewalk",  # noqa: A002 - as the option is called
    **options: Any,
) -> Tuned | None:
    """Tune a Nav2 parameter file for what its deliveries earn, and test it on unseen missions.

    Args:
        stack: a name of params/stacks, a stack file or a Nav2 parameter file.
        spaces: what may change: names of params/search_spaces or YAML files.
        objective: margin, capped_margin, shared_margin, cvar, lower_bound, margin@sla>=SHARE, or a
            metric such as -duration_s; several, separated by commas, for a Pareto front.
        estimator: how training missions are driven: deliveries, or meetings with people, which
            tell the margin with less driving. The test is of whole deliveries.
        sampler: tpe, cmaes, random or grid.
        trials: files to try, beside the original.
        budget: [s] of wall time for everything; None: as long as it takes.
        episodes: training missions, the same for every trial; None: 32, or fewer where the budget
            is short.
        test_episodes: unseen missions of the test; None: as the size of the search wants it.
        finalists: trials that meet the original on further training missions; 0: none.
        final_episodes: such missions; None: as the size of the search wants it.
        is_raced: whether hopeless trials are dropped early.
        waterfall_missions: on which the explanation drives mixtures of old and new; 0: none.
        out: study folder; None: ``results/<time>-tune-<stack>``.
        where: deliveries are driven; None: on this machine.
        map: a built-in map or a map_server YAML file.
        options: as of :func:`navbench.run`.

    Returns:
        None where it is interrupted; what is finished is kept in the folder.

    Raises:
        InputError: a value that ``navbench run`` would refuse too, or a search space that does not
            fit the file.
    """
    where = where or Where()
    is_fitted = budget is not None and episodes is None
    if episodes is None:
        episodes = USUAL_MISSIONS
    given = {
        "test_episodes": test_episodes,
        "final_episodes": final_episodes,
        "waterfall_missions": waterfall_missions,
    }
    chosen_sizes = {name: size for name, size in given.items() if size is not None}
    space_files = [
        resolve(space, shipped("params") / "search_spaces", "search space") for space in spaces
    ]
    space, content = read_spaces(space_files)
    declaration = StudyDeclaration(
        stack=stack,
        space=space,
        objective=objective,
        sampler=sampler,
        trials=trials,
        episodes=episodes,
        is_raced=is_raced,
        finalists=finalists,
        budget=budget,
        is_fitted=is_fitted,
        estimator=estimator,
        sensors="",
        robot="",
        options=_run_options({"map": map, **options}),
        **(sizes(trials, episodes) | chosen_sizes),
    )
    study = make_study(
        stacks=[stack],
        episodes=max(declaration.test_episodes, episodes),
        map_name=map,
        workers=where.workers,
        **options,
    )
    if declaration.is_by_meetings:
        require_local(where)
        require_meetings(study)
    path, notes = _created(declaration, study, content, space_files, out)
    found = _drive(path, where, budget)
    return found and dataclasses.replace(found, notes=(*notes, *notes_before(declaration, options)))


def _created(
    declaration: StudyDeclaration,
    study: Study,
    content: SpaceFile,
    space_files: Sequence[Path],
    out: Path | None,
) -> tuple[Path, tuple[str, ...]]:
    """Check that all of it fits together, and create the folder; returns it, and notes.

    Args:
        declaration: what was asked for; robot and sensors are added.
        study: with the original.
        content: of the search space.
        space_files: from which it was read.
        out: the folder; None: a new one.
    """
    original, template = study.stacks[0], study.template
    _require_nav2(original)
    declaration = dataclasses.replace(
        declaration,
        sensors=_short(original.sensors, original, "sensors"),
        robot=_short(original.robot, original, "robot"),
    )
    nav2 = nav2_parameters(original.nav2_file, template.allow_unknown)
    space = fit_space(declaration.space, content, nav2, template.allow_unknown)
    objectives = parse_objectives(declaration.objective)
    drawing = make_sampler(
        declaration.sampler, space, template.seed, declaration.trials, len(objectives)
    )
    check_space(space, nav2, drawing, template.allow_unknown)
    path = out or default_folder(f"tune-{original.name}")
    require_usable(path)
    notes = (*check(study), *space.notes)
    texts = {
        TUNING: dump_dataclass(declaration),
        SPACE: _space_text(content, space_files),
        ORIGINAL: with_absolute_files(nav2, template.allow_unknown).document.text,
    }
    create_run(path, about(study, sys.argv), {**parameters(study), **texts})
    return path, notes


def _require_nav2(original: Stack) -> None:
    if not original.is_nav2:
        raise InputError(
            f"stack '{original.name}' does not drive by a Nav2 file that could be tuned; "
            "give another"
        )


def _space_text(content: SpaceFile, files: Sequence[Path]) -> str:
    """The search space as it is kept: the file that was given, or what several come to."""
    if len(files) == 1:
        return read_text(files[0])
    return dump_dataclass(content)


def resume_tuning(
    folder: Path,
    budget: float | None = None,
    where: Where | None = None,
    **more: int | None,
) -> Tuned | None:
    """Go on with the study of a folder; otherwise as :func:`tune`.

    A finished study searches on only with another ``budget``. ``more`` are numbers of missions in
    place of those of before: ``test_episodes``, ``final_episodes``, ``waterfall_missions``.
    """
    # a link may point elsewhere before the study ends
    return _drive(folder.resolve(), where or Where(), budget, more)


def _drive(
    path: Path,
    where: Where,
    seconds: float | None,
    more: Mapping[str, int | None] | None = None,
) -> Tuned | None:
    base = load_study(path, where.workers)
    study = load_tuning(path, base, seconds, more)
    say_notes(version_notes(path))
    searched = study.declaration.episodes
    with Journal(path, searched) as journal, _open_workers(path, where, study, base) as pool:
        later = study.episodes_after_search + study.episodes_of_explanation
        progress = StudyProgress(study.plan, journal, study.declaration.budget, later)
        searching = study.declaration.trials * searched
        limit = study.declaration.budget
        most = f"up to {searching:,d} deliveries to search and {later:,d} to choose, test, explain"
        if limit is not None:
            most = f"as many deliveries as {time_text(limit)} leave time for; {most}"
        say(most)
        if len(journal):
            say(f"going on after {counted(len(journal), 'delivery')}")
        shared = None if where.is_local else path
        with TemporaryDirectory(prefix="navbench-tune-", dir=shared) as files:
            evaluator = StackEvaluator(
                study.template,
                pool,
                journal,
                progress.episode,
                Path(files),
                study.declaration.is_by_meetings,
            )
            budget = Budget(limit, journal)
            try:
                with shown(progress):
                    study = _fitted(study, evaluator, journal, progress, budget)
                    result = _search_and_test(study, evaluator, journal, progress, budget)
                    journal.stop_clock()
                    return written(study, base, result, evaluator, progress, journal, budget)
            except KeyboardInterrupt:
                kept = f"{len(journal)} finished deliveries are kept in {path}"
                following = f"navbench tune --resume {quoted(path)}"
                say(f"interrupted {progress.when}; {kept}; next: {following}")
                return None


def _open_workers(
    path: Path, where: Where, study: TuningStudy, base: Study
) -> AbstractContextManager[Workers]:
    """Workers for deliveries, or for meetings, which copies of them drive."""
    if not study.declaration.is_by_meetings:
        return open_workers(where, base.workers, path, {path: base})
    require_local(where)
    return Workers(base.workers, ParentProcess, where.time_limit)


def _fitted(
    study: TuningStudy,
    evaluator: StackEvaluator,
    journal: Journal,
    progress: StudyProgress,
    budget: Budget,
) -> TuningStudy:
    """The study with as many training missions as the budget lasts for."""
    evaluator.until = budget.end
    found = fitted(study, evaluator, journal, budget)
    progress.plan = found.plan
    count, most = len(found.plan.missions), len(study.plan.missions)
    if count < most and found.fits is not None:
        text = f"{count} instead of {most} training missions: at {journal.pace:.1f} s a delivery "
        text += "the budget lasts for no more; --episodes sets their number"
        if count * journal.pace * LEAST_STUDY > found.fits:
            text += f"; a study on {count} takes {enough_for(count, journal.pace)}"
        say(text)
    return found


def _search_and_test(
    study: TuningStudy,
    evaluator: StackEvaluator,
    journal: Journal,
    progress: StudyProgress,
    budget: Budget,
) -> StudyResult:
    def on_trial(trial: Trial, best: Trial) -> None:
        progress.trial(trial, best, evaluator)
        if trial.number == 0 and trial.state == COMPLETE:
            rows = evaluator.rows(trial.candidate, trial.missions)
            say(starting_point(rows, prices_of(study.template.prices)))

    evaluator.until = budget.end
    search = run_search(study, evaluator, journal, on_trial, budget)
    for note in notes_after_search(study, search, journal, budget):
        say(note)
    if len(search.trials) == 1:  # nothing to choose among, and no change to explain
        progress.begin("test", study.declaration.test_episodes)
    elif study.plan.final_episodes:
        progress.begin("final choice and test")
    else:
        progress.begin("test")
    return finish(study, search, evaluator, journal, budget)


def _run_options(choices: Mapping[str, Any]) -> tuple[str, ...]:
    """The options of ``navbench run`` that differ from its defaults, as one writes them."""
    usual = inspect.signature(make_study).parameters
    given: list[str] = []
    for name in RUN_OPTIONS:
        value = choices.get(name)
        default = usual["map_name" if name == "map" else name].default
        if value is None or value == default:
            continue
        if name in ("distance", "start", "goal"):
            text = ",".join(f"{number:.15g}" for number in value)
        elif (name in FILES and Path(value).is_file()) or (
            name == "people" and is_recording(value)
        ):
            text = str(Path(value).resolve())
        else:
            text = str(value)
        given += [f"--{name}", text]
    if not choices.get("allow_unknown", True):
        given.append("--strict")
    return tuple(given)


def _short(file: str, stack: Stack, field: str) -> str:
    """What a stack's file in the tuning's folder says for a file of the original.

    The name of one that comes with the program, the path of another; that of a robot made from the
    Nav2 file stands in the folder itself.
    """
    path = Path(file)
    if path.parent.parent == shipped("params").resolve():
        return path.stem
    return f"params/{stack.name}-{field}.yaml" if is_own(file) else file
