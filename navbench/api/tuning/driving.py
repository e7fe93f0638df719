"""Driving a study of tuning: search, choice, test and explanation."""

from contextlib import AbstractContextManager
from pathlib import Path
from tempfile import TemporaryDirectory

from harness.episode.files import prices_of
from harness.execution.executors import ParentProcess
from harness.execution.workers import Workers
from harness.report.numbers import counted
from harness.report.tuning.summary import starting_point
from harness.storage.texts import quoted, time_text
from harness.study.manifest import load_study, version_notes
from harness.study.places import Where, open_workers
from harness.task.study import Study
from harness.tuning.budget import LEAST_STUDY, Budget, enough_for
from harness.tuning.journal import Journal
from harness.tuning.notes import notes_after_search
from harness.tuning.output import forget_request, keep_request, requested
from harness.tuning.progress import StudyProgress
from harness.tuning.result import COMPLETE, StudyResult, Trial
from harness.tuning.stack_evaluator import StackEvaluator
from harness.tuning.study import (
    TuningStudy,
    finish,
    fitted,
    load_tuning,
    run_search,
)
from navbench.api.driving import say_notes
from navbench.api.meetings.driving import require_local
from navbench.api.progress import say, shown
from navbench.api.tuning.written import Tuned, written


def drive_tuning(
    path: Path,
    where: Where,
    **more: float | None,
) -> Tuned | None:
    """Drive what the study of a folder lacks; otherwise as :func:`navbench.tune`.

    Args:
        path: of the folder.
        where: deliveries are driven.
        more: budget [s] and numbers of missions in place of those of before; None: those.
    """
    base = load_study(path, where.workers)
    request = requested(path).extended(**more)
    study = load_tuning(path, base, request)
    say_notes(version_notes(path))
    searched = study.declaration.episodes
    with Journal(path, searched) as journal, _open_workers(path, where, study, base) as pool:
        keep_request(path, request)
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
                    tuned = written(study, base, result, evaluator, progress, journal, budget)
                    forget_request(path)
                    return tuned
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
