"""The auditor: does the second of two stacks drive better, or does it exploit the cost model?

Both drive the same missions. Each check looks for something that the cost model does not price, and
flags what is both large and significant. Together they raise a false alarm in at most 1 of 50
comparisons (Bonferroni).
"""

from dataclasses import dataclass

from harness.audit.checks import another_accounting, early_ends, freezing, pushing, timeouts
from harness.audit.findings import (
    FAMILY_LEVEL,
    GAPS,
    LEAST_PAIRS,
    LEVEL,
    AuditEvidence,
    Check,
)
from harness.audit.hidden import dodging, harm, moved_fault, nearness, property_touches
from harness.audit.manners import (
    conflicts,
    crumbling,
    delaying,
    jerking,
    knowing,
    leaving,
)
from harness.audit.pairs import Conditions, Pairs
from harness.metrics.columns import Row
from harness.storage.documents import as_json

OF_PARAMETERS = ("compute", "edge")  # checks that look at a search, not at deliveries


@dataclass(frozen=True, slots=True)
class Audit:
    """What the auditor found."""

    checks: tuple[Check, ...]
    scores: dict[str, AuditEvidence]  # margin under every accounting; empty where it is undefined
    missions: int  # that both finished

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
            "checks": as_json(self.checks),
            "accountings": as_json(self.scores),
        }


def audit(pairs: Pairs, conditions: Conditions, by_fault: bool = False) -> Audit:
    """Hold the second stack against the first.

    Args:
        pairs: their deliveries; with events where single contacts are to be told.
        conditions: what the deliveries were driven under.
        by_fault: whether the second was tuned for a margin by fault.
    """
    scores = pairs.scores
    absent = ""
    if not pairs.n:
        absent = "no mission was finished by both"
    elif pairs.n < LEAST_PAIRS:
        absent = f"{pairs.n} of the {LEAST_PAIRS} missions that it needs"
    if absent:
        return Audit(unexamined(absent), scores, pairs.n)
    checks = (
        pushing(pairs, scores, conditions.threshold),
        another_accounting(scores),
        timeouts(pairs, scores),
        early_ends(pairs, scores),
        freezing(pairs, scores),
        harm(pairs, scores),
        property_touches(pairs, scores),
        nearness(pairs, scores),
        dodging(pairs, scores),
        moved_fault(pairs, scores, by_fault),
        delaying(pairs, scores),
        jerking(pairs, scores),
        conflicts(pairs, scores),
        crumbling(pairs, scores, conditions.spoiled_fraction),
        knowing(pairs, scores, conditions),
        leaving(pairs, scores),
    )
    return Audit(checks, scores, pairs.n)


def unexamined(why: str) -> tuple[Check, ...]:
    """All checks on deliveries, where none can find anything."""
    return tuple(
        Check(key, False, why, is_examined=False) for key in GAPS if key not in OF_PARAMETERS
    )
