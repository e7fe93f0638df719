"""Driven deliveries as legs that longer ways are made of."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from harness.economics.accountings import PUBLISHED, accounted
from harness.economics.cost_model import price
from harness.economics.measured import Measured
from harness.economics.price import Price
from harness.economics.prices import Prices
from harness.economics.rates import NEEDS_PEOPLE
from harness.economics.valuation import column, deliveries, has_too_few, missions
from harness.metrics.columns import LEG_COLUMNS, Row
from harness.metrics.contacts import PRICED_PROPERTY
from harness.statistics.bootstrap import IntArray
from harness.storage.rows import Rows, values
from harness.storage.tables import read_rows
from harness.study.stored_run import StoredRun, leg_file, repriced, require_different
from harness.world.outcome import Outcome
from navstack.errors import InputError
from navstack.types import FloatArray

M_PER_KM = 1000.0
WH_PER_KWH = 1000.0
# what contacts come to, by field of Measured
CONTACTS = (
    "pedestrian_injury_usd_per_run",
    *(f"{kind}_contacts" for kind in PRICED_PROPERTY),
    "other_property_usd",
)


@dataclass(frozen=True, slots=True, eq=False)
class Legs:
    """Legs driven among as many people; arrays have one entry per leg."""

    people: float  # that walked about
    seconds: FloatArray  # [s]
    energy: FloatArray  # [Wh] drawn from the battery to move
    progress: FloatArray  # [km] by which the goal came closer along the shortest path
    distance: FloatArray  # [km] driven
    contacts: FloatArray  # shape (n, k), columns as CONTACTS
    is_spoiled: npt.NDArray[np.bool_]
    is_late: npt.NDArray[np.bool_]  # timeout: lost or stuck, an operator helps from afar
    is_failed: npt.NDArray[np.bool_]  # physical assistance: somebody has to come
    clusters: IntArray  # number of each leg's mission

    @property
    def mean_progress(self) -> float:
        """Of a leg after which the robot goes on [km]."""
        going = self.progress[~self.is_failed]
        if not going.size:
            return float(self.progress.mean())
        return float(going.mean())

    def taken(self, numbers: IntArray) -> "Legs":
        """Some of the legs, in this order."""
        arrays = {
            entry.name: getattr(self, entry.name)[numbers]
            for entry in dataclasses.fields(self)
            if entry.name != "people"
        }
        return Legs(self.people, **arrays)

    def resampled(self, rng: np.random.Generator) -> "Legs":
        """As many missions drawn with replacement, each with all of its legs."""
        count = int(self.clusters.max()) + 1
        drawn = rng.integers(0, count, count)
        order = np.argsort(self.clusters, kind="stable")
        bounds = np.searchsorted(self.clusters[order], np.arange(count + 1))
        numbers = [order[bounds[mission] : bounds[mission + 1]] for mission in drawn]
        return self.taken(np.concatenate(numbers))


@dataclass(frozen=True, slots=True, eq=False)
class Library:
    """The legs of one stack."""

    name: str
    groups: tuple[Legs, ...]  # by number of people, rising
    capex_usd: float  # [USD/robot]
    has_cargo: bool  # whether it was simulated; else nothing is spoiled
    folders: str = ""  # of its runs, where another library is of a stack of the same name

    @property
    def title(self) -> str:
        """How it is called on screen and page."""
        if self.folders:
            return f"{self.folders}:{self.name}"
        return self.name

    @property
    def size(self) -> int:
        """Number of legs."""
        return sum(len(group.seconds) for group in self.groups)

    def group_at(self, crowd: float) -> int:
        """Number of the group whose people are nearest to ``crowd`` of the busiest one's."""
        wanted = crowd * self.groups[-1].people
        return int(np.argmin([abs(group.people - wanted) for group in self.groups]))

    def resampled(self, seed: Sequence[int]) -> "Library":
        """The bootstrap of missions; same seed, same missions of libraries that have the same."""
        groups = tuple(
            group.resampled(np.random.default_rng([*seed, number]))
            for number, group in enumerate(self.groups)
        )
        return dataclasses.replace(self, groups=groups)


def library_of(runs: Sequence[StoredRun], prices: Prices) -> Library:
    """The legs of finished runs of one stack, e.g. among different numbers of people.

    Raises:
        InputError: several stacks, a run that :func:`_require_legs` refuses, legs that are missing,
            or no delivery came any closer to its goal.
    """
    names = dict.fromkeys(stack.name for run in runs for stack in run.stacks)
    if len(names) > 1:
        raise InputError(
            f"the legs are of {len(names)} stacks ({', '.join(names)}); choose one as FOLDER:stack"
        )
    _require_legs(runs)
    by_people: dict[float, list[Legs]] = {}
    for run in runs:
        by_people.setdefault(_people_of(run), []).append(_legs(run, prices))
    groups = tuple(_joined(by_people[people]) for people in sorted(by_people))
    for group in groups:
        if not group.mean_progress > 0.0:  # also NaN
            raise InputError("no leg comes closer to its goal; no delivery can be made of them")
    stack = runs[0].stacks[0]
    outcomes = {outcome for run in runs for outcome in values(run.stacks[0].rows, "outcome")}
    capex = price(_of_nothing(), stack.carries, stack.data_collection, prices).capex_usd
    return Library(stack.name, groups, capex, "arrived" not in outcomes)


def notes_on(library: Library, way: Price) -> list[str]:
    """What a library's legs cannot tell of days with ways of some lengths."""
    notes = []
    shortest = way.value if way.low is None else way.low
    leg = max(group.mean_progress for group in library.groups)
    if shortest < leg:
        notes.append(
            f"a leg of {library.title} is {leg:.2g} km long; ways that are shorter, down to "
            f"{shortest:g} km, count as one"
        )
    groups = library.groups
    lost = sum(int((each.is_failed | each.is_late | each.is_spoiled).sum()) for each in groups)
    if not lost and not any(each.contacts.any() for each in groups):
        notes.append(
            f"none of the {library.size} legs of {library.title} was lost or cost anything; the "
            "brackets admit no loss that nobody has seen, as those of navbench price do"
        )
    return notes


def _require_legs(runs: Sequence[StoredRun]) -> None:
    """Check that each run has legs of its own.

    Raises:
        InputError: a run is given twice, has no finished delivery, or too many without a result.
    """
    require_different(runs)
    for run in runs:
        if not run.stacks or not run.stacks[0].rows:
            raise InputError(f"{run.folder} has no finished delivery; legs are made of these")
        finished, errors = len(run.stacks[0].rows), run.stacks[0].errors
        if has_too_few(finished, errors):
            raise InputError(
                f"{run.folder}: {errors} of {finished + errors} deliveries have no result, which "
                "may be those that matter; drive them again with navbench run --resume DIR "
                "--retry-errors"
            )


def _in_legs(run: StoredRun) -> tuple[StoredRun, IntArray]:
    """A run on a district with legs for deliveries; and each one's mission.

    On a map the deliveries are the legs.

    Raises:
        InputError: the legs of a mission are missing.
    """
    if not run.has_legs:
        return run, missions(run.stacks[0].rows)
    stack, rows, events = run.stacks[0], Rows(LEG_COLUMNS), list[Row]()
    clusters: list[int] = []
    for mission, row in enumerate(stack.rows):
        file = leg_file(run.folder, row)
        if not file.is_file():
            raise InputError(
                f"{file} is missing, a mission's legs; give the run folder with all of its "
                "recordings, or drive it again"
            )
        first, legs = len(rows), read_rows(file, LEG_COLUMNS)
        begins = legs.values("begin_s")
        for event in run.events:
            if (event["stack"], event["episode"]) == (row["stack"], row["episode"]):
                # one at the end of a leg is of this leg
                leg = max(int(np.searchsorted(begins, event["stamp_s"])) - 1, 0)
                events.append({**event, "episode": first + leg})
        for leg_row in legs:
            rows.append({**leg_row, "episode": len(rows)})
            clusters.append(mission)
    driven = dataclasses.replace(stack, rows=rows)
    return dataclasses.replace(run, stacks=(driven,), events=events), np.array(clusters)


def _of_nothing() -> Measured:
    """Of no delivery: hardware is priced without."""
    return Measured(None, None, *[0.0] * 9)


def _people_of(run: StoredRun) -> float:
    people = run.condition("world").get("people") or {}
    return float(people.get("count", 0))


def _legs(run: StoredRun, prices: Prices) -> Legs:
    run, clusters = _in_legs(run)
    stack = repriced(run.stacks[0], run.events, prices)
    rows = stack.rows
    measured = deliveries(rows, prices.rolling_resistance_force)
    if prices.accounting != PUBLISHED:
        measured = accounted(measured, rows, run.events, prices.accounting, prices)
    efficiency = prices.inverter_efficiency.value * prices.motor_efficiency.value
    at_wheels = column(rows, "motion_energy_kwh")
    published = column(rows, "published_energy_kwh")
    energy = np.where(np.isnan(at_wheels), published, at_wheels)
    outcomes = np.array(values(rows, "outcome"))
    return Legs(
        people=_people_of(run),
        seconds=column(rows, "duration_s"),
        energy=energy * WH_PER_KWH / efficiency,
        progress=_progress(rows, outcomes) / M_PER_KM,
        distance=column(rows, "distance_m") / M_PER_KM,
        contacts=_contacts(measured, len(rows)),
        is_spoiled=outcomes == Outcome.SPOILED.value,
        is_late=outcomes == Outcome.TIMEOUT.value,
        is_failed=outcomes == Outcome.PHYSICAL_ASSISTANCE.value,
        clusters=clusters,
    )


def _progress(rows: Sequence[Row], outcomes: npt.NDArray[np.str_]) -> FloatArray:
    """How much closer each robot came to its goal [m]; all of the way where it arrived."""
    whole, left = column(rows, "shortest_path_m"), column(rows, "goal_distance_m")
    is_short = np.isin(outcomes, NEEDS_PEOPLE)
    progress: FloatArray = np.maximum(whole - np.where(is_short, left, 0.0), 0.0)
    return progress


def _contacts(each: Measured, count: int) -> FloatArray:
    """What contacts come to, shape (count, k); what the world does not have is never hit."""
    columns: list[Any] = [getattr(each, name) for name in CONTACTS]
    known = [0.0 if found is None else found for found in columns]
    return np.column_stack([np.broadcast_to(found, count) for found in known])


def _joined(parts: Sequence[Legs]) -> Legs:
    """The legs of several runs; missions of different runs are different."""
    arrays: dict[str, Any] = {
        entry.name: np.concatenate([getattr(part, entry.name) for part in parts])
        for entry in dataclasses.fields(Legs)
        if entry.name not in ("people", "clusters")
    }
    firsts = np.cumsum([0, *(int(part.clusters.max()) + 1 for part in parts[:-1])])
    clusters = [part.clusters + first for part, first in zip(parts, firsts, strict=True)]
    return Legs(parts[0].people, clusters=np.concatenate(clusters), **arrays)
