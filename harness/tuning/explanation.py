"""Why the tuned file pays: what mattered, what each change brings, where the money comes from, and whether to trust it.

The core of ``navbench tune`` calls :func:`explain` once the search and the test are over; ``harness.report.tuning``
prints what comes of it.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from harness.economics.cost_model import running
from harness.economics.prices import Prices
from harness.economics.valuation import deliveries
from harness.metrics import Row
from harness.statistics import Interval, percentile_interval, resampled_means
from harness.study.suite import write_document
from harness.tuning.audit import THRESHOLD, Audit, audit
from harness.tuning.audit_pairs import Pairs, pair_up
from harness.tuning.audit_scores import PUBLISHED, margins
from harness.tuning.evaluation import Evaluator
from harness.tuning.history import Best, history
from harness.tuning.importance import Importance, Interaction, importances, interactions
from harness.tuning.partings import Parting, partings
from harness.tuning.result import StudyResult
from harness.tuning.shapley import MOST_PLAYERS
from harness.tuning.trial_table import trial_table
from harness.tuning.waterfall import Step, Waterfall, players, set_back, waterfall
from navstack.errors import ParameterError
from navstack.types import FloatArray

EXPLANATION = "explanation.json"
WATERFALL_MISSIONS = 40  # of the test: with five players 1200 deliveries beside those of the test
MARGIN = "contribution_margin"
# Terms of the cost model -> what they are called, and whether they are earned (1) or paid (-1).
COMPONENTS = {
    "revenue": ("Revenue", 1.0),
    "service_compensation": ("Service compensation", -1.0),
    "pedestrian_safety": ("Pedestrian injuries", -1.0),
    "property_damage": ("Property damage", -1.0),
    "repair": ("Repair", -1.0),
    "electricity": ("Electricity", -1.0),
    MARGIN: ("Contribution margin", 1.0),
}


@dataclass(frozen=True, slots=True)
class Component:
    """One term of the margin before and after; what is paid counts negative, so that terms add up to the margin."""

    key: str  # of COMPONENTS
    original: float  # [USD/run]
    incumbent: float
    difference: Interval
    p: float  # of no difference; paired sign-flip test

    def as_json(self) -> Row:
        """The component as one JSON object."""
        return {
            "original": self.original,
            "incumbent": self.incumbent,
            "difference": self.difference.as_json(),
            "p": self.p,
        }


@dataclass(frozen=True, slots=True)
class Explanation:
    """Everything that is told of a finished study."""

    history: tuple[Best, ...]
    importances: tuple[Importance, ...]  # the largest first; empty where the trials are too few
    interactions: tuple[Interaction, ...]
    waterfall: Waterfall | None
    set_back: tuple[Step, ...]  # what each changed value brings beside all the others
    components: tuple[Component, ...]  # on the missions of the audit; empty where the margin is undefined
    optimism: (
        Interval | None
    )  # [USD/run] training difference of the margin less that of the test; None: no test, or no change
    partings: tuple[Parting, ...]
    audit: Audit
    notes: tuple[str, ...] = ()  # what could not be told, and why

    def as_json(self) -> Row:
        """The explanation as one JSON object."""
        return {
            "schema": 1,
            "history": [each.as_json() for each in self.history],
            "importances": [each.as_json() for each in self.importances],
            "interactions": [each.as_json() for each in self.interactions],
            "waterfall": None if self.waterfall is None else self.waterfall.as_json(),
            "set_back": [each.as_json() for each in self.set_back],
            "components": {each.key: each.as_json() for each in self.components},
            "optimism_usd_per_run": None if self.optimism is None else self.optimism.as_json(),
            "partings": [each.as_json() for each in self.partings],
            "audit": self.audit.as_json(),
            "notes": list(self.notes),
        }


def explain(
    study: StudyResult,
    evaluator: Evaluator,
    folder: Path,
    prices: Prices,
    threshold: float = THRESHOLD,
    waterfall_missions: int = WATERFALL_MISSIONS,
    most_players: int = MOST_PLAYERS,
) -> Explanation:
    """Explain a finished study, and write ``explanation.json`` into its folder.

    Args:
        study: the study.
        evaluator: drives the mixtures of old and new values for the waterfall; everything else is told from rows.
        folder: of the study.
        prices: the price file.
        threshold: [N s] from which the world counts a contact.
        waterfall_missions: the first so many test missions (training missions where there is no test) are driven with
            every mixture; 0: no waterfall.
        most_players: parameters that the waterfall tells apart; each one doubles its deliveries.

    Raises:
        InputError: the folder cannot be written.
    """
    table = trial_table(study.space, study.trials)
    ranked = importances(table)
    tested = len(study.test_rows) == 2
    rows = (study.test_rows[0], study.test_rows[1]) if tested else study.train_rows
    who = players(study, [each.name for each in ranked], most_players)
    missions = (study.test_missions if tested else study.train_missions)[:waterfall_missions]
    steps: Waterfall | None = None
    alone: tuple[Step, ...] = ()
    note = ""
    try:
        steps = waterfall(study, evaluator, missions, who)
        alone = set_back(study, evaluator, missions) if steps is not None else ()
    except ParameterError as error:
        note = f"no waterfall: a mixture of old and new values cannot be driven: {error}"
    found = Explanation(
        history=history(study, evaluator, prices),
        importances=ranked,
        interactions=interactions(table),
        waterfall=steps,
        set_back=alone,
        components=components(pair_up(*rows, prices, study.seed)),
        optimism=_optimism(study, prices) if tested and study.incumbent.values else None,
        partings=partings(*rows),
        audit=audit(study, prices, threshold),
        notes=(note,) if note else (),
    )
    write_document(folder / EXPLANATION, found.as_json())
    return found


def components(pairs: Pairs) -> tuple[Component, ...]:
    """Each term of the margin of both; empty where the cargo is not modelled or no mission was finished by both."""
    if not pairs.n:
        return ()
    force = pairs.prices.rolling_resistance_force
    costs = [running(deliveries(side.rows, force), pairs.prices) for side in (pairs.original, pairs.incumbent)]
    if any(each.contribution_margin is None for each in costs):
        return ()
    found = []
    for key, (_, sign) in COMPONENTS.items():
        before, after = (sign * np.broadcast_to(getattr(each, key), pairs.n) for each in costs)
        paired = pairs.compare_money(before, after)
        found.append(Component(key, float(before.mean()), float(after.mean()), paired.difference, paired.p))
    return tuple(found)


def _optimism(study: StudyResult, prices: Prices) -> Interval | None:
    """How much better the incumbent looks on the missions that chose it; both bootstraps are independent."""
    draws, means = [], []
    for number, (first, second) in enumerate((study.train_rows, study.test_rows)):
        pairs = pair_up(first, second, prices, study.seed)
        gains = _gains(pairs)
        if gains is None:
            return None
        rng = np.random.default_rng((study.seed, number))
        draws.append(resampled_means(gains[:, np.newaxis], rng, clusters=pairs.clusters)[:, 0])
        means.append(float(gains.mean()))
    return percentile_interval(means[0] - means[1], draws[0] - draws[1], len(study.test_missions))


def _gains(pairs: Pairs) -> FloatArray | None:
    """Margin [USD] of the incumbent less that of the original, mission by mission."""
    if not pairs.n:
        return None
    before, after = (margins(side, PUBLISHED, pairs) for side in (pairs.original, pairs.incumbent))
    return None if before is None or after is None else after - before
