"""The rows of the printed tables: which quantity, under which label, with how many decimals."""

from dataclasses import dataclass

from harness.metrics.catalog import GROUPS
from harness.metrics.metric import Metric


@dataclass(frozen=True, slots=True)
class Row:
    """One quantity."""

    label: str
    key: str  # field of Measured or Economics
    decimals: int
    bold: bool = False
    absent: str = "--"  # what stands where the quantity is undefined


@dataclass(frozen=True, slots=True)
class Section:
    """Rows under one heading."""

    title: str
    rows: tuple[Row, ...]


@dataclass(frozen=True, slots=True)
class Layout:
    """One table."""

    title: str
    sections: tuple[Section, ...]


NOT_MODELLED = "not modelled"
UNDEFINED = "undefined"

RATES = frozenset(("sla", "spoiled", "timeout", "physical_assistance"))  # shares of deliveries

SIMULATION_EVALUATION = Layout(
    "Simulation evaluation",
    (
        Section(
            "Episode Outcomes (/run)",
            (
                Row("SLA Compliance", "sla", 3, bold=True, absent=NOT_MODELLED),
                Row("Spoiled", "spoiled", 3, absent=NOT_MODELLED),
                Row("Timeout", "timeout", 3),
                Row("Physical Assistance", "physical_assistance", 3),
            ),
        ),
        Section(
            "Physical Metrics",
            (
                Row("Avg Velocity (m/s)", "avg_velocity_mps", 4),
                Row("Avg Mech. Power (kW)", "avg_mechanical_power_kw", 4),
                Row("Avg Collision Impulse (N s)", "avg_collision_impulse_ns", 2),
                Row("Avg Collision Δv (m/s)", "avg_collision_delta_v_mps", 4),
            ),
        ),
        Section(
            "Safety Events (/run)",
            (
                Row("Pedestrian Injury Cost ($)", "pedestrian_injury_usd_per_run", 2),
                Row("Mailbox Contact", "mailbox_contacts", 3),
                Row("Trash Bin Contact", "trash_bin_contacts", 3),
                Row("Building Glass Contact", "building_glass_contacts", 3),
                Row("Bollard Contact", "bollard_contacts", 3),
                Row("Plant Contact", "plant_contacts", 3),
                Row("Fence Contact", "fence_contacts", 3),
            ),
        ),
        Section(
            "Performance",
            (
                Row("Avg Runtime (hr/run)", "avg_runtime_h", 4),
                Row("Avg Distance (km/run)", "avg_distance_km", 4),
            ),
        ),
    ),
)

ECONOMIC_PERFORMANCE = Layout(
    "Economic performance",
    (
        Section(
            "CAPEX ($)",
            (
                Row("Hardware", "hardware_usd", 2),
                Row("Data Collection", "data_collection_usd", 2),
                Row("Total CAPEX Cost", "capex_usd", 2, bold=True),
            ),
        ),
        Section(
            "OPEX ($/run)",
            (
                Row("Electricity", "electricity", 5),
                Row("Service Compensation", "service_compensation", 2, absent=UNDEFINED),
                Row("Pedestrian Safety", "pedestrian_safety", 2),
                Row("Property Damage", "property_damage", 2),
                Row("Repair", "repair", 2),
                Row("Total OPEX Cost", "opex", 2, bold=True, absent=UNDEFINED),
            ),
        ),
        Section(
            "Profitability",
            (
                Row("Revenue ($/run)", "revenue", 2, bold=True, absent=UNDEFINED),
                Row("Contribution Margin ($/run)", "contribution_margin", 2, bold=True, absent=UNDEFINED),
                Row("BEP (runs)", "break_even_runs", 0, bold=True),
                Row("BEP (days)", "break_even_days", 0),
            ),
        ),
    ),
)

LAYOUTS = (SIMULATION_EVALUATION, ECONOMIC_PERFORMANCE)


def further_metrics() -> Layout:
    """Means over deliveries that the paper's tables do not have, group by group."""
    sections = (
        (title, tuple(_row(metric) for metric in group if _is_printed(metric))) for title, group in GROUPS.items()
    )
    return Layout(
        "Further metrics (means over deliveries)", tuple(Section(*section) for section in sections if section[1])
    )


def _is_printed(metric: Metric) -> bool:
    return metric.decimals is not None and not metric.is_published


def _row(metric: Metric) -> Row:
    unit = f" ({metric.unit})" if metric.unit else ""
    return Row(f"{metric.title}{unit}", metric.mean_key or "", metric.decimals or 0)
