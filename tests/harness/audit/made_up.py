"""Pairs and scores for tests of the auditor's checks, where every difference is sure."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from harness.audit.findings import AuditEvidence
from harness.audit.pairs import NEAR, PairedSide, Pairs
from harness.economics.accountings import EVENT, PERSON
from harness.economics.prices import load_prices
from harness.metrics.columns import Row
from harness.metrics.contacts import PRICED_PROPERTY
from harness.statistics.interval import Interval

PRICES = load_prices("costnav")
Changes = dict[int, Row]  # of deliveries, by number
Events = tuple[Row, ...] | None
DELIVERY: Row = {
    **dict.fromkeys((f"{kind}_contacts" for kind in PRICED_PROPERTY), 0),
    "outcome": "sla",
    "gave_up": "",
    "shortest_path_m": 200.0,
    "goal_distance_m": 0.0,
    "duration_s": 100.0,
    "average_speed_mps": 2.0,
    "pedestrian_contacts": 0,
    "pedestrian_injury_usd": 0.0,
    "soft_contacts": 0,
    NEAR: 1.0,
}


@dataclass(frozen=True, eq=False)
class Sure(Pairs):
    """Pairs whose differences all have the same p, 0 unless said otherwise."""

    p: float = 0.0

    def compare(
        self,
        what: str,
        unit: str,
        original: Any,
        incumbent: Any,
        clusters: object = None,
    ) -> AuditEvidence:
        before, after = float(original.mean()), float(incumbent.mean())
        return AuditEvidence(
            what,
            unit,
            before,
            after,
            Interval(after - before, None, None, len(original)),
            self.p,
        )


def pairs(
    n: int,
    before: Changes | None = None,
    after: Changes | None = None,
    touches: tuple[Events, Events] = ((), ()),
    lost: int = 0,
    p: float = 0.0,
) -> Sure:
    """Deliveries that differ from :data:`DELIVERY` as said, of which the second lost some."""
    sides = [
        PairedSide(
            tuple({**DELIVERY, "episode": i, **(changes or {}).get(i, {})} for i in range(n)),
            events,
        )
        for events, changes in zip(touches, (before, after), strict=True)
    ]
    abandoned = np.zeros(n), np.where(np.arange(n) < lost, 1.0, 0.0)
    return Sure(sides[0], sides[1], np.arange(n), abandoned, PRICES, 0, p)


def touch(
    impulse: float,
    step: float | None = None,
    kind: str = PERSON,
    number: int = 0,
    fault: str = "person_into_robot",
) -> Row:
    """A contact event; in one step half of its impulse, unless said otherwise."""
    event = {"type": EVENT, "kind": kind, "episode": number, "fault": fault}
    most = 0.5 * impulse if step is None else step
    return {**event, "impulse_ns": impulse, "peak_step_impulse_ns": most}


def score(value: float, p: float | None = 0.0) -> AuditEvidence:
    return AuditEvidence("margin", "USD/run", 0.0, value, Interval(value, None, None, 100), p)


LOWER = {"published": score(-1.0)}
