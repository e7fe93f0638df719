"""What is measured of a day."""

from collections.abc import Callable
from dataclasses import dataclass

from harness.fleet.ledger import Day
from harness.fleet.robots import BUSY, TROUBLED
from harness.fleet.simulation import End
from navstack.types import FloatArray


@dataclass(frozen=True, slots=True)
class DayMetric:
    """One quantity of a day."""

    title: str
    of: Callable[[Day], float]  # NaN: the day has none
    decimals: int = 2


def _mean(values: FloatArray) -> float:
    if not values.size:
        return float("nan")
    return float(values.mean())


def _per(amount: float, count: float) -> float:
    """NaN where there is nothing to count by: no delivery, or no way."""
    if not count:
        return float("nan")
    return amount / count


DAY_METRICS = {
    "profit_per_robot_usd": DayMetric(
        "Profit per robot ($/day)", lambda day: day.profit / day.robots
    ),
    "profit_usd": DayMetric("Profit of the fleet ($/day)", lambda day: day.profit, 0),
    "revenue_per_robot_usd": DayMetric(
        "Fees per robot ($/day)", lambda day: day.money["revenue"] / day.robots
    ),
    "deliveries": DayMetric("Deliveries a day", lambda day: day.delivered, 1),
    "deliveries_per_robot": DayMetric(
        "Deliveries per robot and day", lambda day: day.delivered / day.robots
    ),
    "orders_lost_percent": DayMetric(
        "Orders that no robot took (%)",
        lambda day: 100.0 * day.share_of_orders(End.LOST),
        1,
    ),
    "orders_late_percent": DayMetric(
        "Orders delivered late (%)", lambda day: 100.0 * day.share_of_orders(End.LATE), 1
    ),
    "orders_failed_percent": DayMetric(
        "Orders failed (%)", lambda day: 100.0 * day.share_of_orders(End.FAILED), 1
    ),
    "utilisation_percent": DayMetric(
        "Robots load, drive, hand over (%)", lambda day: 100.0 * day.share_in(BUSY), 1
    ),
    "trouble_percent": DayMetric(
        "Robots wait for or get help (%)", lambda day: 100.0 * day.share_in(TROUBLED), 1
    ),
    "operators_busy_percent": DayMetric(
        "Operators help (%)", lambda day: 100.0 * day.operators_busy, 1
    ),
    "customer_wait_min": DayMetric(
        "Customers wait (min)", lambda day: _mean(day.customer_waits), 1
    ),
    "operator_wait_min": DayMetric(
        "Robots wait for an operator (min)", lambda day: _mean(day.robot_waits)
    ),
    "field_wait_min": DayMetric(
        "Robots wait for a field worker (min)", lambda day: _mean(day.field_waits), 1
    ),
    "robot_hours_per_delivery_h": DayMetric(
        "Robot time per delivery (h)", lambda day: _per(day.hours_in(BUSY), day.delivered)
    ),
    "distance_per_delivery_km": DayMetric(
        "Way per delivery (km)", lambda day: _per(day.distance, day.delivered)
    ),
    "energy_per_km_wh": DayMetric(
        "Energy (Wh/km)", lambda day: _per(day.energy.charged, day.distance), 0
    ),
}
PROFIT = "profit_per_robot_usd"
