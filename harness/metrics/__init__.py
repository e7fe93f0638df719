"""What is measured of a delivery, and how a run sums it up."""

from harness.metrics.catalog import EPISODE_METRICS, RUN_METRICS
from harness.metrics.columns import EPISODE_COLUMNS, EVENT_COLUMNS, TIMING_COLUMNS, Row
from harness.metrics.contacts import (
    PRICED_PROPERTY,
    PROPERTY_IMPULSE,
    event_rows,
    fault,
    is_paid,
    property_contacts,
    was_counted,
)
from harness.metrics.decisions import DecisionLog, NoDecisionLog
from harness.metrics.delivery_log import JOULES_PER_KWH, DeliveryLog
from harness.metrics.replay_log import NoReplayLog, ReplayLog
from harness.metrics.summary import summarize, summarize_more

__all__ = [
    "EPISODE_COLUMNS",
    "EPISODE_METRICS",
    "EVENT_COLUMNS",
    "JOULES_PER_KWH",
    "PRICED_PROPERTY",
    "PROPERTY_IMPULSE",
    "RUN_METRICS",
    "TIMING_COLUMNS",
    "DecisionLog",
    "DeliveryLog",
    "NoDecisionLog",
    "NoReplayLog",
    "ReplayLog",
    "Row",
    "event_rows",
    "fault",
    "is_paid",
    "property_contacts",
    "summarize",
    "summarize_more",
    "was_counted",
]
