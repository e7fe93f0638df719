"""Goal checkers, progress checkers and behaviors that run here."""

from navstack.params.behaviors import DriveParams
from navstack.params.checkers import (
    PoseProgressCheckerParams,
    PositionGoalCheckerParams,
    SimpleGoalCheckerParams,
    SimpleProgressCheckerParams,
    StoppedGoalCheckerParams,
)
from navstack.params.registry.entry import Entry
from navstack.params.registry.nav2 import family

_GOAL_CHECKERS = {
    "SimpleGoalChecker": SimpleGoalCheckerParams,
    "StoppedGoalChecker": StoppedGoalCheckerParams,
    "PositionGoalChecker": PositionGoalCheckerParams,
    "SymmetricGoalChecker": SimpleGoalCheckerParams,
}
GOAL_CHECKERS = family(
    "goal_checkers",
    {
        f"nav2_controller::{name}": Entry(make=f"navstack.control.goal_checker:{name}", params=params)
        for name, params in _GOAL_CHECKERS.items()
    },
)

_PROGRESS_CHECKERS = {
    "SimpleProgressChecker": SimpleProgressCheckerParams,
    "PoseProgressChecker": PoseProgressCheckerParams,
}
PROGRESS_CHECKERS = family(
    "progress_checkers",
    {
        f"nav2_controller::{name}": Entry(make=f"navstack.control.progress_checker:{name}", params=params)
        for name, params in _PROGRESS_CHECKERS.items()
    },
)

BEHAVIORS = family(
    "behaviors",
    {
        "nav2_behaviors::Spin": Entry(make="navstack.behaviors.spin:Spin"),
        "nav2_behaviors::BackUp": Entry(make="navstack.behaviors.drive:BackUp", params=DriveParams),
        "nav2_behaviors::DriveOnHeading": Entry(make="navstack.behaviors.drive:DriveOnHeading", params=DriveParams),
        "nav2_behaviors::Wait": Entry(make="navstack.behaviors.wait:Wait"),
    },
)
