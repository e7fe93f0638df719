"""What stacks do where a city is harder than the default world, from stored deliveries."""

from dataclasses import dataclass
from functools import cache
from statistics import fmean

import numpy as np

from harness.economics.valuation import value
from harness.report.markdown import table, wrapped
from harness.report.numbers import interval_text
from harness.statistics.bootstrap import percentile_interval, resampled_means
from harness.statistics.interval import Interval
from harness.storage.rows import values
from harness.study.stored_run import StoredRun
from tools.stored_figures import (
    BASELINE,
    MAPS,
    margin_text,
    margins_of,
    pooled,
    rate_text,
    share,
    speed_text,
    stacks_at,
    total,
)

PAGE = BASELINE / "hard" / "index.md"
SHORTEST_SPEED = 2.0  # [m/s] at which the shortest way would be driven
# of README's table: the first that has driven in a city
COLUMNS = (
    ("evasive-gps-ekf", "evasive-yielding-gps-ekf"),
    ("mpc-gps-ekf",),
    ("nav2-gps-ekf",),
)
NOT_DRIVEN = "–"
BASE = "nav2-gps-ekf"  # whose time is held against the others'
PAGE_HEAD = [
    *("city", "stack", "margin [USD/delivery]", "bootstrap alone", "in time, intact"),
    *("contacts per 1000 km", "time / shortest", f"time / `{BASE}`"),
    *("speed [m/s]", "ghosts a scan"),
]


@dataclass(frozen=True, slots=True)
class City:
    """A kind of city in which stacks have driven."""

    folder: str  # of results/baseline, with a packed run for each map
    title: str
    is_in_readme: bool = True

    @property
    def maps(self) -> tuple[str, ...]:
        """Those that are driven."""
        return tuple(name for name in MAPS if stacks_at(self.folder, name))


@cache  # for both tables
def runs_of(city: City) -> list[StoredRun]:
    """What each stack did on all maps of a city, the best first."""
    stacks = stacks_at(city.folder, city.maps[0])
    found = [pooled(city.folder, stack, city.maps) for stack in stacks]
    return sorted(found, key=lambda run: -margins_of(run).mean())


CITIES = (
    City("urban", "between houses (`rtk_urban`)"),
    City("consumer", "cheap parts between houses (`consumer_gps`)", is_in_readme=False),
    City("crowds/60", "60 people"),
    City("crowds/100", "100 people"),
    City("crowds/making_way", "100 who make way (`evasive-yielding-gps-ekf`)"),
)


def summary() -> str:
    """README's table: what some stacks earn in each city."""
    rows = []
    for city in filter(lambda each: each.is_in_readme, CITIES):
        runs = {run.stacks[0].name: run for run in runs_of(city)}
        cells = []
        for names in COLUMNS:
            driven = [runs[name] for name in names if name in runs]
            cells.append(margin_text(driven[0]) if driven else NOT_DRIVEN)
        count = len(runs_of(city)[0].stacks[0].rows)
        rows.append([city.title, str(count), *cells])
    heads = [f"`{names[0]}`" for names in COLUMNS]
    intro = wrapped(
        "**Harder cities**, margins again ([all stacks](results/baseline/hard/index.md)):"
    )
    return f"{intro}\n\n{table(['city', 'n', *heads], rows)}\n"


def times_over(run: StoredRun, base: StoredRun) -> Interval:
    """Time of all deliveries over that of another stack on the same missions."""
    pairs = np.array([values(each.stacks[0].rows, "duration_s") for each in (run, base)]).T
    means = resampled_means(pairs, np.random.default_rng(run.seed))
    ratio = float(pairs[:, 0].sum() / pairs[:, 1].sum())
    return percentile_interval(ratio, means[:, 0] / means[:, 1], len(pairs))


def page_row(city: City, run: StoredRun) -> list[str]:
    """What a stack did in a city."""
    (stack,) = run.stacks
    margin = value(stack.rows, stack, run.prices(), run.seed).intervals["contribution_margin"]
    shortest = total(run, "shortest_path_m") / SHORTEST_SPEED
    (base,) = [each for each in runs_of(city) if each.stacks[0].name == BASE]
    ghosts = [each for each in values(stack.rows, "ghost_tracks") if each is not None]
    return [
        city.title,
        f"`{stack.name}`",
        margin_text(run),
        interval_text(margin),
        share(run, "sla"),
        rate_text(run, "contacts_per_1000_km"),
        f"{total(run, 'duration_s') / shortest:.2f}",
        NOT_DRIVEN if run is base else interval_text(times_over(run, base)),
        speed_text(run),
        f"{fmean(ghosts):.2f}" if ghosts else NOT_DRIVEN,
    ]


def page_figures() -> str:
    """The page's table: what every stack did in each city, the best first."""
    rows = [page_row(city, run) for city in CITIES for run in runs_of(city)]
    counts = [
        f"{city.title}: {len(runs_of(city)[0].stacks[0].rows)} on "
        f"{', '.join(f'`{name}`' for name in city.maps)}"
        for city in CITIES
    ]
    intro = wrapped(f"Deliveries of each stack. {'; '.join(counts)}.")
    return f"{intro}\n\n{table(PAGE_HEAD, rows)}"
