"""What is worked out and written once a tuning's search and test are over."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from harness.audit.pairs import Conditions
from harness.economics.unseen import contact_limits
from harness.episode.files import prices_of, rules_of, world_params
from harness.metrics.columns import Row
from harness.report.page.document import write_study_page
from harness.report.tuning.decision import Advice, decision, next_command, setup_of
from harness.report.tuning.document import write_tuning
from harness.storage.documents import write_document
from harness.storage.texts import quoted
from harness.study.again import PARTINGS, record_again
from harness.study.stored_run import load_run
from harness.task.study import Study
from harness.tuning.budget import Budget
from harness.tuning.dashboard import write_dashboard
from harness.tuning.declaration import ORIGINAL
from harness.tuning.explanation import Explanation, explain
from harness.tuning.journal import Journal
from harness.tuning.mission_differences import MissionDifference
from harness.tuning.output import (
    DOCUMENT,
    TUNED,
    run_command,
    study_document,
    test_command,
    write_files,
)
from harness.tuning.progress import StudyProgress
from harness.tuning.result import StudyResult
from harness.tuning.scores import scores_document
from harness.tuning.stack_evaluator import StackEvaluator
from harness.tuning.study import TuningStudy
from navbench.api.lint import robot_limits
from navbench.api.progress import say
from navbench.api.report import today
from navstack.lint import lint
from navstack.params.nav2_file.file import inspect_nav2
from navstack.params.nav2_file.findings import Notice

FEWEST_OF_WATERFALL = 5  # missions of one that the budget shortens


@dataclass(frozen=True)
class Tuned:
    """A finished study."""

    folder: Path
    result: StudyResult
    scores: Row
    explanation: Explanation
    about: str  # what was tuned, and where
    lint: Row  # of the tuned file
    run_command: Sequence[str]  # ``navbench run`` with the tuned file
    test_command: str  # drives its test again
    document: Row
    errors: Sequence[str]  # of episodes that ended in one
    pace: float  # wall time [s] of a delivery
    notes: Sequence[str] = ()  # on the file, the robot and the search

    @property
    def advice(self) -> Advice:
        """What to do with the tuned file."""
        return decision(self.result, self.scores, self.explanation)

    @property
    def next_command(self) -> str:
        """What to do next."""
        return next_command(self.advice, self.folder, self.test_command, self.pace)

    def as_json(self) -> Row:
        """As ``navbench tune --json`` prints it."""
        return {
            **self.document,
            "about": self.about,
            "decision": str(self.advice),
            "explanation": self.explanation.document,
        }


def written(
    study: TuningStudy,
    base: Study,
    result: StudyResult,
    evaluator: StackEvaluator,
    progress: StudyProgress,
    journal: Journal,
    budget: Budget,
) -> Tuned:
    """Work out the explanation, and write everything."""
    path = journal.path.parent
    declaration = dataclasses.replace(
        study.declaration,
        episodes=len(result.train_missions),
        test_episodes=len(result.test_missions),
        final_episodes=len(result.final_missions),
        waterfall_missions=_waterfall_missions(study, result, budget, path),
    )
    write_files(result, study.nav2, base.stacks[0], declaration, path)
    write_dashboard(result, path)
    lint = lint_of(path, base.stacks[0].robot, study.template.allow_unknown)
    scores = scores_document(result)
    document = study_document(result, study.nav2, declaration, scores, lint, path)
    write_document(path / DOCUMENT, document)
    if declaration.waterfall_missions and result.incumbent.values:
        progress.begin("explanation")
    evaluator.until = budget.until
    template = base.template
    world = world_params(template.world, template.pedestrians, template.people)
    rules = rules_of(template.rules)
    explanation = explain(
        result,
        evaluator,
        path,
        prices_of(template.prices),
        Conditions(world.contacts.counted_impulse, rules.spoiled_fraction),
        declaration.waterfall_missions,
        contact_limits(dataclasses.asdict(world), dataclasses.asdict(rules), result.judged_rows),
    )
    command, again = run_command(declaration, path), test_command(declaration, result.seed, path)
    about = setup_of(declaration, template)
    markdown = write_tuning(result, scores, explanation, about, command, path, again, lint)
    if explanation.partings:
        progress.begin("replays")
    folders = _record_partings(explanation.partings, base, evaluator, path)
    write_study_page(markdown, [load_run(str(each)) for each in folders], today())
    return Tuned(
        folder=path,
        result=result,
        scores=scores,
        explanation=explanation,
        about=about,
        lint=lint,
        run_command=command,
        test_command=again,
        document=document,
        errors=journal.errors,
        pace=journal.pace,
    )


def _waterfall_missions(study: TuningStudy, result: StudyResult, budget: Budget, path: Path) -> int:
    """On how many missions there is time to drive all mixtures of old and new values."""
    wanted = study.declaration.waterfall_missions
    if not wanted or not result.incumbent.values:
        return wanted
    count = int(budget.share_of(study.episodes_of_explanation) * wanted)
    if count >= min(wanted, FEWEST_OF_WATERFALL):
        return count
    command = f"navbench tune --resume {quoted(path)} --waterfall {wanted}"
    say(f"note: the budget leaves no time for the waterfall; {command} drives it")
    return 0


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
    before = lint(inspect_nav2(folder / "params" / ORIGINAL, allow_unknown), limits)
    after = lint(inspect_nav2(folder / TUNED, allow_unknown), limits)
    return {
        "errors": sum(notice.is_error for notice in after),
        "warnings": sum(not notice.is_error for notice in after),
        "new": _missing_from(before, after),
        "gone": _missing_from(after, before),
    }


def _missing_from(reference: Sequence[Notice], notices: Sequence[Notice]) -> list[str]:
    """The notices of which the reference has none with the same rule and parameter."""
    known = {(notice.id, notice.path) for notice in reference}
    return [str(notice) for notice in notices if (notice.id, notice.path) not in known]
