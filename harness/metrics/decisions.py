"""The table of ``--record decisions``: one row per control or behavior cycle, and why it came out as it did."""

from typing import TYPE_CHECKING, Protocol

from harness.metrics.columns import Row

if TYPE_CHECKING:
    from navstack.navigator import TickRecord

DECISION_COLUMNS = {
    "stamp_s": "double",
    "decided_by": "string",
    **dict.fromkeys(("wanted_linear_x_mps", "wanted_angular_z_radps"), "double"),
    **dict.fromkeys(("command_linear_x_mps", "command_angular_z_radps"), "double"),
    **dict.fromkeys(("monitor_action", "monitor_polygon"), "string"),
    **dict.fromkeys(("believed_x_m", "believed_y_m", "believed_yaw_rad"), "double"),
    "health": "string",
    **dict.fromkeys(("samples", "rejected"), "int64"),
    "total_score": "double",
    "status": "string",
}
CRITIC_COLUMNS = {"raw": "double", "weighted": "double", "rejected": "int64"}  # as <critic>_<suffix>, per critic


class Explains(Protocol):
    """A brain that tells how it decided."""

    @property
    def decision(self) -> "TickRecord | None":
        """How the last tick was decided; None: nothing was."""


class DecisionLog:
    """Keeps every decision of a delivery."""

    def __init__(self) -> None:
        self.rows: list[Row] = []
        self._critics: dict[str, None] = {}  # in the order of their first appearance

    def record(self, brain: Explains) -> None:
        """Take in what the brain decided in its last tick, if anything."""
        tick = brain.decision
        if tick is None:
            return
        decision, believed = tick.decision, tick.belief.pose
        row: Row = {
            "stamp_s": decision.stamp,
            "decided_by": decision.decided_by,
            "wanted_linear_x_mps": tick.wanted.linear_x,
            "wanted_angular_z_radps": tick.wanted.angular_z,
            "command_linear_x_mps": tick.command.linear_x,
            "command_angular_z_radps": tick.command.angular_z,
            "monitor_action": tick.monitor.action,
            "monitor_polygon": tick.monitor.polygon,
            "believed_x_m": believed.x,
            "believed_y_m": believed.y,
            "believed_yaw_rad": believed.yaw,
            "health": tick.belief.health.value,
            "samples": decision.samples,
            "rejected": decision.rejected,
            "total_score": decision.total,
            "status": decision.status,
        }
        for score in decision.scores:
            self._critics[score.critic] = None
            name = column_prefix(score.critic)
            row |= {f"{name}_raw": score.raw, f"{name}_weighted": score.weighted, f"{name}_rejected": score.rejections}
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

    def record(self, brain: Explains) -> None:
        """See the base class."""


def column_prefix(critic: str) -> str:
    """A critic's name as the beginning of a column's: without blanks."""
    return critic.replace(" ", "_")
