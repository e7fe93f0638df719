"""What ``navbench day`` finds: a study of each library, curves, and what the second is worth."""

from collections.abc import Sequence
from dataclasses import dataclass

from harness.economics.price import price_keys, with_unit
from harness.fleet.ledger import FleetPrices
from harness.fleet.legs import Library
from harness.fleet.settings import FleetSettings
from harness.fleet.study import (
    CURVE_DAYS,
    DAYS_EACH,
    CurvePoint,
    Estimate,
    Fleet,
    FleetStudy,
    Tell,
    differences,
    paying_size,
    require_countable_calls,
    require_moving,
    sizes_of_robots,
    sizes_of_staff,
)
from harness.storage.rows import Row

PER_ROBOT_DAY = "usd_per_robot_day"


@dataclass(frozen=True, slots=True, eq=False)
class LibraryResult:
    """What a fleet comes to with one library."""

    study: FleetStudy
    by_robots: tuple[CurvePoint, ...]  # as many robots per operator
    by_operators: tuple[CurvePoint, ...]  # the same robots

    @property
    def paying(self) -> CurvePoint | None:
        """The fleet on the curve that earns most; None: none earns anything."""
        return paying_size(self.by_robots)

    @property
    def money(self) -> dict[str, float]:
        """Mean of each entry of the ledger [USD per robot and day]."""
        days = self.study.days
        robot_days = sum(day.robots for day in days)
        return {key: sum(day.money[key] for day in days) / robot_days for key in days[0].money}


@dataclass(frozen=True, slots=True, eq=False)
class FleetResult:
    """The document and the page are made of this."""

    settings: FleetSettings
    at: FleetPrices
    seed: int
    sources: tuple[str, ...]  # of each library: its run folders
    libraries: tuple[LibraryResult, ...]
    difference: dict[str, Estimate] | None  # second less first; None: there is one library

    @property
    def robots(self) -> int:
        """Of the fleet."""
        return int(self.settings.robots.value)

    @property
    def operators(self) -> int:
        """Of the fleet."""
        return int(self.settings.operators.value)

    def as_json(self) -> Row:
        """As ``navbench day --json`` prints it."""
        known = price_keys(self.settings)
        settings = {with_unit(key, each): each.value for key, each in known.items()}
        curves = ("demand_by_hour", "people_by_hour")
        hours = {name: list(getattr(self.settings, name).hours) for name in curves}
        difference = None
        if self.difference is not None:
            difference = {key: each.as_json() for key, each in self.difference.items()}
        return {
            "schema": 1,
            "seed": self.seed,
            "settings": {**settings, **hours},
            "libraries": [
                _library_json(each, source)
                for each, source in zip(self.libraries, self.sources, strict=True)
            ],
            "difference": difference,
        }


def simulate(
    libraries: Sequence[Library],
    sources: Sequence[str],
    settings: FleetSettings,
    at: FleetPrices,
    seed: int,
    days: int,
    resamples: int,
    tell: Tell = lambda: None,
) -> FleetResult:
    """Simulate a fleet with each library; the same days and chance for all.

    Args:
        libraries: one or two.
        sources: of each: its run folders.
        settings: of the fleet.
        at: prices.
        seed: of all chance.
        days: with the legs as they were driven.
        resamples: of the legs, each with :data:`DAYS_EACH` days.
        tell: is called after each of the :func:`simulated_days`.

    Raises:
        InputError: a way would take more than :data:`harness.fleet.study.MOST_LEGS` legs, or a day
            has too many calls for help.
    """
    require_countable_calls(settings, at.optional)
    for library in libraries:
        require_moving(library, settings)
    fleet = Fleet(settings, at, seed, tell)
    size = _size(settings)
    found = [
        LibraryResult(
            fleet.study(library, days, resamples),
            fleet.curve(library, sizes_of_robots(*size)),
            fleet.curve(library, sizes_of_staff(*size)),
        )
        for library in libraries
    ]
    difference = None
    if len(found) == 2:
        first, second = found
        difference = differences(first.study, second.study)
    return FleetResult(settings, at, seed, tuple(sources), tuple(found), difference)


def simulated_days(settings: FleetSettings, days: int, resamples: int) -> int:
    """How many days :func:`simulate` simulates with each library."""
    size = _size(settings)
    points = len(sizes_of_robots(*size)) + len(sizes_of_staff(*size))
    first_again = 1  # for its robots
    return days + resamples * DAYS_EACH + points * CURVE_DAYS + first_again


def _size(settings: FleetSettings) -> tuple[int, int]:
    """Robots and operators."""
    return int(settings.robots.value), int(settings.operators.value)


def _library_json(found: LibraryResult, source: str) -> Row:
    study, paying = found.study, found.paying
    return {
        "stack": study.library.name,
        "legs": study.library.size,
        "folders": source,
        "people": [group.people for group in study.library.groups],
        "days": len(study.days),
        "resampled_days": len(study.resampled) * DAYS_EACH,
        "estimates": {key: each.as_json() for key, each in study.estimates.items()},
        "money": {f"{key}_{PER_ROBOT_DAY}": each for key, each in found.money.items()},
        "break_even_robots_per_operator": study.break_even.as_json(),
        "break_even_never_share": study.never_share,
        "paying_robots": None if paying is None else paying.robots,
        "by_robots": [_point_json(point) for point in found.by_robots],
        "by_operators": [_point_json(point) for point in found.by_operators],
    }


def _point_json(point: CurvePoint) -> Row:
    return {
        "robots": point.robots,
        "operators": point.operators,
        "profit_per_robot_usd": point.profit_per_robot.as_json(),
        "profit_usd": point.profit,
        "utilisation_percent": point.utilisation,
        "customer_wait_min": point.customer_wait,
        "operator_wait_min": point.operator_wait,
    }
