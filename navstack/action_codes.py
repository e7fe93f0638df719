"""Nav2's numbers for the reasons why an action failed: nav2_msgs/action of Jazzy."""

from collections.abc import Mapping

Codes = Mapping[str, int]  # name of the reason -> Nav2's number


def _from(first: int, names: str) -> Codes:
    """Names of one action, whose numbers follow each other."""
    return {name: first + i for i, name in enumerate(names.split())}


FOLLOW_PATH = _from(
    100,
    "UNKNOWN INVALID_CONTROLLER TF_ERROR INVALID_PATH PATIENCE_EXCEEDED "
    "FAILED_TO_MAKE_PROGRESS NO_VALID_CONTROL CONTROLLER_TIMED_OUT",
)
COMPUTE_PATH_TO_POSE = _from(
    200,
    "UNKNOWN INVALID_PLANNER TF_ERROR START_OUTSIDE_MAP GOAL_OUTSIDE_MAP START_OCCUPIED "
    "GOAL_OCCUPIED TIMEOUT NO_VALID_PATH",
)
SPIN = _from(700, "UNKNOWN TIMEOUT TF_ERROR COLLISION_AHEAD")
BACK_UP = _from(710, "UNKNOWN TIMEOUT TF_ERROR INVALID_INPUT COLLISION_AHEAD")
DRIVE_ON_HEADING = _from(720, "UNKNOWN TIMEOUT TF_ERROR COLLISION_AHEAD INVALID_INPUT")
WAIT = _from(740, "UNKNOWN")
REASONS = sorted({*FOLLOW_PATH, *COMPUTE_PATH_TO_POSE, *SPIN, *BACK_UP, *DRIVE_ON_HEADING, *WAIT})
