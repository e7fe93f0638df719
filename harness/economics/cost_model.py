"""From what was measured to what it costs.

The paper's cost model (its sections CAPEX, OPEX and break-even point).
"""

import dataclasses
from collections.abc import Collection
from dataclasses import dataclass
from typing import Any

from harness.economics.break_even import break_even_days, break_even_runs
from harness.economics.prices import Prices
from harness.metrics.contacts import PRICED_PROPERTY
from navstack.errors import UnknownNameError

Quantity = Any  # a mean over deliveries (float), or an array with one value per delivery


@dataclass(frozen=True, slots=True)
class Measured:
    """What a run measured, as means over its deliveries: the paper's simulation table.

    :func:`running` also takes one whose fields are arrays, an entry per delivery. None stands for
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


@dataclass(frozen=True, slots=True)
class Economics:
    """What a run costs and earns; None where something it depends on is not modelled."""

    hardware_usd: float  # [USD]
    data_collection_usd: float  # [USD]
    capex_usd: float  # [USD]
    electricity: float  # [USD/run]
    service_compensation: float | None  # [USD/run]
    pedestrian_safety: float  # [USD/run]
    property_damage: float  # [USD/run]
    repair: float  # [USD/run]
    opex: float | None  # [USD/run]
    revenue: float | None  # [USD/run]
    contribution_margin: float | None  # [USD/run]
    break_even_runs: float | None  # [run]; None: never, or undefined
    break_even_days: float | None  # [day]


@dataclass(frozen=True, slots=True)
class Running:
    """What driving costs and earns [USD/run].

    None where something it depends on is not modelled.
    """

    electricity: Quantity
    service_compensation: Quantity | None
    pedestrian_safety: Quantity
    property_damage: Quantity
    repair: Quantity
    opex: Quantity | None
    revenue: Quantity | None
    contribution_margin: Quantity | None


@dataclass(frozen=True, slots=True)
class Beyond:
    """Costs that the paper leaves out, as far as a user wants them counted."""

    capex_usd: float = 0.0  # [USD]
    opex: Quantity = 0.0  # [USD/run]


NOTHING_BEYOND: Beyond = Beyond()


def price(
    measured: Measured,
    sensors: Collection[str],
    data_collection: bool,
    prices: Prices,
    beyond: Beyond = NOTHING_BEYOND,
) -> Economics:
    """Price a run.

    Every term but electricity (mean power times mean time) is linear in the measurements, so that
    pricing the deliveries one by one and averaging gives the same.

    Args:
        measured: means over the run's deliveries, or a single delivery.
        sensors: those the robot carries and pays for, of 'lidar' and 'gps'.
        data_collection: whether the method learns from teleoperation data that has to be collected.
        prices: the price file.
        beyond: what the paper leaves out; enters capex and opex and all that follows from them.

    Raises:
        UnknownNameError: a sensor without a price.
    """
    hardware = prices.robot_cost.value + _sensors_cost(sensors, prices)
    data = (
        prices.data_collector_wage.value * prices.data_collection_time.value
        if data_collection
        else 0.0
    )
    capex = hardware + data + beyond.capex_usd
    costs = running(measured, prices, beyond)
    runs = break_even_runs(capex, costs.contribution_margin)
    return Economics(
        hardware_usd=hardware,
        data_collection_usd=data,
        capex_usd=capex,
        **dataclasses.asdict(costs),
        break_even_runs=runs,
        break_even_days=break_even_days(runs, prices),
    )


def running(measured: Measured, prices: Prices, beyond: Beyond = NOTHING_BEYOND) -> Running:
    """What driving costs and earns, for a run's means or delivery by delivery."""
    # [kW] drawn from the grid
    power = measured.avg_mechanical_power_kw / prices.electro_mechanical_efficiency
    electricity = prices.electricity.value * power * measured.avg_runtime_h
    compensation = _service_compensation(measured, prices)
    injuries = measured.pedestrian_injury_usd_per_run
    property_damage = _property_damage(measured, prices)
    repair = prices.repair_per_physical_assistance * measured.physical_assistance
    opex = _sum(electricity, compensation, injuries, property_damage, repair, beyond.opex)
    revenue = None if measured.sla is None else prices.delivery_fee.value * measured.sla
    margin = None if opex is None or revenue is None else revenue - opex
    return Running(
        electricity, compensation, injuries, property_damage, repair, opex, revenue, margin
    )


def _sensors_cost(sensors: Collection[str], prices: Prices) -> float:
    """Price of the optional sensors [USD]; one of a kind."""
    priced = {"lidar": prices.lidar_cost.value, "gps": prices.gps_cost.value}
    for sensor in sensors:
        if sensor not in priced:
            raise UnknownNameError("priced sensor", sensor, priced)
    return sum(priced[sensor] for sensor in set(sensors))


def _service_compensation(measured: Measured, prices: Prices) -> float | None:
    """Refunds [USD/run]: the food where it is spoiled, the fee where it comes late or never."""
    if measured.spoiled is None:
        return None
    late = measured.timeout + measured.physical_assistance
    return measured.spoiled * prices.food_price + late * prices.delivery_fee.value


def _property_damage(measured: Measured, prices: Prices) -> float:
    """Damage to property [USD/run]; what the world does not contain cannot be damaged."""
    counts = {kind: getattr(measured, f"{kind}_contacts") for kind in PRICED_PROPERTY}
    costs = prices.property_damage
    damage: float = sum(
        count * getattr(costs, kind).value for kind, count in counts.items() if count is not None
    )
    return damage + measured.other_property_usd


def _sum(*terms: float | None) -> float | None:
    """The sum; None where a term is undefined."""
    defined = [term for term in terms if term is not None]
    return sum(defined) if len(defined) == len(terms) else None
