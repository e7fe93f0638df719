"""PED-ANOVA (Watanabe et al. 2023, IJCAI) by Optuna, many times over the same trials."""

from collections.abc import Container, Sequence
from typing import Any

import numpy as np
import optuna
from optuna.distributions import BaseDistribution, CategoricalDistribution, FloatDistribution
from optuna.importance import PedAnovaImportanceEvaluator, get_param_importances
from optuna.trial import FrozenTrial, TrialState

from harness.tuning.space.space import Parameter
from navstack.types import FloatArray, IntArray


class _GivenTrials(optuna.Study):
    """A study of trials that are there already.

    A storage would copy each with all that it holds.
    """

    given: Sequence[FrozenTrial] = ()

    def get_trials(
        self, deepcopy: bool = True, states: Container[TrialState] | None = None
    ) -> list[FrozenTrial]:
        return list(self.given)


class PedAnova:
    """The importance of parameters for being among the best of some trials."""

    def __init__(self, parameters: Sequence[Parameter], places: FloatArray, top: float) -> None:
        """``places`` (trials, parameters) where the trials are, 0..1.

        ``top`` the share of them that is the best.
        """
        optuna.logging.set_verbosity(optuna.logging.ERROR)
        distributions: dict[str, BaseDistribution] = {
            each.name: FloatDistribution(0.0, 1.0)
            if each.is_ordered
            else CategoricalDistribution(np.unique(places[:, i]).tolist())
            for i, each in enumerate(parameters)
        }
        self._points = [dict(zip(distributions, point, strict=True)) for point in places.tolist()]
        self._distributions = distributions
        self._evaluator = PedAnovaImportanceEvaluator(target_quantile=top)
        storage = optuna.storages.InMemoryStorage()
        self._study = _GivenTrials(
            optuna.create_study(storage=storage, direction="maximize").study_name, storage
        )

    def shares(self, chosen: IntArray, objective: FloatArray) -> FloatArray:
        """Shares (parameters,) by some of the trials, which reached an objective each."""
        self._study.given = [
            self._trial(number, self._points[place], value)
            for number, (place, value) in enumerate(zip(chosen, objective.tolist(), strict=True))
        ]
        found = get_param_importances(self._study, evaluator=self._evaluator, normalize=True)
        return np.array([found[name] for name in self._distributions])

    def _trial(self, number: int, params: dict[str, Any], value: float) -> FrozenTrial:
        return FrozenTrial(
            number=number,
            trial_id=number,
            state=TrialState.COMPLETE,
            value=value,
            params=params,
            distributions=self._distributions,
            datetime_start=None,
            datetime_complete=None,
            user_attrs={},
            system_attrs={},
            intermediate_values={},
        )
