"""What a day comes to: its orders, its energy and its money."""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harness.economics.cost_terms import COST_TERMS, CostInputs
from harness.economics.measured import Measured
from harness.economics.optional_prices import OptionalPrices
from harness.economics.prices import DAYS_PER_YEAR, Prices
from harness.fleet.legs import CONTACTS, WH_PER_KWH, Library
from harness.fleet.orders import SECONDS_PER_HOUR, SECONDS_PER_MINUTE, DayOrders
from harness.fleet.robots import FleetRobot, State
from harness.fleet.settings import FleetSettings
from harness.fleet.simulation import DayLog, End
from navstack.types import FloatArray

DELIVERED = (End.IN_TIME, End.LATE, End.SPOILED)
REVENUE = "revenue"


@dataclass(frozen=True, slots=True)
class Energy:
    """Of all batteries on a day [Wh]; charged is moved and idled, as they begin and end full."""

    moved: float
    idled: float
    charged: float


@dataclass(frozen=True, slots=True)
class Day:
    """What a day came to."""

    orders: dict[End, int]
    money: dict[str, float]  # [USD]; revenue, and costs below 0
    energy: Energy
    hours: dict[State, float]  # [h] of all robots
    robots: int
    operators: int
    paid_hours: float  # [h] of an operator, from opening until nothing drives any more
    helped_hours: float  # [h] that operators were busy
    distance: float  # [km]
    customer_waits: FloatArray  # [min] from order to delivery
    robot_waits: FloatArray  # [min] of robots for an operator
    field_waits: FloatArray  # [min] of robots for a field worker

    @property
    def delivered(self) -> int:
        """Orders that came to their customers, in whatever state."""
        return sum(self.orders[end] for end in DELIVERED)

    @property
    def profit(self) -> float:
        """Of the fleet [USD]."""
        return sum(self.money.values())

    def hours_in(self, states: Sequence[State]) -> float:
        """Of all robots in some states [h]."""
        return sum(self.hours[state] for state in states)

    def share_in(self, states: Sequence[State]) -> float:
        """Of the robots' time, in some states."""
        return self.hours_in(states) / sum(self.hours.values())

    def share_of_orders(self, end: End) -> float:
        """Of the orders that ended so; NaN where there was none."""
        placed = sum(self.orders.values())
        if not placed:
            return math.nan
        return self.orders[end] / placed

    @property
    def operators_busy(self) -> float:
        """Share of the operators' time in which they help."""
        return self.helped_hours / (self.operators * self.paid_hours)


@dataclass(frozen=True, slots=True)
class FleetPrices:
    """At which a day is settled."""

    prices: Prices
    optional: OptionalPrices


def settle(
    log: DayLog,
    robots: Sequence[FleetRobot],
    orders: DayOrders,
    library: Library,
    settings: FleetSettings,
    at: FleetPrices,
) -> Day:
    """What a simulated day comes to.

    Args:
        log: of the day.
        robots: of the fleet, at its end.
        orders: of the day.
        library: whose legs were driven.
        settings: of the fleet.
        at: prices.
    """
    energy = Energy(
        moved=sum(robot.driven for robot in robots),
        idled=sum(robot.idled for robot in robots),
        charged=sum(robot.charged for robot in robots),
    )
    paid, paid_in_field = (
        until / SECONDS_PER_HOUR - settings.open_hour.value
        for until in (log.driven_until, log.home)
    )
    ends = Counter(trip.end for trip in log.trips)
    counts = {end: ends[end] for end in End}
    contacts, distance = _driven(log, orders, library)
    operators = int(settings.operators.value)
    staff = operators * paid, settings.field_workers.value * paid_in_field
    money = {
        **_of_deliveries(counts, contacts, log.failures, at),
        **_of_fleet(energy, staff, at.optional, at.prices),
        "robots": -len(robots) * library.capex_usd / _life_days(at.prices),
    }
    waits = [trip.delivered - trip.placed for trip in log.trips if trip.end in DELIVERED]
    return Day(
        orders=counts,
        money=money,
        energy=energy,
        hours=_hours(robots),
        robots=len(robots),
        operators=operators,
        paid_hours=paid,
        helped_hours=log.helped / SECONDS_PER_HOUR,
        distance=distance,
        customer_waits=np.array(waits) / SECONDS_PER_MINUTE,
        robot_waits=np.array(log.waits) / SECONDS_PER_MINUTE,
        field_waits=np.array(log.field_waits) / SECONDS_PER_MINUTE,
    )


def _life_days(prices: Prices) -> float:
    return prices.robot_life.value * DAYS_PER_YEAR


def _hours(robots: Sequence[FleetRobot]) -> dict[State, float]:
    hours = dict.fromkeys(State, 0.0)
    for robot in robots:
        for state, start, end in robot.spans:
            hours[state] += (end - start) / SECONDS_PER_HOUR
    return hours


def _driven(log: DayLog, orders: DayOrders, library: Library) -> tuple[FloatArray, float]:
    """Sums over the legs that were driven: contacts (k,), columns as CONTACTS, and [km]."""
    contacts, distance = np.zeros(len(CONTACTS)), 0.0
    for number, (ways, legs) in enumerate(zip(orders.groups, library.groups, strict=True)):
        own = [(first, last) for group, first, last in log.driven if group == number]
        if not own:
            continue
        firsts, lasts = np.array(own).T
        changes = np.bincount(firsts, minlength=len(ways.numbers) + 1)
        changes = changes - np.bincount(lasts, minlength=len(ways.numbers) + 1)
        times = np.cumsum(changes)[:-1]  # each leg is driven once at most
        contacts += times @ legs.contacts[ways.numbers]
        distance += float(times @ legs.distance[ways.numbers])
    return contacts, distance


def _of_deliveries(
    counts: dict[End, int], contacts: FloatArray, failures: int, at: FleetPrices
) -> dict[str, float]:
    """Fees, and the published terms that contacts and outcomes cost [USD]: sums, not means.

    A failure on the way back needs repair, but refunds nothing.
    """
    sums = dict(zip(CONTACTS, contacts.tolist(), strict=True))
    measured = Measured(
        sla=counts[End.IN_TIME],
        spoiled=counts[End.SPOILED],
        timeout=counts[End.LATE],
        physical_assistance=counts[End.FAILED],
        avg_velocity_mps=0.0,
        avg_mechanical_power_kw=0.0,
        avg_collision_impulse_ns=0.0,
        avg_collision_delta_v_mps=0.0,
        avg_runtime_h=0.0,
        avg_distance_km=0.0,
        **sums,
    )
    given = CostInputs(measured, at.prices, at.optional)
    names = ("service_compensation", "pedestrian_safety", "property_damage")
    costs = {name: -float(COST_TERMS[name].formula(given) or 0.0) for name in names}
    repair = failures * at.prices.repair_per_physical_assistance
    fees = at.prices.delivery_fee.value * counts[End.IN_TIME]
    return {REVENUE: fees, **costs, "repair": -repair}


def _of_fleet(
    energy: Energy,
    staff: tuple[float, float],
    optional: OptionalPrices,
    prices: Prices,
) -> dict[str, float]:
    """What charging, wear and staff cost [USD]; ``staff``: hours of operators and field workers."""
    efficiency = prices.charge_efficiency.value * prices.battery_roundtrip_efficiency.value
    grid = energy.charged / WH_PER_KWH / efficiency  # [kWh]
    drawn = (energy.moved + energy.idled) / WH_PER_KWH
    wear = optional.battery_price.value / optional.battery_cycles.value
    wage = optional.operator_wage.value
    operators, field_workers = staff
    return {
        "electricity": -prices.electricity.value * grid,
        "battery_wear": -wear * drawn,
        "operators": -operators * wage,
        "field_workers": -field_workers * wage,
    }
