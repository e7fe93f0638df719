"""Columns of the run folder's tables, in order: name and Arrow type; the unit is in the name."""

from typing import Any

from harness.metrics.catalog import CATALOG, EPISODE_METRICS, FACTS

Row = dict[str, Any]

EPISODE_COLUMNS = {
    **{key: kind for key, (kind, _) in FACTS.items()},
    **{metric.key: metric.arrow_type for metric in EPISODE_METRICS},
}
# of a leg of a mission on a district: a delivery's row, when it began, and where the robot ended
LEG_COLUMNS = {
    "leg": "int64",
    "begin_s": "double",
    "end_x_m": "double",
    "end_y_m": "double",
    **EPISODE_COLUMNS,
}
EVENT_COLUMNS: dict[str, str] = CATALOG["events"]
TIMING_COLUMNS: dict[str, str] = CATALOG["timings"]
