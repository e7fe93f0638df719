"""Goal checkers, progress checkers and behaviors that run here."""

from collections.abc import Mapping

from navstack.params.checkers import (
    AxisGoalCheckerParams,
    PoseProgressCheckerParams,
    PositionGoalCheckerParams,
    SimpleGoalCheckerParams,
    SimpleProgressCheckerParams,
    StoppedGoalCheckerParams,
)
from navstack.params.registry.entry import AlgorithmEntry, Family, Params
from navstack.params.registry.nav2 import family
from navstack.params.servers import DriveParams


def _checkers(kind: str, params: Mapping[str, Params], **others: AlgorithmEntry) -> Family:
    """The goal or progress checkers, by class; their module is named after the kind.

    ``others`` stand in modules of their own.
    """
    here = {f"nav2_controller::{name}": entry for name, entry in others.items()}
    here |= {
        f"nav2_controller::{name}": AlgorithmEntry(
            make=f"navstack.control.{kind}:{name}", params=each
        )
        for name, each in params.items()
    }
    return family(f"{kind}s", here)


GOAL_CHECKERS = _checkers(
    "goal_checker",
    {
        "SimpleGoalChecker": SimpleGoalCheckerParams,
        "StoppedGoalChecker": StoppedGoalCheckerParams,
        "PositionGoalChecker": PositionGoalCheckerParams,
    },
    AxisGoalChecker=AlgorithmEntry(
        make="navstack.control.axis_goal_checker:AxisGoalChecker", params=AxisGoalCheckerParams
    ),
)
PROGRESS_CHECKERS = _checkers(
    "progress_checker",
    {
        "SimpleProgressChecker": SimpleProgressCheckerParams,
        "PoseProgressChecker": PoseProgressCheckerParams,
    },
)

BEHAVIORS = family(
    "behaviors",
    {
        "nav2_behaviors::Spin": AlgorithmEntry(make="navstack.behaviors.spin:Spin"),
        "nav2_behaviors::BackUp": AlgorithmEntry(
            make="navstack.behaviors.drive:BackUp", params=DriveParams
        ),
        "nav2_behaviors::DriveOnHeading": AlgorithmEntry(
            make="navstack.behaviors.drive:DriveOnHeading", params=DriveParams
        ),
        "nav2_behaviors::Wait": AlgorithmEntry(make="navstack.behaviors.wait:Wait"),
    },
)
