"""Explanations as data: moments with their words and instants, and what a rewind had saved."""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any

from harness.explain.activities import Activity
from harness.explain.decision_words import alternatives_at
from harness.explain.evidence import Evidence
from harness.explain.moments import COMPONENTS, Moment
from harness.explain.rewind import Rewound
from harness.explain.seconds import Seconds
from harness.explain.words import paragraph
from harness.metrics.columns import Row
from navstack.control.decision import Alternative

Json = dict[str, Any]


@dataclasses.dataclass(frozen=True, slots=True)
class Explained:
    """One moment told."""

    seconds: Seconds
    words: str
    before: Moment | None  # the moment before it; None: it is the first


def explained(evidence: Evidence, seconds: Sequence[Seconds]) -> list[Explained]:
    """Moments with their words, in order of time."""
    before = [None, *(each.moment for each in seconds)]
    return [
        Explained(each, paragraph(evidence, each, last), last)
        for each, last in zip(seconds, before, strict=False)
    ]


@dataclasses.dataclass(frozen=True, slots=True)
class Saving:
    """What a delivery came to as it was, and rewound."""

    rewound: Rewound
    moment: Moment  # that was rewound from
    before: float  # [s] by which it was
    stored: Row
    costs: Mapping[str, float | None]  # [USD] as it was, by COMPONENTS
    new_costs: Mapping[str, float | None]  # [USD] rewound

    def difference(self, component: str) -> float | None:
        """Rewound less as it was [USD]; None: the cargo is not modelled."""
        old, new = self.costs[component], self.new_costs[component]
        if old is None or new is None:
            return None
        return new - old


def explanation_document(
    evidence: Evidence,
    told: Sequence[Explained],
    saving: Saving | None,
    activities: Sequence[Activity],
) -> Json:
    """The JSON document of ``navbench explain``."""
    row = evidence.row
    return {
        "schema": 1,
        "stack": row["stack"],
        "map": row["map"],
        "seed": row["seed"],
        "episode": row["episode"],
        "outcome": row["outcome"],
        "reason": row["reason"],
        "source": evidence.source,
        "navigator_history": row.get("navigator_history") or "",
        "activities": [each.document() for each in activities],
        "events": [_event(each) for each in told],
        "rewind": None if saving is None else _rewind(saving),
    }


def instant(seconds: Seconds, place: int) -> Json:
    """One instant before a moment, ``place`` in the arrays; units in the names.

    Null where there is nothing.
    """
    at = float(seconds.at[place])
    decision = seconds.decision_at(at) or {}
    values = {
        "time_to_event_s": at,
        "speed_mps": seconds.speed[place],
        "command_linear_x_mps": seconds.command[place, 0],
        "command_angular_z_radps": seconds.command[place, 1],
        **{
            key: decision.get(key)
            for key in ("decided_by", "samples", "rejected", "total_score", "status")
        },
        "monitor_action": decision.get("monitor_action"),
        "position_error_m": seconds.position_error[place],
        "heading_error_rad": seconds.heading_error[place],
        "person": seconds.person,
        "distance_m": seconds.distance[place],
        "closing_speed_mps": seconds.closing[place],
        "track_error_m": seconds.track_error[place],
        "acceleration_mps2": seconds.shaking[place],
        "pieces_lost": int(seconds.pieces_lost[place]),
    }
    return {key: _number(value) for key, value in values.items()}


def _event(told: Explained) -> Json:
    seconds, moment = told.seconds, told.seconds.moment
    telling = seconds.telling
    return {
        "number": moment.number,
        "kind": moment.kind,
        "stamp_s": moment.stamp,
        "cost_usd": moment.cost,
        "contact": moment.event,
        "words": told.words,
        "instants": [instant(seconds, place) for place in seconds.instants()],
        "decision": telling,
        "alternatives": None
        if seconds.weighed is None or telling is None
        else [_alternative(each) for each in alternatives_at(seconds, telling).values()],
    }


def _alternative(other: Alternative) -> Json:
    return {
        "kind": other.kind,
        "linear_x_mps": other.command.linear_x,
        "angular_z_radps": other.command.angular_z,
        "total_score": other.total,
        "weighted": {score.critic: score.weighted for score in other.scores},
    }


def _rewind(saving: Saving) -> Json:
    rewound, row = saving.rewound, saving.rewound.delivery.row
    take_over = rewound.take_over
    return {
        "event": saving.moment.number,
        "before_s": saving.before,
        "changes": [
            {"path": change.place.path, "from": change.place.value, "to": change.value}
            for change in rewound.changes
        ],
        "take_over": {
            "stamp_s": take_over.stamp,
            "command_before": [take_over.before.linear_x, take_over.before.angular_z],
            "command_after": [take_over.after.linear_x, take_over.after.angular_z],
            "status": take_over.status.value,
            "recoveries": take_over.recoveries,
        },
        "outcome": {"stored": saving.stored["outcome"], "rewound": row["outcome"]},
        "duration_s": {"stored": saving.stored["duration_s"], "rewound": row["duration_s"]},
        "costs_usd": {
            name: {
                "stored": saving.costs[name],
                "rewound": saving.new_costs[name],
                "difference": saving.difference(name),
            }
            for name in COMPONENTS
        },
        "n": 1,
    }


def _number(value: Any) -> Any:
    """A number of the JSON document; null in place of what is no number."""
    if isinstance(value, float):  # numpy's, too
        if math.isfinite(value):
            return float(value)
        return None
    return value
