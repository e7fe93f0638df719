"""What is measured of a delivery, and how a run sums it up with the paper's names."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from harness.truth import Contact, CountedContact, Partner, Truth
from navstack.types import Belief, FloatArray, Twist2D

PROPERTY_IMPULSE = 100.0  # [N s] from which a contact with property is paid for (published)
PRICED_PROPERTY = ("mailbox", "trash_bin", "building_glass", "bollard", "plant", "fence")
TRACE_PERIOD = 0.1  # [s] between the rows of a recorded trajectory
TRACE_COLUMNS = (
    *("stamp_s", "x_m", "y_m", "yaw_rad", "linear_x_mps", "angular_z_radps"),
    *("believed_x_m", "believed_y_m", "believed_yaw_rad", "command_linear_x_mps", "command_angular_z_radps"),
)

Row = dict[str, Any]

# Columns of the run folder's tables, in order; the unit is in the name.
EPISODE_COLUMNS = {
    **dict.fromkeys(("stack", "map"), "string"),
    **dict.fromkeys(("stack_number", "seed", "episode"), "int64"),
    **dict.fromkeys(("start_x_m", "start_y_m", "start_yaw_rad", "goal_x_m", "goal_y_m"), "double"),
    "shortest_path_m": "double",
    **dict.fromkeys(("outcome", "reason", "error", "navigator_status", "navigator_error"), "string"),
    **dict.fromkeys(("duration_s", "distance_m", "average_speed_mps", "goal_distance_m"), "double"),
    **dict.fromkeys(("collision_impulse_ns", "collision_delta_v_mps", "pedestrian_injury_usd"), "double"),
    "pedestrian_contacts": "int64",
    **{f"{kind}_contacts": "int64" for kind in PRICED_PROPERTY},
    "soft_contacts": "int64",
    "max_tilt_rad": "double",
    **dict.fromkeys(("pieces_at_start", "pieces_lost"), "int64"),
    **dict.fromkeys(("localization_error_mean_m", "localization_error_max_m"), "double"),
    **dict.fromkeys(("plans", "failed_plans", "failed_controls", "recoveries"), "int64"),
}
EVENT_COLUMNS = {
    "stack": "string",
    "episode": "int64",
    "stamp_s": "double",
    **dict.fromkeys(("type", "partner", "kind"), "string"),
    "partner_id": "int64",
    **dict.fromkeys(("impulse_ns", "peak_step_impulse_ns", "duration_s", "closing_speed_mps"), "double"),
    **dict.fromkeys(("robot_speed_mps", "partner_speed_mps", "x_m", "y_m"), "double"),
    "fault": "string",
    "cost_usd": "double",
}
TIMING_COLUMNS = {
    "stack": "string",
    "episode": "int64",
    **dict.fromkeys(
        ("setup_s", "wall_s", "real_time_factor"), "double"
    ),  # setup: map, world and brain; wall: the drive
}


@dataclass(slots=True)
class DeliveryLog:
    """Watches one delivery, tick by tick."""

    _before: Truth  # when the brain last saw the world
    kinds: frozenset[str]  # of obstacles in this world; contacts with others are undefined, not 0
    keep_trace: bool = False
    _rows: list[tuple[float, ...]] = field(default_factory=list)  # of TRACE_COLUMNS
    _crowd: list[FloatArray] = field(default_factory=list)  # (n, 2) positions of people at the same stamps
    _distance: float = 0.0  # [m]
    _max_tilt: float = 0.0  # [rad]
    _error_sum: float = 0.0  # [m]
    _error_max: float = 0.0  # [m]
    _records: int = 0

    def record(self, truth: Truth, belief: Belief | None, command: Twist2D) -> None:
        """Take in the state after a step, and what was believed (None: nobody localizes) and commanded before it."""
        before = self._before.pose
        self._before = truth
        self._distance += math.hypot(truth.pose.x - before.x, truth.pose.y - before.y)
        self._max_tilt = max(self._max_tilt, truth.tilt)
        if belief is not None:
            error = math.hypot(belief.pose.x - before.x, belief.pose.y - before.y)
            self._error_sum += error
            self._error_max = max(self._error_max, error)
            self._records += 1
        if self.keep_trace and truth.stamp >= len(self._rows) * TRACE_PERIOD - 1e-6:
            self._trace(truth, belief or Belief(before), command)

    def _trace(self, truth: Truth, belief: Belief, command: Twist2D) -> None:
        pose, believed = truth.pose, belief.pose
        self._rows.append(
            (
                truth.stamp,
                *(pose.x, pose.y, pose.yaw, truth.twist.linear_x, truth.twist.angular_z),
                *(believed.x, believed.y, believed.yaw, command.linear_x, command.angular_z),
            )
        )
        self._crowd.append(truth.pedestrians[:, :2].copy())

    def recording(self) -> dict[str, Any]:
        """The trajectory as arrays: ``trace`` (T, 11) and ``crowd`` (T, n, 2)."""
        return {"trace": np.array(self._rows), "trace_columns": np.array(TRACE_COLUMNS), "crowd": np.array(self._crowd)}

    def measurements(self, truth: Truth) -> Row:
        """The measured part of the episode's row; keys carry their units."""
        pedestrian = [c.impulse for c in truth.counted_contacts if c.partner is Partner.PEDESTRIAN]
        return {
            "duration_s": truth.stamp,
            "distance_m": self._distance,
            "average_speed_mps": self._distance / truth.stamp if truth.stamp else 0.0,
            "collision_impulse_ns": float(sum(c.impulse for c in truth.counted_contacts)),
            "pedestrian_contacts": len(pedestrian),
            **property_contacts(truth.counted_contacts, self.kinds),
            "soft_contacts": _soft_contacts(truth),
            "max_tilt_rad": self._max_tilt,
            "pieces_at_start": truth.cargo.pieces_at_start if truth.cargo else None,
            "pieces_lost": truth.cargo.pieces_outside if truth.cargo else None,
            "localization_error_mean_m": self._error_sum / self._records if self._records else None,
            "localization_error_max_m": self._error_max if self._records else None,
        }


def is_paid(contact: CountedContact) -> bool:
    """Whether a counted contact costs money: with a person, or hard enough with priced property."""
    if contact.partner is Partner.PEDESTRIAN:
        return True
    return contact.kind in PRICED_PROPERTY and contact.impulse >= PROPERTY_IMPULSE


def property_contacts(contacts: Sequence[CountedContact], kinds: frozenset[str]) -> dict[str, int | None]:
    """Paid contacts per priced kind of property under ``<kind>_contacts``; None: no such thing in this world."""
    paid = [c.kind for c in contacts if c.partner is Partner.PROPERTY and is_paid(c)]
    return {f"{kind}_contacts": paid.count(kind) if kind in kinds else None for kind in PRICED_PROPERTY}


def _soft_contacts(truth: Truth) -> int:
    """Contact events too soft for the published rule to count."""
    counted = [(c.stamp, c.partner_id, c.partner) for c in truth.counted_contacts]

    def was_counted(event: Contact) -> bool:
        end = event.stamp + event.duration + 1e-6
        return any(
            partner is event.partner and number == event.partner_id and event.stamp - 1e-6 <= stamp <= end
            for stamp, number, partner in counted
        )

    return sum(not was_counted(event) for event in truth.contacts)


def event_rows(truth: Truth, costs: Sequence[float]) -> list[Row]:
    """The events of an episode: counted contacts as published with their ``costs`` [USD], and contact events.

    Contact events show the same impacts whole and those too soft to count; they carry no cost of their own.
    """
    rows: list[Row] = [
        {
            "type": "counted_contact",
            "stamp_s": c.stamp,
            "partner": c.partner.value,
            "kind": c.kind,
            "partner_id": c.partner_id,
            "impulse_ns": c.impulse,
            "closing_speed_mps": c.robot_speed + c.partner_speed,
            "robot_speed_mps": c.robot_speed,
            "partner_speed_mps": c.partner_speed,
            "x_m": c.x,
            "y_m": c.y,
            "fault": fault(c),
            "cost_usd": cost,
        }
        for c, cost in zip(truth.counted_contacts, costs, strict=True)
    ]
    rows += [
        {
            "type": "contact_event",
            "stamp_s": c.stamp,
            "partner": c.partner.value,
            "kind": c.kind,
            "partner_id": c.partner_id,
            "impulse_ns": c.impulse,
            "peak_step_impulse_ns": c.peak_step_impulse,
            "duration_s": c.duration,
            "closing_speed_mps": c.closing_speed,
            "robot_speed_mps": c.robot_speed,
            "partner_speed_mps": c.partner_speed,
            "x_m": c.x,
            "y_m": c.y,
            "fault": fault(c),
        }
        for c in truth.contacts
    ]
    return sorted(rows, key=lambda row: (row["stamp_s"], row["type"], row["partner_id"]))


def fault(contact: Contact | CountedContact, standing: float = 0.05) -> str:
    """Who moved into whom; a robot slower than ``standing`` [m/s] along the normal was walked into."""
    if contact.partner is Partner.PROPERTY:
        return "robot_into_property"
    if abs(contact.robot_speed) < standing:
        return "person_into_standing_robot"
    return "robot_into_person" if contact.robot_speed >= contact.partner_speed else "person_into_robot"


def summarize(rows: Sequence[Mapping[str, Any]], rolling_resistance_force: float) -> Row:
    """The measurements of a run under the keys of the paper's simulation table: means over its episodes.

    ``rolling_resistance_force`` [N] is the paper's C_RollingResistanceForce; mechanical power is this force times the
    mean speed. A share is undefined (None) where an arrival's cargo was not modelled.
    """

    def mean(key: str) -> float:
        return float(np.mean([row[key] for row in rows]))

    def mean_or_none(key: str) -> float | None:
        return None if any(row[key] is None for row in rows) else mean(key)

    def share(outcome: str) -> float:
        return sum(row["outcome"] == outcome for row in rows) / len(rows)

    modelled = not any(row["outcome"] == "arrived" for row in rows)
    speed = mean("average_speed_mps")
    return {
        "sla": share("sla") if modelled else None,
        "spoiled": share("spoiled") if modelled else None,
        "timeout": share("timeout"),
        "physical_assistance": share("physical_assistance"),
        "avg_velocity_mps": speed,
        "avg_mechanical_power_kw": rolling_resistance_force * speed / 1000.0,
        "avg_collision_impulse_ns": mean("collision_impulse_ns"),
        "avg_collision_delta_v_mps": mean("collision_delta_v_mps"),
        "pedestrian_injury_usd_per_run": mean("pedestrian_injury_usd"),
        **{f"{kind}_contacts": mean_or_none(f"{kind}_contacts") for kind in PRICED_PROPERTY},
        "avg_runtime_h": mean("duration_s") / 3600.0,
        "avg_distance_km": mean("distance_m") / 1000.0,
    }


MORE = ("shortest_path_m", "pedestrian_contacts", "soft_contacts", "pieces_lost", "recoveries")


def summarize_more(rows: Sequence[Mapping[str, Any]]) -> Row:
    """Means that the paper's table does not have; None where undefined in some episode."""
    keys = (*MORE, "localization_error_mean_m")
    return {
        f"avg_{key}": None if any(row[key] is None for row in rows) else float(np.mean([row[key] for row in rows]))
        for key in keys
    }
