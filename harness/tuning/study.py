"""A study from its folder to its result: missions, search, test."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from harness.episode.files import nav2_parameters, prices_of
from harness.storage.manifest_file import require_study
from harness.storage.new_run import TUNING
from harness.storage.texts import quoted
from harness.task.study import EpisodeTask, Study
from harness.tuning.budget import Budget, enough_for
from harness.tuning.declaration import ORIGINAL, SPACE, StudyDeclaration
from harness.tuning.evaluation import Candidate, Evaluator, OutOfTimeError, unseen_missions
from harness.tuning.finals import decide
from harness.tuning.journal import Journal
from harness.tuning.objective import parse_objectives
from harness.tuning.output import Request, ended
from harness.tuning.result import Finalist, StudyResult, Trial
from harness.tuning.sampler import Sampler, make_sampler
from harness.tuning.search import OnTrial, Plan, Search, front_of
from harness.tuning.space.file import read_space
from harness.tuning.space.fitting import fit_space
from harness.tuning.stack_evaluator import StackEvaluator
from harness.tuning.training import FEWER_MISSIONS, PILOT, missions_within, training_missions
from harness.tuning.waterfall import MOST_PLAYERS
from navstack.errors import InputError
from navstack.params.nav2_file.file import Nav2File
from navstack.params.strict import load_dataclass

FEWEST_FINAL = 4  # missions of a final choice that the budget shortens


@dataclasses.dataclass(frozen=True, slots=True)
class TuningStudy:
    """Everything that decides a study's rows, trials and result."""

    declaration: StudyDeclaration
    template: EpisodeTask  # its stack is the original, its seed that of the training missions
    plan: Plan
    nav2: Nav2File  # the user's file
    # trials after which an earlier session ended the search; None: it goes on
    ended_after: int | None = None
    # [s] of wall time to which the number of training missions is fitted; None: it is not
    fits: float | None = None

    @property
    def episodes_after_search(self) -> int:
        """Of the final choice at most, and of the test."""
        return self.plan.final_episodes + 2 * self.declaration.test_episodes

    def make_sampler(self) -> Sampler:
        """What chooses its points, from the first one on.

        Raises:
            InputError: there is none of this name, or it cannot do what is asked for.
        """
        plan = self.plan
        return make_sampler(
            self.declaration.sampler,
            plan.space,
            self.template.seed,
            plan.trials,
            len(plan.objectives),
        )

    @property
    def episodes_of_explanation(self) -> int:
        """Of the waterfall at most: every mixture of its players but both files themselves."""
        players = min(len(self.plan.space.parameters), MOST_PLAYERS)
        return int(2**players - 2) * self.declaration.waterfall_missions


def load_tuning(
    folder: Path,
    study: Study,
    request: Request | None = None,
) -> TuningStudy:
    """The study of a folder.

    A finished one has no budget and the sizes that it came to, but for what is asked for now.

    Args:
        folder: of the study.
        study: as its ``run.json`` has it.
        request: what is asked for in place of what was declared; None: nothing.

    Raises:
        InputError: the folder holds no such study, or a file of it cannot be used.
    """
    require_study(folder, TUNING)
    request = request or Request()
    declaration = load_dataclass(StudyDeclaration, folder / "params" / TUNING)
    fits = None
    if declaration.is_fitted:
        fits = declaration.budget
    if request.budget is not None:
        declaration = dataclasses.replace(declaration, budget=request.budget)
    sizes: dict[str, Any] = {}
    ended_after = None
    if request.budget is None and (before := ended(folder)) is not None:
        ended_after = before.trials
        declaration = dataclasses.replace(declaration, budget=None)
        sizes |= before.sizes
    sizes |= request.sizes
    declaration = dataclasses.replace(declaration, **sizes)
    original = folder.absolute() / "params" / ORIGINAL
    stack = dataclasses.replace(study.template.stack, nav2_file=str(original))
    template = dataclasses.replace(study.template, stack=stack)
    nav2 = nav2_parameters(str(original), template.allow_unknown)
    space = fit_space(
        declaration.space, read_space(folder / "params" / SPACE), nav2, template.allow_unknown
    )
    plan = Plan(
        space,
        parse_objectives(declaration.objective),
        training_missions(template, declaration.episodes),
        declaration.trials,
        declaration.is_raced,
        declaration.finalists,
        tuple(range(declaration.episodes, declaration.episodes + declaration.final_episodes)),
        prices_of(template.prices).delivery_fee.value,
    )
    found = TuningStudy(declaration, template, plan, nav2, ended_after, fits)
    found.make_sampler()
    return found


def fitted(
    study: TuningStudy, evaluator: Evaluator, journal: Journal, budget: Budget
) -> TuningStudy:
    """The study with as many training missions as its budget lasts for, where that is wanted.

    The original drives the first few of them. The journal keeps how long they took, so that a
    later session comes to the same number.

    Raises:
        InputError: the budget ends before.
    """
    if study.fits is None:
        return study
    try:
        evaluator.rows(Candidate("original", {}), range(PILOT))
    except OutOfTimeError:
        raise _too_short(study, journal, budget) from None
    count = missions_within(study.fits, journal.pace_of(PILOT))
    if count >= len(study.plan.missions):
        return study
    plan = dataclasses.replace(study.plan, missions=training_missions(study.template, count))
    return dataclasses.replace(study, plan=plan)


def run_search(
    study: TuningStudy,
    evaluator: Evaluator,
    journal: Journal,
    on_trial: OnTrial,
    budget: Budget,
) -> Search:
    """Drive every trial that the budget allows; none where the original leaves nothing to gain.

    Those that the journal has are gone through again without driving.

    Args:
        study: the study.
        evaluator: that drives.
        journal: what has been driven.
        on_trial: hears of each trial.
        budget: of wall time.

    Raises:
        InputError: the original cannot be driven, or not within the budget.
    """
    search = Search(study.plan, study.make_sampler(), evaluator, on_trial)
    began: list[float] = []  # [s] when the first trial could begin

    def may_begin(candidate: Candidate, missions: tuple[int, ...]) -> bool:
        began.append(journal.elapsed)
        if study.ended_after is not None:
            return len(search.trials) <= study.ended_after
        if has_begun(journal, candidate, missions):
            return True
        if search.is_futile:
            return False
        return budget.allows(len(missions), study.episodes_after_search, began[0])

    try:
        search.run(may_begin)
    except OutOfTimeError:
        if not search.trials:
            raise _too_short(study, journal, budget) from None
    return search


def has_begun(journal: Journal, candidate: Candidate, missions: Sequence[int]) -> bool:
    """Whether a trial has driven one of the missions before."""
    return any(journal.get(candidate, mission) is not None for mission in missions)


def _too_short(study: TuningStudy, journal: Journal, budget: Budget) -> InputError:
    """What to do where the budget ends before the original has driven its missions."""
    count, folder = len(study.plan.missions), journal.path.parent
    least = FEWER_MISSIONS[-1]
    fewer = ""
    if study.fits is not None:
        count = min(count, least)
    elif count > least:
        fewer = f" Fewer: --episodes {least}."
    enough = enough_for(count, journal.pace, budget.seconds or 0.0)
    return InputError(
        f"the budget of {budget.seconds:g} s ended after {len(journal)} of the {count} training "
        f"missions of your file, before the first trial; a study on {count} takes {enough}: your "
        f"file, a few trials, a test.{fewer} next: navbench tune --resume {quoted(folder)} "
        f"--budget {enough}"
    )


def finish(
    study: TuningStudy,
    search: Search,
    evaluator: StackEvaluator,
    journal: Journal,
    budget: Budget,
) -> StudyResult:
    """Choose among the best, and drive the test with original and incumbent.

    Both take as many missions as there is time for, and no fewer than in an earlier session; none
    where the budget ended before a trial.
    """
    plan, trials = study.plan, tuple(search.trials)
    evaluator.until = budget.until
    finals, met = _choice(study, trials, evaluator, journal, budget)
    if finals:
        best = finals[0].candidate
    else:
        best = search.incumbent.candidate
    original, incumbent = trials[0].candidate, Candidate("incumbent", best.values)
    if not best.values:
        budget.ending = 0
    evaluator.until = budget.until
    test: tuple[int, ...] = ()
    if len(trials) > 1 or search.is_futile or budget.seconds is None:
        test = _tested(study, (original, incumbent), evaluator, journal)
    return StudyResult(
        original=original,
        incumbent=incumbent,
        objectives=tuple(objective.name for objective in plan.objectives),
        space=plan.space,
        trials=trials,
        front=front_of(trials),
        seed=study.template.seed,
        train_missions=plan.missions,
        test_missions=test,
        train_rows=(
            evaluator.rows(original, plan.missions),
            evaluator.rows(incumbent, plan.missions),
        ),
        test_rows=(evaluator.rows(original, test), evaluator.rows(incumbent, test)) if test else (),
        finals=finals,
        final_missions=met,
        has_room=not search.is_futile,
    )


def _choice(
    study: TuningStudy,
    trials: Sequence[Trial],
    evaluator: Evaluator,
    journal: Journal,
    budget: Budget,
) -> tuple[tuple[Finalist, ...], tuple[int, ...]]:
    """The finalists, the best first, and the missions on which they met."""
    plan = study.plan
    if not plan.final_episodes:
        return (), ()
    wanted, share = len(plan.final_missions), budget.share_of(study.episodes_after_search)
    count = wanted
    if share < 1.0:
        known = journal.driven([trials[0].candidate], plan.final_missions[0])
        count = min(max(int(share * wanted), known), wanted)
        if count < FEWEST_FINAL:
            return (), ()
    met = plan.final_missions[:count]
    try:
        return decide(trials, plan.finalists, met, plan.objectives[0], evaluator), met
    except OutOfTimeError:
        return (), ()


def _tested(
    study: TuningStudy,
    both: tuple[Candidate, Candidate],
    evaluator: StackEvaluator,
    journal: Journal,
) -> tuple[int, ...]:
    """The test missions that both have driven."""
    missions = unseen_missions(max(study.declaration.test_episodes, journal.driven(both)))
    try:
        evaluator.drive(both, missions)
    except OutOfTimeError:
        return unseen_missions(journal.driven(both))
    return missions
