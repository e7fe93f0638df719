"""The table of ``--record decisions``.

One row per control or behavior cycle, and why it came out as it did.
"""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from harness.metrics.columns import Row

if TYPE_CHECKING:
    from harness.task.brain import Brain
    from navstack.navigator import TickRecord

# Column -> Arrow type, and what of a tick stands in it.
_OF_TICK: "dict[str, tuple[str, Callable[[TickRecord], Any]]]" = {
    "stamp_s": ("double", lambda tick: tick.decision.stamp),
    "decided_by": ("string", lambda tick: tick.decision.decided_by),
    "wanted_linear_x_mps": ("double", lambda tick: tick.wanted.linear_x),
    "wanted_angular_z_radps": ("double", lambda tick: tick.wanted.angular_z),
    "command_linear_x_mps": ("double", lambda tick: tick.command.linear_x),
    "command_angular_z_radps": ("double", lambda tick: tick.command.angular_z),
    "monitor_action": ("string", lambda tick: tick.monitor.action),
    "monitor_polygon": ("string", lambda tick: tick.monitor.polygon),
    "believed_x_m": ("double", lambda tick: tick.belief.pose.x),
    "believed_y_m": ("double", lambda tick: tick.belief.pose.y),
    "believed_yaw_rad": ("double", lambda tick: tick.belief.pose.yaw),
    "health": ("string", lambda tick: tick.belief.health.value),
    "samples": ("int64", lambda tick: tick.decision.samples),
    "rejected": ("int64", lambda tick: tick.decision.rejected),
    "total_score": ("double", lambda tick: tick.decision.total),
    "status": ("string", lambda tick: tick.decision.status),
}
DECISION_COLUMNS = {column: kind for column, (kind, _) in _OF_TICK.items()}
# as <critic>_<suffix>, per critic
CRITIC_COLUMNS = {"raw": "double", "weighted": "double", "rejected": "int64"}


class DecisionLog:
    """Keeps every decision of a delivery."""

    def __init__(self) -> None:
        self.rows: list[Row] = []
        self._critics: dict[str, None] = {}  # in the order of their first appearance

    def record(self, brain: "Brain") -> None:
        """Take in what the brain decided in its last tick, if anything."""
        tick = brain.decision
        if tick is None:
            return
        row: Row = {column: read(tick) for column, (_, read) in _OF_TICK.items()}
        for score in tick.decision.scores:
            self._critics[score.critic] = None
            name = column_prefix(score.critic)
            row |= {
                f"{name}_raw": score.raw,
                f"{name}_weighted": score.weighted,
                f"{name}_rejected": score.rejections,
            }
        self.rows.append(row)

    @property
    def columns(self) -> dict[str, str]:
        """The table's columns: those of every table, and those of the critics that spoke."""
        critics = {
            f"{column_prefix(critic)}_{suffix}": kind
            for critic in self._critics
            for suffix, kind in CRITIC_COLUMNS.items()
        }
        return {**DECISION_COLUMNS, **critics}


class NoDecisionLog(DecisionLog):
    """Asks for nothing and keeps nothing."""

    def record(self, brain: "Brain") -> None:
        """See the base class."""


def column_prefix(critic: str) -> str:
    """A critic's name as the beginning of a column's: without blanks."""
    return critic.replace(" ", "_")
