"""The search: one trial after the other, each against the incumbent on the same missions."""

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from harness.metrics.columns import Row
from harness.tuning.evaluation import Candidate, Evaluator
from harness.tuning.finals import most_episodes
from harness.tuning.objective import Objective, UndefinedError, is_money
from harness.tuning.racing import LEVEL, RESOLUTION, adjusted, p_no_worse, rungs
from harness.tuning.result import COMPLETE, FAILED, PRUNED, Trial
from harness.tuning.sampler import Point, Sampler
from harness.tuning.space.space import Space
from navstack.errors import InputError, ParameterError

LEAST_GAIN = 0.5  # [USD/run] on the training missions; a search that cannot gain it is not driven


@dataclass(frozen=True, slots=True)
class Plan:
    """What of a study decides its trials; nothing else does."""

    space: Space
    objectives: tuple[Objective, ...]
    missions: tuple[int, ...]  # for training, in their order
    trials: int  # beside the original
    is_raced: bool = True
    # of a study with one objective: trials that the final choice lets meet the original
    finalists: int = 0
    final_missions: tuple[int, ...] = ()  # for training, too, that the final choice alone drives
    fee: float | None = None  # [USD/run] that no file can earn more than; None: not known

    @property
    def final_episodes(self) -> int:
        """Deliveries that the final choice takes at most."""
        if len(self.objectives) == 1:
            return most_episodes(self.finalists, len(self.final_missions))
        return 0

    @property
    def rungs(self) -> tuple[int, ...]:
        """Numbers of missions after which a trial may be dropped; of a Pareto study only all."""
        total = len(self.missions)
        if self.is_raced and len(self.objectives) == 1:
            return rungs(total)
        return (total,)

    def order(self, number: int) -> tuple[int, ...]:
        """The missions as a trial meets them: each trial begins at another rung's worth of them.

        Were the first ones the same for all, an incumbent that was lucky on them would let nobody
        past.
        """
        first = self.rungs[0]
        begin = number * first % len(self.missions)
        return (*self.missions[begin:], *self.missions[:begin])


MayBegin = Callable[[Candidate, tuple[int, ...]], bool]
OnTrial = Callable[[Trial, Trial], None]  # hears of a trial and the incumbent after it


class Search:
    """Runs trials and keeps the incumbent."""

    def __init__(
        self,
        plan: Plan,
        sampler: Sampler,
        evaluator: Evaluator,
        on_trial: OnTrial,
    ) -> None:
        self._plan, self._sampler, self._evaluator, self._on_trial = (
            plan,
            sampler,
            evaluator,
            on_trial,
        )
        self.trials: list[Trial] = []
        self.is_exhausted = False  # there are no further points
        self._incumbent: Trial | None = None

    @property
    def incumbent(self) -> Trial:
        """The best so far that drove all missions."""
        if self._incumbent is None:
            raise ValueError("nothing has been driven yet")
        return self._incumbent

    @property
    def room(self) -> float | None:
        """What any file could gain on the training missions [USD/run]; None: nobody knows.

        An objective in dollars is at most the mean margin, and no delivery earns more than the fee.
        """
        plan = self._plan
        is_known = len(plan.objectives) == 1 and is_money(plan.objectives[0].name)
        if plan.fee is None or not is_known:
            return None
        return plan.fee - self.trials[0].values[0]

    @property
    def is_futile(self) -> bool:
        """Whether no file can gain :data:`LEAST_GAIN` on the training missions."""
        return self.room is not None and self.room < LEAST_GAIN

    def run(self, may_begin: MayBegin = lambda candidate, missions: True) -> None:
        """Drive the original, and trials as long as there are any.

        Args:
            may_begin: asked before each trial, with its candidate and the missions of its first
                rung; if not, it and those after it are not driven.

        Raises:
            InputError: the original cannot be driven, or an objective is undefined for it.
        """
        self._add(self._original())
        for number in range(1, self._plan.trials + 1):
            point = self._sampler.ask()
            if point is None:
                self.is_exhausted = True
                return
            candidate = Candidate(f"trial-{number}", self._plan.space.values(point))
            if not may_begin(candidate, self._plan.order(number)[: self._plan.rungs[0]]):
                return
            self._add(self._drive(number, candidate, point))

    def _add(self, trial: Trial) -> None:
        self._sampler.tell(trial.point, trial.told or None)
        self.trials.append(trial)
        if trial.state == COMPLETE and (
            self._incumbent is None or self._is_better(trial, self._incumbent)
        ):
            self._incumbent = trial
        self._on_trial(trial, self.incumbent)

    def _original(self) -> Trial:
        candidate, total = Candidate("original", {}), len(self._plan.missions)
        rows = self._evaluator.rows(candidate, self._plan.missions)
        error = _error_in(rows)
        if error:
            raise InputError(f"the original file cannot be tuned: {error}")
        values = tuple(objective.value(rows, total) for objective in self._plan.objectives)
        return Trial(
            0,
            candidate,
            self._plan.space.original,
            COMPLETE,
            self._plan.missions,
            values,
            values,
            None,
            "",
        )

    def _drive(self, number: int, candidate: Candidate, point: Point) -> Trial:
        plan, order = self._plan, self._plan.order(number)
        failed = Trial(number, candidate, point, FAILED, (), (), (), None, "")
        p: float | None = None
        for look, count in enumerate(plan.rungs):
            # equal rows have equal means
            if count < len(order):
                missions = order[:count]
            else:
                missions = plan.missions
            try:
                rows = self._evaluator.rows(candidate, missions)
                reason = _error_in(rows)
                values: tuple[float, ...] = ()
                if not reason:
                    values = tuple(each.value(rows, len(plan.missions)) for each in plan.objectives)
            except UndefinedError as error:
                if count < len(order):
                    continue  # further missions may have a value
                reason, values = str(error), ()
            except ParameterError as error:  # values that cannot be had
                reason, values = str(error), ()
            if reason:
                return dataclasses.replace(failed, missions=missions, reason=reason)
            if look < len(plan.rungs) - 1:
                p, told, reason = self._look(rows, order)
                if reason:
                    return Trial(
                        number,
                        candidate,
                        point,
                        PRUNED,
                        missions,
                        values,
                        (told,),
                        p,
                        reason,
                    )
        return Trial(number, candidate, point, COMPLETE, plan.missions, values, values, p, "")

    def _look(self, rows: Sequence[Row], order: Sequence[int]) -> tuple[float, float, str]:
        """Hold a trial against the incumbent.

        Returns:
            P value that it is no worse, its objective as it would be on all missions, and why it is
            dropped; empty: it is not.
        """
        objective, rival = self._plan.objectives[0], self.incumbent.candidate
        known = self._evaluator.rows(rival, order)
        own, other, all_ = (
            objective.scores(each, known) for each in (rows, known[: len(rows)], known)
        )
        p = p_no_worse(own, other, RESOLUTION if is_money(objective.name) else 0.0)
        shift = adjusted(own, other, float(np.nanmean(all_))) - float(np.nanmean(own))
        told = objective.value(rows, len(known)) + shift
        if objective.is_hopeless(rows) and objective.shortfall(known) == 0.0:
            return p, told, f"the side condition of {objective.name} is out of reach"
        return (
            p,
            told,
            f"worse than {rival.name} with p = {p:.3f} below {LEVEL:g}" if p < LEVEL else "",
        )

    def _is_better(self, trial: Trial, incumbent: Trial) -> bool:
        """By the side condition first, then by the first objective."""
        objective, missions = self._plan.objectives[0], self._plan.missions
        own, other = (
            objective.shortfall(self._evaluator.rows(each.candidate, missions))
            for each in (trial, incumbent)
        )
        if own != other:
            return own < other
        return trial.values[0] > incumbent.values[0] + objective.resolution


def front_of(trials: Sequence[Trial]) -> tuple[int, ...]:
    """Numbers of the complete trials on the Pareto front."""
    known = [trial for trial in trials if trial.state == COMPLETE]
    return tuple(
        trial.number for trial in known if not any(_dominates(other, trial) for other in known)
    )


def _dominates(a: Trial, b: Trial) -> bool:
    return a.values != b.values and all(x >= y for x, y in zip(a.values, b.values, strict=True))


def _error_in(rows: Sequence[Row]) -> str:
    return next((str(row["error"]) for row in rows if row.get("error") is not None), "")
