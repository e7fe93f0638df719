"""Every metric, declared once: columns, means, tables and docs/metrics.md are made from this.

A new metric of a delivery is one entry in one of the lists and one value in the episode's row.
"""

from harness.metrics.driving_metrics import LOCALIZATION, MOTION, NAVIGATION, TASK
from harness.metrics.encounter_metrics import CONTACTS, NO_CARGO, PEOPLE
from harness.metrics.metric import PAPER, Better, Metric

HIGHER, LOWER = Better.HIGHER, Better.LOWER

# Columns that are no metrics: which delivery it was, and how it ended in words. Name -> Arrow type, meaning.
FACTS: dict[str, tuple[str, str]] = {
    "stack": ("string", "name of the stack"),
    "map": ("string", "name of the map"),
    "stack_number": ("int64", "place of the stack on the command line"),
    "seed": ("int64", "of the run"),
    "episode": ("int64", "number of the delivery; stacks meet the same delivery under the same number"),
    "start_x_m": ("double", "start, map frame"),
    "start_y_m": ("double", "start, map frame"),
    "start_yaw_rad": ("double", "start, map frame"),
    "goal_x_m": ("double", "goal, map frame"),
    "goal_y_m": ("double", "goal, map frame"),
    "outcome": ("string", "sla, spoiled, timeout, physical_assistance; arrived: at the goal, cargo not simulated"),
    "reason": ("string", "what brought the outcome about"),
    "error": ("string", "why there is no result; everything measured is null then"),
    "navigator_status": ("string", "how the navigation itself ended: running, succeeded, failed"),
    "gave_up": ("string", "why the behavior tree ended without success; empty: it did not"),
    "navigator_error": ("string", "Nav2's name of the last failure to plan or follow that called for a recovery"),
    "navigator_error_code": ("int64", "Nav2's number of it"),
    "recovery_error": ("string", "Nav2's name of the last failure of a recovery"),
    "recovery_error_code": ("int64", "Nav2's number of it; 0: the behavior does not exist"),
}

GROUPS = {
    "Task": TASK,
    "Motion": MOTION,
    "Contacts": CONTACTS,
    "People": PEOPLE,
    "Localization": LOCALIZATION,
    "Navigation": NAVIGATION,
}
EPISODE_METRICS: tuple[Metric, ...] = tuple(metric for group in GROUPS.values() for metric in group)

# What only a run has, over its finished deliveries.
RUN_METRICS = (
    Metric(
        "sla",
        "SLA Compliance",
        HIGHER,
        "Share of deliveries that arrived with the food intact.",
        PAPER,
        undefined=NO_CARGO,
    ),
    Metric("spoiled", "Spoiled", LOWER, "Share that arrived with too many pieces lost.", PAPER, undefined=NO_CARGO),
    Metric("timeout", "Timeout", LOWER, "Share that ran out of time.", PAPER),
    Metric(
        "physical_assistance",
        "Physical Assistance",
        LOWER,
        "Share that ended with the robot tipped over or hit too hard.",
        PAPER,
    ),
    Metric(
        "avg_mechanical_power_kw",
        "Avg Mech. Power",
        LOWER,
        "Rolling resistance force of the prices file times the mean of the deliveries' speeds.",
        PAPER,
    ),
)
