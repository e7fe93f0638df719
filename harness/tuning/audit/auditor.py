"""The auditor: is the optimum better driving, or a gap of the cost model?

The incumbent is held against the original on the same missions, those that the tuner never saw
where there are any. Twelve checks look for what the cost model fails to price; each is a test of
its own, and together they raise a false alarm in at most 1 of 50 studies whose incumbent exploits
nothing (Bonferroni).
"""

from dataclasses import dataclass

from harness.economics.prices import Prices
from harness.metrics.columns import Row
from harness.storage.documents import as_json
from harness.tuning.audit.checks import another_accounting, early_ends, freezing, pushing, timeouts
from harness.tuning.audit.findings import (
    FAMILY_LEVEL,
    GAPS,
    LEAST_PAIRS,
    LEVEL,
    AuditEvidence,
    Check,
)
from harness.tuning.audit.hidden import dodging, harm, moved_fault, nearness, property_touches
from harness.tuning.audit.pairs import pair_up
from harness.tuning.audit.search import computing, edges
from harness.tuning.result import StudyResult

OF_PARAMETERS = ("compute", "edge")  # checks that look at the search, not at deliveries
# [N s] in one physics step with one partner, from which a contact counts; published
THRESHOLD = 50.0


@dataclass(frozen=True, slots=True)
class Audit:
    """What the auditor found."""

    checks: tuple[Check, ...]
    scores: dict[str, AuditEvidence]  # margin under every accounting; empty where it is undefined
    missions: int  # that both finished
    unseen: bool  # these are test missions

    @property
    def flagged(self) -> tuple[Check, ...]:
        """The checks that raise an alarm."""
        return tuple(check for check in self.checks if check.is_flagged)

    def as_json(self) -> Row:
        """The audit as one JSON object."""
        return {
            "flagged": [check.key for check in self.flagged],
            "family_level": FAMILY_LEVEL,
            "level_of_each_test": LEVEL,
            "missions": self.missions,
            "unseen": self.unseen,
            "checks": as_json(self.checks),
            "accountings": as_json(self.scores),
        }


def audit(study: StudyResult, prices: Prices, threshold: float = THRESHOLD) -> Audit:
    """Hold the incumbent against the original.

    Args:
        study: with test rows, or with training rows alone; rows with their events where single
            contacts are to be told.
        prices: the price file.
        threshold: [N s] from which the world counts a contact.
    """
    pairs = pair_up(*study.judged_rows, prices, study.seed)
    scores = pairs.scores
    absent = _unexaminable(study, pairs.n)
    if absent:
        checks = tuple(
            Check(key, False, absent, is_examined=False) for key in GAPS if key not in OF_PARAMETERS
        )
    else:
        checks = (
            pushing(pairs, scores, threshold),
            another_accounting(scores),
            timeouts(pairs, scores),
            early_ends(pairs, scores),
            freezing(pairs, scores),
            harm(pairs, scores),
            property_touches(pairs, scores),
            nearness(pairs, scores),
            dodging(pairs, scores),
            moved_fault(pairs, scores, any("shared" in name for name in study.objectives)),
        )
    return Audit((*checks, computing(study), edges(study)), scores, pairs.n, study.is_tested)


def _unexaminable(study: StudyResult, pairs: int) -> str:
    """Why the checks on deliveries cannot find anything; empty: they can."""
    if not study.incumbent.values:
        return "the file is unchanged"
    if not pairs:
        return "no mission was finished by both"
    if pairs < LEAST_PAIRS:
        return f"{pairs} missions are too few, give at least {LEAST_PAIRS}"
    return ""
