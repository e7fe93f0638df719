"""Why the tuned file pays, and whether to trust it.

The core of ``navbench tune`` calls :func:`explain` once the search and the test are over;
``harness.report.tuning`` prints what comes of it.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from harness.audit.auditor import Audit
from harness.audit.findings import AuditEvidence
from harness.audit.pairs import MONEY, Conditions, Pairs, pair_up
from harness.economics.accountings import PUBLISHED
from harness.economics.cost_model import running
from harness.economics.cost_terms import COUNTED_TERMS, MARGIN
from harness.economics.prices import Prices
from harness.economics.unseen import (
    ContactLimits,
    difference_admitting_unseen,
    margin_admitting_unseen,
    reach_of_loss,
)
from harness.economics.valuation import MEETINGS_LOSS, deliveries, meetings_losses
from harness.metrics.columns import Row
from harness.statistics.bootstrap import percentile_interval, resampled_means
from harness.statistics.interval import Interval, fewest_missions
from harness.statistics.unseen import Reach
from harness.storage.documents import as_json, write_document
from harness.tuning.declaration import MOST_EPISODES
from harness.tuning.evaluation import Evaluator, OutOfTimeError
from harness.tuning.history import Best, history
from harness.tuning.importance import importances
from harness.tuning.mission_differences import MissionDifference, mission_differences
from harness.tuning.result import StudyResult, trial_table
from harness.tuning.study_audit import audit_study
from harness.tuning.waterfall import Waterfall, players, waterfall
from navstack.errors import ParameterError

EXPLANATION = "explanation.json"
WATERFALL_MISSIONS = 40  # of the test: with five players 1200 deliveries beside those of the test
# Parts of the margin -> what they are called, and whether they are earned (1) or paid (-1).
COMPONENTS = {
    "revenue": ("Revenue", 1.0),
    **{key: (term.title.capitalize(), -1.0) for key, term in COUNTED_TERMS.items()},
}


@dataclass(frozen=True, slots=True)
class Explanation:
    """Everything that is told of a finished study."""

    history: tuple[Best, ...]
    importances: dict[str, float]  # shares, the largest first; empty where trials are too few
    waterfall: Waterfall | None
    # terms and margin, on the missions of the audit; empty where the margin is undefined
    components: dict[str, AuditEvidence]
    # training difference of the margin less the test's; None: no test or change
    optimism_usd_per_run: Interval | None
    partings: tuple[MissionDifference, ...]
    audit: Audit
    notes: tuple[str, ...] = ()  # what could not be told, and why
    # of the margin's difference, admitting a loss that has not happened yet
    unseen: Interval | None = None
    # missions of the test from which on, if they go on as they did, ``unseen`` lies above zero;
    # None: MOST_EPISODES do not prove the gain, or there is none
    proven_by: int | None = None
    # up to the fee, the most that any file can earn; admitting such a loss
    room_usd_per_run: Interval | None = None

    @property
    def document(self) -> Row:
        """The explanation as a JSON document."""
        return {"schema": 1, **as_json(self)}


def explain(
    study: StudyResult,
    evaluator: Evaluator,
    folder: Path,
    prices: Prices,
    conditions: Conditions,
    waterfall_missions: int = WATERFALL_MISSIONS,
    limits: ContactLimits | None = None,
) -> Explanation:
    """Explain a finished study, and write ``explanation.json`` into its folder.

    Args:
        study: the study.
        evaluator: drives the mixtures of old and new values for the waterfall; everything else is
            told from rows.
        folder: of the study.
        prices: the price file.
        conditions: that the world and its rules set.
        waterfall_missions: the first so many test missions (training missions where there is no
            test) are driven with every mixture; 0: no waterfall.
        limits: what contacts can come to there; None: as published.

    Raises:
        InputError: the folder cannot be written.
    """
    rows = study.judged_rows
    ranked = importances(trial_table(study.space, study.trials))
    who = players(study, list(ranked))
    missions = (study.test_missions if study.is_tested else study.train_missions)[
        :waterfall_missions
    ]
    steps: Waterfall | None = None
    note = ""
    try:
        steps = waterfall(study, evaluator, missions, who)
    except ParameterError as error:
        note = f"no waterfall: a mixture of old and new values cannot be driven: {error}"
    except OutOfTimeError:
        note = (
            "no waterfall: the budget ended before all mixtures of old and new values were driven"
        )
    pairs, reach = pair_up(*rows, prices, study.seed), reach_of_loss(prices, limits)
    found = Explanation(
        history=history(study, evaluator, prices),
        importances=ranked,
        waterfall=steps,
        components=components(pairs),
        optimism_usd_per_run=_optimism(study, prices)
        if study.is_tested and study.incumbent.values
        else None,
        partings=mission_differences(*rows),
        audit=audit_study(study, prices, conditions),
        notes=(note,) if note else (),
        unseen=_unseen(pairs, reach),
        proven_by=_proven_by(pairs, reach) if study.incumbent.values else None,
        room_usd_per_run=_room(pairs, reach),
    )
    write_document(folder / EXPLANATION, found.document)
    return found


def components(pairs: Pairs) -> dict[str, AuditEvidence]:
    """Each term of the margin of both, and the margin.

    Empty where the cargo is not modelled or no mission was finished by both.

    What is paid counts negative, so that terms add up to the margin. What meetings cost deliveries
    among nobody is a term of its own.
    """
    earned = pairs.margins(PUBLISHED)
    if earned is None:
        return {}
    force = pairs.prices.rolling_resistance_force
    costs = [
        running(deliveries(side.rows, force), pairs.prices)
        for side in (pairs.original, pairs.incumbent)
    ]
    found = {}
    for key, (title, sign) in COMPONENTS.items():
        before, after = (sign * np.broadcast_to(each.amounts[key], pairs.n) for each in costs)
        found[key] = pairs.compare(title, MONEY, before, after)
    before, after = (-meetings_losses(side.rows) for side in pairs.sides)
    if before.any() or after.any():
        found[MEETINGS_LOSS] = pairs.compare("People met", MONEY, before, after)
    found[MARGIN] = pairs.compare("Contribution margin", MONEY, *earned)
    return found


def _unseen(pairs: Pairs, reach: Reach) -> Interval | None:
    margins = pairs.margins(PUBLISHED)
    if margins is None:
        return None
    return difference_admitting_unseen(margins[1] - margins[0], reach, pairs.clusters, pairs.seed)


def _proven_by(pairs: Pairs, reach: Reach) -> int | None:
    margins = pairs.margins(PUBLISHED)
    if margins is None or float((margins[1] - margins[0]).sum()) <= 0.0:
        return None
    gains = margins[1] - margins[0]

    def is_proven(count: int) -> bool:
        repeated = np.resize(gains, count)
        found = difference_admitting_unseen(repeated, reach, np.arange(count), pairs.seed)
        return found.sign > 0

    too_few, enough = 0, max(pairs.n, fewest_missions())
    while not is_proven(enough):
        if enough >= MOST_EPISODES:
            return None
        too_few, enough = enough, min(2 * enough, MOST_EPISODES)
    while enough - too_few > max(1, enough // 20):
        middle = (enough + too_few) // 2
        if is_proven(middle):
            enough = middle
        else:
            too_few = middle
    return enough


def _room(pairs: Pairs, reach: Reach) -> Interval | None:
    margins = pairs.margins(PUBLISHED)
    if margins is None:
        return None
    earned = margin_admitting_unseen(margins[1], reach, pairs.clusters, pairs.seed)
    assert earned.value is not None and earned.low is not None and earned.high is not None
    fee = pairs.prices.delivery_fee.value
    return Interval(fee - earned.value, fee - earned.high, fee - earned.low, earned.n)


def _optimism(study: StudyResult, prices: Prices) -> Interval | None:
    """How much better the incumbent looks on the missions that chose it.

    Both bootstraps are independent.
    """
    draws, means = [], []
    for number, rows in enumerate((study.train_rows, study.judged_rows)):
        pairs = pair_up(*rows, prices, study.seed)
        margins = pairs.margins(PUBLISHED)
        if margins is None:
            return None
        gains = margins[1] - margins[0]
        rng = np.random.default_rng((study.seed, number))
        draws.append(resampled_means(gains[:, np.newaxis], rng, clusters=pairs.clusters)[:, 0])
        means.append(float(gains.mean()))
    return percentile_interval(means[0] - means[1], draws[0] - draws[1], len(study.test_missions))
