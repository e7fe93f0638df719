"""What ``navbench day`` found, in at most 25 lines."""

from collections.abc import Sequence

from harness.fleet.day_metrics import DAY_METRICS, PROFIT
from harness.fleet.result import FleetResult, LibraryResult
from harness.fleet.study import CurvePoint, Estimate
from harness.report.blocks import Block
from harness.report.numbers import bounds_text, counted, interval_text, number_text
from harness.report.short.findings import lines_of
from harness.report.short.run import aligned
from harness.statistics.interval import Interval

SHOWN = (
    *(PROFIT, "deliveries_per_robot", "utilisation_percent", "trouble_percent"),
    *("orders_lost_percent", "orders_failed_percent", "customer_wait_min", "operator_wait_min"),
)


def fleet_blocks(result: FleetResult) -> list[Block]:
    """Who drove for whom, what a robot earns, what that needs, and a few quantities."""
    lines = [setup(result)]
    for found in result.libraries:
        lines += answers(found)
    if result.difference is not None:
        lines.append(worth(result))
    return lines_of([*lines, *aligned(_rows(result))])


def setup(result: FleetResult) -> str:
    """The fleet, its orders and its legs, in one line."""
    settings = result.settings
    legs = "; ".join(
        f"{found.study.library.title}, {counted(found.study.library.size, 'leg')} of {source}"
        for found, source in zip(result.libraries, result.sources, strict=True)
    )
    days = counted(len(result.libraries[0].study.days), "day")
    hours = f"{settings.open_hour.value:g} to {settings.close_hour.value:g} h"
    return (
        f"{counted(result.robots, 'robot')}, {counted(result.operators, 'operator')}, "
        f"{settings.orders_per_day.value:g} orders a day from {hours}, {days}; {legs}"
    )


def answers(found: LibraryResult) -> list[str]:
    """What a robot earns, how many an operator must serve, and which size pays."""
    study = found.study
    name = study.library.title
    profit = study.estimates[PROFIT].mean
    lines = [
        f"{name}: {_earning(profit)} per robot and day",
        f"{name}: break-even at {break_even_text(study.break_even)}; {_size(found)}",
    ]
    if not study.library.has_cargo:
        lines.append(f"{name}: its cargo was not simulated; nothing is spoiled here")
    return lines


def _earning(profit: Interval) -> str:
    text = interval_text(profit)
    if profit.low is None or profit.high is None or profit.low <= 0.0 <= profit.high:
        return f"profit {text} USD"
    if profit.low > 0.0:
        return f"earns {text} USD"
    return f"loses money: {text} USD"


def break_even_text(robots: Interval) -> str:
    """Robots per operator, or that none is enough."""
    if robots.value is None:
        return "no number of robots per operator"
    return f"{interval_text(robots, 1)} robots per operator"


def _size(found: LibraryResult) -> str:
    sizes = found.by_robots
    if found.paying is None:
        return f"no fleet of {sizes[0].robots} to {sizes[-1].robots} robots pays"
    best = found.paying
    edge = ""
    if best == sizes[-1]:
        edge = ", the largest tried"
    return f"a fleet of {best.robots} earns most{edge}: {best.profit:,.0f} USD a day"


def worth(result: FleetResult) -> str:
    """What the second library is worth over the first."""
    assert result.difference is not None
    first, second = (found.study.library.title for found in result.libraries)
    mean = result.difference[PROFIT].mean
    text = interval_text(mean, is_signed=True)
    return f"{second} in place of {first}: {text} USD per robot and day"


def _rows(result: FleetResult) -> list[list[str]]:
    names = [found.study.library.title for found in result.libraries]
    head = ["", *(cell for name in names for cell in (name, "95 % of days"))]
    rows = []
    for key in SHOWN:
        metric = DAY_METRICS[key]
        row = [metric.title]
        for found in result.libraries:
            row += estimate_cells(found.study.estimates[key], metric.decimals)
        rows.append(row)
    return [head, *rows]


def estimate_cells(estimate: Estimate, decimals: int) -> list[str]:
    """Mean with its interval; the range of single days."""
    days = Interval(estimate.mean.value, estimate.day_low, estimate.day_high, estimate.mean.n)
    return [interval_text(estimate.mean, decimals), bounds_text(days, decimals)]


def curve_rows(points: Sequence[CurvePoint]) -> list[list[str]]:
    """A row for each size of a fleet."""
    return [
        [
            str(point.robots),
            str(point.operators),
            interval_text(point.profit_per_robot),
            f"{point.profit:,.0f}",
            number_text(point.utilisation, 1),
            number_text(point.customer_wait, 1),
            number_text(point.operator_wait),
        ]
        for point in points
    ]
