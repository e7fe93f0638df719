"""A day of a fleet over deliveries that were driven."""

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from harness.economics.optional_prices import OptionalPrices, load_optional_prices
from harness.economics.price import check_prices, names_of, with_values
from harness.economics.prices import Prices, checked, load_prices
from harness.fleet.ledger import FleetPrices
from harness.fleet.legs import library_of, notes_on
from harness.fleet.result import FleetResult, simulate, simulated_days
from harness.fleet.settings import FleetSettings, is_setting, load_settings
from harness.fleet.study import DAYS, RESAMPLES
from harness.report.fleet.page import write_fleet_page
from harness.storage.documents import write_document
from harness.storage.new_run import output_folder, require_usable
from navbench.api.progress import count_shown, say
from navbench.api.report import today
from navbench.api.runs import Run
from navstack.errors import InputError, UnknownNameError

MOST_DAYS = 100_000
DOCUMENT = "day.json"
# prices that enter where deliveries are priced one by one: what to do about a day instead
_NOT_OF_DAYS = {
    "deliveries_per_day": "give orders_per_day",
    "robots_per_operator": "give robots and operators",
    "operator_shift": "give open_hour and close_hour",
    "survey_wage": "leave it out",
    "survey_time": "leave it out",
    "distance_fee": "leave it out",
}


@dataclass(frozen=True)
class FleetRun:
    """What was found, and the folder with its page."""

    folder: Path
    page: Path
    result: FleetResult

    def as_json(self) -> dict[str, Any]:
        """As ``navbench day --json`` prints it."""
        return {**self.result.as_json(), "folder": str(self.folder)}


def day(
    legs: Sequence[Run],
    legs_b: Sequence[Run] = (),
    *,
    settings: str = "city",
    values: Mapping[str, float] | None = None,
    prices: str | None = None,
    days: int = DAYS,
    resamples: int = RESAMPLES,
    seed: int = 0,
    out: Path | None = None,
) -> FleetRun:
    """Simulate days of a fleet whose ways are made of driven deliveries.

    Args:
        legs: finished runs of one stack, e.g. among different numbers of people.
        legs_b: of another one, for the same days; none: one library only.
        settings: a name of params/fleet or a file.
        values: other values of single settings or prices, e.g. ``{"robots": 50}``.
        prices: a name of params/prices or a file; None: the first run's own.
        days: to be simulated with the legs as they were driven.
        resamples: of the legs, for the intervals; at least 2, or 0 for none.
        seed: of all chance, 0 or more.
        out: folder of the page; None: ``results/<time>-day``.

    Raises:
        InputError: something that was given cannot be used.
    """
    if not 1 <= days <= MOST_DAYS:
        raise InputError(f"{days} days cannot be simulated; give 1 to {MOST_DAYS}")
    if seed < 0:
        raise InputError(f"seed {seed} is negative; give 0 or more")
    fleet, at = _chosen(legs[0], settings, values or {}, prices)
    runs = [each for each in (legs, legs_b) if each]
    libraries = [library_of([run.stored for run in own], at.prices) for own in runs]
    if len({library.name for library in libraries}) < len(libraries):
        libraries = [
            dataclasses.replace(library, folders=", ".join(run.folder.name for run in own))
            for library, own in zip(libraries, runs, strict=True)
        ]
    for library in libraries:
        for note in notes_on(library, fleet.way):
            say(f"note: {note}")
    sources = [", ".join(str(run.folder) for run in own) for own in runs]
    total = len(runs) * simulated_days(fleet, days, resamples)
    with output_folder(out, "day") as folder:
        require_usable(folder)
        with count_shown("days", total) as tell:
            result = simulate(libraries, sources, fleet, at, seed, days, resamples, tell)
        page = write_fleet_page(result, folder, today())
        run = FleetRun(folder, page, result)
        write_document(folder / DOCUMENT, run.as_json())
    return run


def _chosen(
    run: Run, settings: str, values: Mapping[str, float], prices: str | None
) -> tuple[FleetSettings, FleetPrices]:
    """Settings and prices, each with its part of the values."""
    own: Prices = run.stored.prices()
    if prices is not None:
        own = load_prices(prices)
    optional: OptionalPrices = load_optional_prices(own)
    fleet = load_settings(settings)
    known = {**names_of(own), **names_of(optional), **names_of(fleet)}
    for key in values:
        if key not in known:
            raise UnknownNameError("setting or price", key, known)
        if known[key] in _NOT_OF_DAYS:
            raise InputError(f"--set {key} has no effect on a day; {_NOT_OF_DAYS[known[key]]}")
    of_fleet = {key: value for key, value in values.items() if is_setting(fleet, key)}
    others = {key: value for key, value in values.items() if key not in of_fleet}
    of_prices = {key: value for key, value in others.items() if key in names_of(own)}
    of_optional = {key: value for key, value in others.items() if key not in of_prices}
    optional = with_values(optional, of_optional)
    check_prices(optional, "--set")
    own = checked(with_values(own, of_prices), "--set")
    return load_settings(settings, of_fleet), FleetPrices(own, optional)
