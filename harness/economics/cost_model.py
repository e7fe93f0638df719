"""From what was measured to what it costs.

The paper's cost model (its sections CAPEX, OPEX and break-even point).
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass

from harness.economics.break_even import break_even_days, break_even_runs
from harness.economics.cost_terms import COUNTED_TERMS, MARGIN, CostInputs
from harness.economics.measured import Measured, Quantity
from harness.economics.optional_terms import NO_EXTRA_COSTS, ExtraCosts
from harness.economics.prices import Prices
from navstack.errors import UnknownNameError


@dataclass(frozen=True, slots=True)
class RunningCosts:
    """What driving costs and earns [USD/run].

    None where something it depends on is not modelled.
    """

    terms: Mapping[str, Quantity | None]  # by key of the terms of COST_TERMS that are counted
    opex: Quantity | None
    revenue: Quantity | None
    contribution_margin: Quantity | None

    @property
    def amounts(self) -> dict[str, Quantity]:
        """Everything by its key."""
        return {
            **self.terms,
            "opex": self.opex,
            "revenue": self.revenue,
            MARGIN: self.contribution_margin,
        }


@dataclass(frozen=True, slots=True)
class Economics:
    """What a run costs and earns; None where something it depends on is not modelled."""

    hardware_usd: float  # [USD]
    data_collection_usd: float  # [USD]
    capex_usd: float  # [USD]
    running: RunningCosts  # [USD/run]
    break_even_runs: float | None  # [run]; None: never, or undefined
    break_even_days: float | None  # [day]

    @property
    def opex(self) -> float | None:
        """What a delivery costs [USD/run]."""
        return self.running.opex

    @property
    def revenue(self) -> float | None:
        """What a delivery brings in [USD/run]."""
        return self.running.revenue

    @property
    def contribution_margin(self) -> float | None:
        """What a delivery earns [USD/run]."""
        return self.running.contribution_margin

    def as_json(self) -> dict[str, float | None]:
        """Everything by its key, as JSON documents and tables have it."""
        return {
            "hardware_usd": self.hardware_usd,
            "data_collection_usd": self.data_collection_usd,
            "capex_usd": self.capex_usd,
            **self.running.amounts,
            "break_even_runs": self.break_even_runs,
            "break_even_days": self.break_even_days,
        }


def price(
    measured: Measured,
    sensors: Collection[str],
    data_collection: bool,
    prices: Prices,
    extra: ExtraCosts = NO_EXTRA_COSTS,
) -> Economics:
    """Price a run.

    Every term but electricity (mean power times mean time) is linear in the measurements, so that
    pricing the deliveries one by one and averaging gives the same.

    Args:
        measured: means over the run's deliveries, or a single delivery.
        sensors: those the robot carries and pays for, of 'lidar' and 'gps'.
        data_collection: whether the method learns from teleoperation data that has to be collected.
        prices: the price file.
        extra: what the paper leaves out; enters capex and opex and all that follows from them.

    Raises:
        UnknownNameError: a sensor without a price.
    """
    hardware = prices.robot_cost.value + _sensors_cost(sensors, prices)
    data = 0.0
    if data_collection:
        data = prices.data_collector_wage.value * prices.data_collection_time.value
    capex = hardware + data + extra.capex_usd
    costs = running(measured, prices, extra)
    runs = break_even_runs(capex, costs.contribution_margin)
    return Economics(
        hardware_usd=hardware,
        data_collection_usd=data,
        capex_usd=capex,
        running=costs,
        break_even_runs=runs,
        break_even_days=break_even_days(runs, prices),
    )


def running(measured: Measured, prices: Prices, extra: ExtraCosts = NO_EXTRA_COSTS) -> RunningCosts:
    """What driving costs and earns, for a run's means or delivery by delivery."""
    given = CostInputs(measured, prices)
    terms = {key: term.formula(given) for key, term in COUNTED_TERMS.items()}
    opex = revenue = margin = None
    defined = [amount for amount in terms.values() if amount is not None]
    if len(defined) == len(terms):
        opex = sum(defined) + extra.opex
    if measured.sla is not None:
        revenue = prices.delivery_fee.value * measured.sla
    if opex is not None and revenue is not None:
        margin = revenue - opex
    return RunningCosts(terms, opex, revenue, margin)


def _sensors_cost(sensors: Collection[str], prices: Prices) -> float:
    """Price of the optional sensors [USD]; one of a kind."""
    priced = {"lidar": prices.lidar_cost.value, "gps": prices.gps_cost.value}
    for sensor in sensors:
        if sensor not in priced:
            raise UnknownNameError("priced sensor", sensor, priced)
    return sum(priced[sensor] for sensor in set(sensors))
