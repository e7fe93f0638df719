"""The missions on which two files' margins differ most, and how to see them again."""

import shlex
from collections.abc import Sequence
from dataclasses import dataclass

from harness.metrics.columns import Row
from harness.tuning.evaluation import MARGIN

SHOWN = 3
COMPARED_COLUMNS = (
    "outcome",
    "reason",
    "gave_up",
    "duration_s",
    "distance_m",
    "average_speed_mps",
    "goal_distance_m",
    "pedestrian_contacts",
    "soft_contacts",
    "collision_impulse_ns",
    "pedestrian_injury_usd",
    "pieces_lost",
    *("recoveries", "min_pedestrian_distance_m", MARGIN),
)  # columns that tell what happened


@dataclass(frozen=True, slots=True)
class MissionDifference:
    """One mission on which the two files earned very different sums."""

    seed: int
    episode: int
    start: tuple[float, float, float]  # x [m], y [m], yaw [rad]
    goal: tuple[float, float]  # x [m], y [m]
    difference_usd: float  # margin of the incumbent less that of the original
    original: Row  # of COMPARED_COLUMNS
    incumbent: Row

    def replay(self, command: Sequence[str]) -> str:
        """The line that drives this delivery again, for ``command`` without seed and number."""
        return shlex.join(
            [*command, "--seed", str(self.seed), "--only", str(self.episode), "--record", "full"]
        )


def mission_differences(
    original: Sequence[Row], incumbent: Sequence[Row]
) -> tuple[MissionDifference, ...]:
    """The :data:`SHOWN` missions with the largest differences of the margin, the largest first.

    Fewer where the margins are alike to a cent.

    Args:
        original: rows of finished and unfinished deliveries, one mission after the other.
        incumbent: of the same missions.
    """
    differences = []
    for before, after in zip(original, incumbent, strict=True):
        if not (_has_margin(before) and _has_margin(after)):
            continue
        if abs(after[MARGIN] - before[MARGIN]) >= 0.01:
            differences.append(_difference(before, after))
    differences.sort(key=lambda each: (-abs(each.difference_usd), each.seed, each.episode))
    return tuple(differences[:SHOWN])


def _has_margin(row: Row) -> bool:
    """Whether a delivery finished and has a margin."""
    return row.get("error") is None and row.get(MARGIN) is not None


def _difference(original: Row, incumbent: Row) -> MissionDifference:
    start = (original["start_x_m"], original["start_y_m"], original["start_yaw_rad"])
    goal = (original["goal_x_m"], original["goal_y_m"])
    old, new = ({key: row.get(key) for key in COMPARED_COLUMNS} for row in (original, incumbent))
    difference = float(incumbent[MARGIN] - original[MARGIN])
    return MissionDifference(
        original["seed"],
        original["episode"],
        start,
        goal,
        difference,
        old,
        new,
    )
