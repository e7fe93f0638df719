"""Nav2's numbers for the reasons why an action failed: nav2_msgs/action of Jazzy."""

from collections.abc import Mapping

Codes = Mapping[str, int]  # name of the reason -> Nav2's number

FOLLOW_PATH: Codes = {
    "UNKNOWN": 100,
    "INVALID_CONTROLLER": 101,
    "TF_ERROR": 102,
    "INVALID_PATH": 103,
    "PATIENCE_EXCEEDED": 104,
    "FAILED_TO_MAKE_PROGRESS": 105,
    "NO_VALID_CONTROL": 106,
    "CONTROLLER_TIMED_OUT": 107,
}
COMPUTE_PATH_TO_POSE: Codes = {
    "UNKNOWN": 200,
    "INVALID_PLANNER": 201,
    "TF_ERROR": 202,
    "START_OUTSIDE_MAP": 203,
    "GOAL_OUTSIDE_MAP": 204,
    "START_OCCUPIED": 205,
    "GOAL_OCCUPIED": 206,
    "TIMEOUT": 207,
    "NO_VALID_PATH": 208,
}
SPIN: Codes = {"UNKNOWN": 700, "TIMEOUT": 701, "TF_ERROR": 702, "COLLISION_AHEAD": 703}
BACK_UP: Codes = {"UNKNOWN": 710, "TIMEOUT": 711, "TF_ERROR": 712, "INVALID_INPUT": 713, "COLLISION_AHEAD": 714}
DRIVE_ON_HEADING: Codes = {
    "UNKNOWN": 720,
    "TIMEOUT": 721,
    "TF_ERROR": 722,
    "COLLISION_AHEAD": 723,
    "INVALID_INPUT": 724,
}
WAIT: Codes = {"UNKNOWN": 740}
