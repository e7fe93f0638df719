"""Which parameters matter to the objective, estimated from a study's trials."""

import numpy as np

from harness.tuning.result import TrialTable

TOP = 0.25  # share of the trials, the best ones, that importance is about
# so that the best are five, fewer than which PED-ANOVA's densities are not to be trusted
LEAST_TRIALS = 20


def importances(table: TrialTable) -> dict[str, float]:
    """Importance of each parameter by PED-ANOVA (Watanabe et al. 2023, IJCAI), the largest first.

    It asks how far the density of the best quarter of the trials departs from that of all,
    parameter by parameter. The shares add up to one whatever the data. Empty where the trials are
    fewer than :data:`LEAST_TRIALS`, or all alike.
    """
    varied = table.varied
    if len(table.trials) < LEAST_TRIALS or len(varied) < 2 or np.ptp(table.objective) == 0.0:
        return {}
    import optuna  # takes half a second
    from optuna.distributions import (
        BaseDistribution,
        CategoricalDistribution,
        FloatDistribution,
    )

    optuna.logging.set_verbosity(optuna.logging.ERROR)
    distributions: dict[str, BaseDistribution] = {}
    for number in varied:
        parameter = table.parameters[number]
        distributions[parameter.name] = FloatDistribution(0.0, 1.0)
        if not parameter.is_ordered:
            levels = np.unique(table.places[:, number]).tolist()
            distributions[parameter.name] = CategoricalDistribution(levels)
    study = optuna.create_study(direction="maximize")
    for place, value in zip(table.places[:, varied].tolist(), table.objective, strict=True):
        params = dict(zip(distributions, place, strict=True))
        study.add_trial(
            optuna.trial.create_trial(
                params=params,
                distributions=distributions,
                value=float(value),
            )
        )
    evaluator = optuna.importance.PedAnovaImportanceEvaluator(target_quantile=TOP)
    return dict(optuna.importance.get_param_importances(study, evaluator=evaluator))
