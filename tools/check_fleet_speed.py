"""How much processor time days of a fleet take.

Usage: python -m tools.check_fleet_speed [--legs RUN] [--robots N] [--days N]
"""

import time

from harness.economics.optional_prices import load_optional_prices
from harness.fleet.ledger import FleetPrices
from harness.fleet.legs import library_of
from harness.fleet.settings import load_settings
from harness.fleet.study import Fleet
from harness.study.stored_run import load_run
from tools.options import parsed

LEGS = "results/baseline/published_3/costnav:evasive-gps-ekf"


def main() -> None:
    """Simulate the days and print what they took."""
    given = parsed(__doc__, legs=LEGS, robots=50, days=1000)
    run = load_run(given.legs)
    prices = run.prices()
    orders = 10.0 * given.robots
    settings = load_settings("city", {"robots": given.robots, "orders_per_day": orders})
    library = library_of([run], prices)
    fleet = Fleet(settings, FleetPrices(prices, load_optional_prices(prices)), seed=0)
    begin = time.process_time()
    days = fleet.days(library, range(given.days))
    spent = time.process_time() - begin
    delivered = sum(day.delivered for day in days)
    print(
        f"{given.days} days of {given.robots} robots, {delivered} deliveries: "
        f"{spent:.1f} s of processor time"
    )


if __name__ == "__main__":
    main()
