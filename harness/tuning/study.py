"""A study from its folder to its result: missions, search, test."""

import contextlib
import dataclasses
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from harness.episode.factory import Parts, nav2_parameters, prices_of
from harness.storage.new_run import TUNING
from harness.task.study import EpisodeTask, Study
from harness.tuning.declaration import ORIGINAL, SPACE, StudyDeclaration
from harness.tuning.evaluation import Candidate, Evaluator, unseen_missions
from harness.tuning.finals import decide
from harness.tuning.journal import Journal
from harness.tuning.objective import parse_objectives
from harness.tuning.racing import rungs, stratified
from harness.tuning.result import Finalist, StudyResult
from harness.tuning.sampler import Sampler, make_sampler
from harness.tuning.search import LEAST_GAIN, OnTrial, Plan, Search, front_of
from harness.tuning.space.file import read_space
from harness.tuning.space.paths import AbsentError, locate, with_values
from harness.tuning.space.space import Space, fit_space
from harness.tuning.waterfall import MOST_PLAYERS
from navstack.errors import InputError
from navstack.params.nav2_file.file import Nav2File
from navstack.params.strict import load_dataclass

MOST_RESERVED = 0.5  # of the budget, for final choice and test


@dataclasses.dataclass(frozen=True, slots=True)
class TuningStudy:
    """Everything that decides a study's rows, trials and result."""

    declaration: StudyDeclaration
    template: EpisodeTask  # its stack is the original, its seed that of the training missions
    plan: Plan
    nav2: Nav2File  # the user's file

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
        """Of the waterfall at most: every mixture of its players, and each parameter set back."""
        changed = len(self.plan.space.parameters)
        mixtures = int(2 ** min(changed, MOST_PLAYERS)) - 2 + changed
        return mixtures * self.declaration.waterfall_missions


def check_space(
    space: Space,
    nav2: Nav2File,
    sampler: Sampler,
    allow_unknown: bool = False,
) -> None:
    """Check before anything is driven that a search space has points, and that a file takes them.

    Raises:
        InputError: no point keeps the constraints, or a parameter cannot be set where it stands.
    """
    if sampler.ask() is None:
        raise InputError(
            f"{space.name}: no point was found beside the file's own that keeps the constraints; "
            "loosen them"
        )
    own = {}
    for path in (path for each in space.parameters for path in each.paths):
        with contextlib.suppress(AbsentError):  # another choice of a list brings it
            own[path] = locate(nav2, path).value
    with_values(nav2, own, allow_unknown)


def load_tuning(
    folder: Path,
    study: Study,
    budget: float | None,
    test_episodes: int | None = None,
) -> TuningStudy:
    """The study of a folder.

    Args:
        folder: of the study.
        study: as its ``run.json`` has it.
        budget: [s] in place of the declared one; None: the declared one.
        test_episodes: likewise.

    Raises:
        InputError: the folder holds no such study, or a file of it cannot be used.
    """
    if not (folder / "params" / TUNING).is_file():
        raise InputError(
            f"'{folder}' is no tuning study: params/{TUNING} is missing; use navbench run --resume"
        )
    declaration = load_dataclass(StudyDeclaration, folder / "params" / TUNING)
    if budget is not None:
        declaration = dataclasses.replace(declaration, budget=budget)
    if test_episodes is not None:
        declaration = dataclasses.replace(declaration, test_episodes=test_episodes)
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
        stratified(
            {number: _length(template, number) for number in range(declaration.episodes)},
            template.seed,
        ),
        declaration.trials,
        declaration.is_raced,
        declaration.finalists,
        tuple(range(declaration.episodes, declaration.episodes + declaration.final_episodes)),
        prices_of(template.prices).delivery_fee.value,
    )
    found = TuningStudy(declaration, template, plan, nav2)
    found.make_sampler()
    return found


def run_search(
    study: TuningStudy,
    evaluator: Evaluator,
    journal: Journal,
    on_trial: OnTrial,
    is_over: bool = False,
) -> Search:
    """Drive every trial that the budget allows; none where the original leaves nothing to gain.

    Those that the journal has are gone through again without driving.

    Args:
        study: the study.
        evaluator: that drives.
        journal: what has been driven.
        on_trial: hears of each trial.
        is_over: the search has ended before, and nothing shall be added to it.
    """
    search = Search(study.plan, study.make_sampler(), evaluator, on_trial)
    in_time = within_budget(study.declaration.budget, study.episodes_after_search, journal)
    has_begun = within_budget(0.0, 0, journal)

    def may_begin(candidate: Candidate, missions: tuple[int, ...]) -> bool:
        if is_over or search.is_futile:
            return has_begun(candidate, missions)
        return in_time(candidate, missions)

    search.run(may_begin)
    return search


def finish(
    study: TuningStudy,
    search: Search,
    evaluator: Evaluator,
    journal: Journal,
) -> StudyResult:
    """Choose among the best, and drive the test with original and incumbent.

    A test that was longer in an earlier session stays so long.
    """
    plan, trials = study.plan, tuple(search.trials)
    finals: tuple[Finalist, ...] = ()
    if plan.final_episodes:
        finals = decide(trials, plan.finalists, plan.final_missions, plan.objectives[0], evaluator)
    if finals:
        best = finals[0].candidate
    else:
        best = search.incumbent.candidate
    original, incumbent = trials[0].candidate, Candidate("incumbent", best.values)
    test = unseen_missions(
        max(study.declaration.test_episodes, journal.tested((original, incumbent)))
    )
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
    )


def _length(template: EpisodeTask, number: int) -> float:
    """Shortest path [m] of a training mission."""
    task = dataclasses.replace(template, episode=number)
    return Parts(task).mission(task.generators()["mission"]).shortest_path


def within_budget(
    budget: float | None,
    later: int,
    journal: Journal,
) -> Callable[[Candidate, tuple[int, ...]], bool]:
    """Whether a trial may begin: it has begun before, or the budget has time for it.

    Args:
        budget: [s] of wall time for search, final choice and test; None: any.
        later: episodes of the final choice and the test.
        journal: which keeps the time.
    """

    def may_begin(candidate: Candidate, missions: tuple[int, ...]) -> bool:
        if budget is None or any(
            journal.get(candidate, mission) is not None for mission in missions
        ):
            return True
        reserve = min(later * journal.pace, MOST_RESERVED * budget)
        return journal.elapsed + reserve < budget

    return may_begin


def notes_before(declaration: StudyDeclaration, options: Mapping[str, Any]) -> list[str]:
    """What is to be said before anything is driven.

    Args:
        declaration: of the study.
        options: of ``navbench run``, by name; those that were not given are None.
    """
    found = []
    if options.get("start") is not None and options.get("goal") is not None:
        found.append(
            "--start and --goal are given: training and test have other people and other noise, "
            "but the same way; the "
            "test says nothing of other ways"
        )
    if declaration.is_raced and len(rungs(declaration.episodes)) == 1:
        found.append(
            f"no trial is dropped early: {declaration.episodes} --episodes cannot be halved into "
            "parts of 5 or more; "
            "give 32, 64 or the like"
        )
    return found


def notes_after_search(study: TuningStudy, search: Search, journal: Journal) -> list[str]:
    """What the search left out, and whether what follows will take longer than was meant."""
    driven, asked, budget = (
        len(search.trials) - 1,
        study.declaration.trials,
        study.declaration.budget,
    )
    found = []
    if search.is_futile and not driven:
        found.append(
            f"the search stops: on its {len(study.plan.missions)} training missions no file can "
            f"earn {LEAST_GAIN:.2f} USD more than yours"
        )
    elif search.is_exhausted:
        found.append(
            f"after {driven} of {asked} trials there is no further point that keeps the constraints"
        )
    elif driven < asked and budget is not None:
        found.append(
            f"the budget of {budget:g} s cut off {asked - driven} of {asked} trials; --resume with "
            "a longer --budget "
            "drives the rest"
        )
    missing = 0.0
    if budget is not None:
        missing = study.episodes_after_search * journal.pace + journal.elapsed - budget
    if missing > 0.0:
        found.append(
            f"note: the {study.episodes_after_search} deliveries of final choice and test may take "
            f"{missing:.0f} s "
            "longer than the budget; fewer --test-episodes and --final-episodes leave more of it "
            "for the search"
        )
    return found
