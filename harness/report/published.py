"""The measurements that the CostNav paper published, to set beside one's own."""

from dataclasses import dataclass

from harness.economics.cost_model import price
from harness.economics.measured import Measured
from harness.economics.prices import Prices
from harness.report.paper_tables import Column, values_of
from harness.storage.shipped import resolve, shipped
from navstack.params.strict import load_dataclass


@dataclass(frozen=True, slots=True)
class PublishedMethod:
    """One column of the paper's tables."""

    title: str
    episodes: int
    sensors: tuple[str, ...]  # those it carries and pays for, beyond the robot's own
    data_collection: bool  # whether it learns from teleoperation data collected for it
    measured: Measured


@dataclass(frozen=True, slots=True)
class RealDelivery:
    """One delivery of the real robot."""

    name: str
    outcome: str
    duration_s: float  # [s]
    distance_m: float  # [m]
    avg_velocity_mps: float  # [m/s]
    contact: str | None = None  # what it ran into
    impulse_ns: float | None = None  # [N s]
    delta_v_mps: float | None = None  # [m/s]


@dataclass(frozen=True, slots=True)
class RealWorld:
    """The paper's deliveries with the real robot."""

    method: PublishedMethod
    scenarios: tuple[RealDelivery, ...]


@dataclass(frozen=True, slots=True)
class Published:
    """All that was published."""

    source: str
    methods: dict[str, PublishedMethod]
    real_world_canvas: RealWorld


def load_published(name_or_file: str = "costnav") -> Published:
    """The published measurements by name (of ``params/published``) or from a YAML file.

    Raises:
        InputError: an unknown name or key.
    """
    return load_dataclass(
        Published, resolve(name_or_file, shipped("params") / "published", "published measurements")
    )


def published_columns(published: Published, prices: Prices) -> list[Column]:
    """The paper's columns: seven methods in its order, then the real robot."""
    columns = []
    for method in (*published.methods.values(), published.real_world_canvas.method):
        economics = price(method.measured, method.sensors, method.data_collection, prices)
        columns.append(
            Column(
                method.title, values_of(method.measured, economics), method.episodes, published=True
            )
        )
    return columns
