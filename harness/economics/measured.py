"""What deliveries measured: the quantities of the paper's simulation table."""

from dataclasses import dataclass
from typing import Any

FLAT_WAY = 1.0  # [km] that a fee by distance begins with, as Wolt Drive's
Quantity = Any  # a mean over deliveries (float), or an array with one value per delivery


@dataclass(frozen=True, slots=True)
class Measured:
    """What a run measured, as means over its deliveries: the paper's simulation table.

    The formulas also take one whose fields are arrays, an entry per delivery. None stands for
    "not modelled" (cargo) or "no such thing in this world" (property), never for zero.
    """

    sla: float | None  # [1/run] delivered in time and intact
    spoiled: float | None  # [1/run]
    timeout: float  # [1/run]
    physical_assistance: float  # [1/run]
    avg_velocity_mps: float  # [m/s]
    avg_mechanical_power_kw: float  # [kW]
    avg_collision_impulse_ns: float  # [N s] total of counted contacts per run
    avg_collision_delta_v_mps: float  # [m/s]
    pedestrian_injury_usd_per_run: float  # [USD/run]
    avg_runtime_h: float  # [h/run]
    avg_distance_km: float  # [km/run]
    mailbox_contacts: float | None = None  # [1/run]
    trash_bin_contacts: float | None = None  # [1/run]
    building_glass_contacts: float | None = None  # [1/run]
    bollard_contacts: float | None = None  # [1/run]
    plant_contacts: float | None = None  # [1/run]
    fence_contacts: float | None = None  # [1/run]
    # [USD/run] damage to what has no price in the paper; published: none
    other_property_usd: float = 0.0
    # [km/run] of the shortest way beyond FLAT_WAY, of deliveries in time and intact
    further_km: float = 0.0
    back_assistance: float = 0.0  # [1/run] ways back that end in physical assistance
