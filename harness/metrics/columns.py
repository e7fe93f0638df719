"""Columns of the run folder's tables, in order: name and Arrow type; the unit is in the name."""

from typing import Any

from harness.metrics.catalog import EPISODE_METRICS, FACTS

Row = dict[str, Any]

EPISODE_COLUMNS = {
    **{key: kind for key, (kind, _) in FACTS.items()},
    **{metric.key: metric.arrow_type for metric in EPISODE_METRICS},
}
EVENT_COLUMNS = {
    "stack": "string",
    "episode": "int64",
    "stamp_s": "double",
    **dict.fromkeys(("type", "partner", "kind"), "string"),
    "partner_id": "int64",
    **dict.fromkeys(("impulse_ns", "delta_v_mps", "peak_step_impulse_ns", "duration_s", "closing_speed_mps"), "double"),
    "impacts": "int64",
    **dict.fromkeys(("robot_speed_mps", "partner_speed_mps", "x_m", "y_m"), "double"),
    "fault": "string",
    "cost_usd": "double",
}
TIMING_COLUMNS = {
    "stack": "string",
    "episode": "int64",
    # setup: map, world and brain; wall: the drive
    **dict.fromkeys(("setup_s", "wall_s", "real_time_factor"), "double"),
    "planner_calls": "int64",
    **dict.fromkeys(("planner_median_ms", "planner_p95_ms", "planner_max_ms"), "double"),
    "controller_cycles": "int64",
    **dict.fromkeys(("controller_median_ms", "controller_p95_ms", "controller_max_ms"), "double"),
}
