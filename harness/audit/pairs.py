"""Deliveries of two stacks on the same missions, as arrays that the auditor compares."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from harness.audit.findings import LEAST_PAIRS, AuditEvidence
from harness.economics.accountings import ACCOUNTINGS, EVENT, PERSON, PUBLISHED, ROBOT_MOVED
from harness.economics.prices import Prices
from harness.economics.valuation import CENT, column, margins, missions
from harness.metrics.columns import Row
from harness.metrics.contacts import PRICED_PROPERTY
from harness.statistics.bootstrap import IntArray, number_clusters
from harness.statistics.paired import compare_pairs
from harness.world.outcome import Outcome
from navstack.types import BoolArray, FloatArray

MONEY, SHARE = "USD/run", "share"  # units
EVENTS = "events"  # column that an audited row has besides: its rows of events.parquet, a list
# column: share of the time with somebody within 1.2 m; null where nobody was there
NEAR = "personal_intrusion_percent"
FASTEST = 0.9  # quantile of a candidate's mean speeds that stands for driving unhindered
SLOWEST = 0.01  # [m/s] below which that is no driving
BAND = 0.7  # of the threshold from which on a touch that does not count is close to it


@dataclass(frozen=True, slots=True)
class Conditions:
    """What the deliveries of two stacks were driven under, as far as the auditor needs it."""

    # [N s] in one physics step with one partner, from which a contact counts; published
    threshold: float = 50.0
    spoiled_fraction: float = 0.05  # share of the cargo above which food is spoiled; published
    localizers: tuple[str, str] = ("", "")  # names; empty: not known
    has_exact_gps: bool = False  # the second stack's GPS is the true position, as published


class Touches(NamedTuple):
    """Contact events, shape (n,) each."""

    numbers: IntArray  # of the delivery, among a candidate's
    impulses: FloatArray  # [N s]
    steps: FloatArray  # [N s] most of one physics step
    are_robots_fault: BoolArray


@dataclass(frozen=True, slots=True, eq=False)
class PairedSide:
    """One candidate's deliveries; arrays (n,) in the order of the missions."""

    rows: tuple[Row, ...]
    events: tuple[Row, ...] | None  # of all these deliveries; None: nobody kept them

    def column(self, key: str) -> FloatArray:
        """A column; NaN where it is null."""
        return column(self.rows, key)

    def arrived(self, key: str) -> FloatArray:
        """A column; NaN also where the delivery ended without arrival."""
        is_failed = self.ended(Outcome.TIMEOUT) + self.ended(Outcome.PHYSICAL_ASSISTANCE) > 0.0
        return np.where(is_failed, np.nan, self.column(key))

    def ended(self, outcome: Outcome) -> FloatArray:
        """1 where a delivery ended so, else 0."""
        return np.array([row["outcome"] == outcome.value for row in self.rows], dtype=np.float64)

    @property
    def gave_up(self) -> FloatArray:
        """1 where the navigation ended without success, else 0."""
        return np.array([bool(row["gave_up"]) for row in self.rows], dtype=np.float64)

    @property
    def progress(self) -> FloatArray:
        """Share of the shortest path that was covered, by the straight distance left at the end."""
        shortest = np.maximum(self.column("shortest_path_m"), 1e-9)
        share: FloatArray = np.clip(1.0 - self.column("goal_distance_m") / shortest, 0.0, 1.0)
        return share

    @property
    def pace(self) -> FloatArray:
        """Speed [m/s] at which the shortest path was made good."""
        speed: FloatArray = (
            self.progress
            * self.column("shortest_path_m")
            / np.maximum(self.column("duration_s"), 1e-9)
        )
        return speed

    @property
    def standing(self) -> FloatArray:
        """Estimated share of the time at a standstill.

        Of what driving at the candidate's usual speed would not take.

        Rows hold the mean speed, not how it came about; the usual speed is the :data:`FASTEST`
        quantile over the deliveries. A robot that always stands as long as it drives shows in
        :attr:`pace` instead.
        """
        speed = self.column("average_speed_mps")
        usual = float(np.quantile(speed, FASTEST))
        if usual > SLOWEST:
            share: FloatArray = np.clip(1.0 - speed / usual, 0.0, 1.0)
        else:
            share = np.ones_like(speed)
        return share

    def touches(self, of_people: bool) -> Touches:
        """All contact events with people, or all those with property, of any kind and strength."""
        numbers = {row["episode"]: number for number, row in enumerate(self.rows)}
        own = [
            each
            for each in self.events or ()
            if each["type"] == EVENT and (each["kind"] == PERSON) == of_people
        ]
        return Touches(
            np.array([numbers[event["episode"]] for event in own], dtype=np.int64),
            np.array([event["impulse_ns"] for event in own], dtype=np.float64),
            np.array([largest_step(event) for event in own], dtype=np.float64),
            np.array([event["fault"] in ROBOT_MOVED for event in own], dtype=bool),
        )

    def per_delivery(self, numbers: IntArray, weights: FloatArray | None = None) -> FloatArray:
        """How often each delivery's number is among some, or the sum of their weights."""
        return np.bincount(numbers, weights, minlength=len(self.rows)).astype(np.float64)

    def close_touches(self, threshold: float) -> FloatArray:
        """Touches per delivery just too soft to be counted [1/run].

        With events: contact events with people of which no step reaches ``threshold`` [N s], but
        one reaches 0.7 of it, or all impacts together reach it. Without: all contacts that were not
        counted.
        """
        if self.events is None:
            return self.column("soft_contacts")
        all_ = self.touches(of_people=True)
        is_close = (all_.steps < threshold) & (
            (all_.steps >= BAND * threshold) | (all_.impulses >= threshold)
        )
        return self.per_delivery(all_.numbers[is_close])

    @property
    def counted(self) -> FloatArray:
        """Contacts with people that are paid for [1/run]."""
        return self.column("pedestrian_contacts")

    def exchanged(self, with_people: bool) -> FloatArray:
        """Impulse exchanged per delivery [N s/run] in all contacts with people or property."""
        own = self.touches(with_people)
        return self.per_delivery(own.numbers, np.maximum(own.impulses, own.steps))

    def property_usd(self, prices: Prices) -> FloatArray:
        """What is paid for property per delivery [USD/run]."""
        paid = np.zeros(len(self.rows))
        for kind in PRICED_PROPERTY:
            paid += (
                np.nan_to_num(self.column(f"{kind}_contacts"))
                * getattr(prices.property_damage, kind).value
            )
        return paid


@dataclass(frozen=True, slots=True, eq=False)
class Pairs:
    """Original and incumbent on the missions that both finished."""

    original: PairedSide
    incumbent: PairedSide
    clusters: IntArray  # number of each pair's mission
    # of all missions, also unfinished: 1 where there is no result, else 0
    abandoned: tuple[FloatArray, FloatArray]
    prices: Prices
    seed: int  # of resamples

    @property
    def sides(self) -> tuple[PairedSide, PairedSide]:
        """Original and incumbent."""
        return self.original, self.incumbent

    @property
    def n(self) -> int:
        """Number of pairs."""
        return len(self.original.rows)

    @property
    def has_events(self) -> bool:
        """Whether single contacts are known."""
        return all(side.events is not None for side in self.sides)

    @property
    def lacks_people(self) -> bool:
        """Whether on some mission there was nobody to be driven close to."""
        return any(np.isnan(side.column(NEAR)).any() for side in self.sides)

    def compare(
        self,
        what: str,
        unit: str,
        original: FloatArray,
        incumbent: FloatArray,
        clusters: IntArray | None = None,
    ) -> AuditEvidence:
        """Hold deliveries of the incumbent against those of the original.

        Args:
            what: is compared.
            unit: of it; money is alike to a cent.
            original: shape (n,).
            incumbent: shape (n,).
            clusters: number of each pair's mission; None: of the missions that both finished.
        """
        paired = compare_pairs(
            original,
            incumbent,
            self.clusters if clusters is None else clusters,
            np.random.default_rng(self.seed),
            resolution=CENT if unit == MONEY else 0.0,
        )
        return AuditEvidence(
            what,
            unit,
            float(original.mean()),
            float(incumbent.mean()),
            paired.difference,
            paired.p,
        )

    def of(self, what: str, unit: str, column: Callable[[PairedSide], FloatArray]) -> AuditEvidence:
        """The same of what each side has."""
        return self.compare(what, unit, column(self.original), column(self.incumbent))

    def known(
        self,
        what: str,
        unit: str,
        column: Callable[[PairedSide], FloatArray],
    ) -> AuditEvidence | None:
        """The same over the pairs in which both have it; None: these are too few to test."""
        first, second = column(self.original), column(self.incumbent)
        both = ~(np.isnan(first) | np.isnan(second))
        if both.sum() < LEAST_PAIRS:
            return None
        clusters = number_clusters(self.clusters[both].tolist())
        return self.compare(what, unit, first[both], second[both], clusters)

    def margins(self, accounting: str) -> tuple[FloatArray, FloatArray] | None:
        """Each delivery's contribution margin [USD] of both.

        None without pairs, or where the cargo is not modelled.
        """
        if not self.n:
            return None
        before, after = (
            margins(side.rows, self.prices, side.events or (), accounting) for side in self.sides
        )
        if before is None or after is None:
            return None
        return (before, after)

    @property
    def scores(self) -> dict[str, AuditEvidence]:
        """The margin of both by accounting.

        The published one only where nobody kept events, none without a margin.
        """
        found = {
            name: self.margins(name) for name in (ACCOUNTINGS if self.has_events else (PUBLISHED,))
        }
        return {
            name: self.compare(f"margin, accounting {name}", MONEY, *both)
            for name, both in found.items()
            if both is not None
        }


def pair_up(original: Sequence[Row], incumbent: Sequence[Row], prices: Prices, seed: int) -> Pairs:
    """Pair the rows of two candidates, one mission after the other.

    Raises:
        ValueError: other missions, or another number of them.
    """
    if [_delivery(row) for row in original] != [_delivery(row) for row in incumbent]:
        raise ValueError("rows of different missions cannot be paired")
    lost = tuple(
        np.array([has_error(row) for row in rows], dtype=np.float64)
        for rows in (original, incumbent)
    )
    both: BoolArray = (lost[0] + lost[1]) == 0.0
    sides = [
        _side([row for row, keep in zip(rows, both, strict=True) if keep])
        for rows in (original, incumbent)
    ]
    return Pairs(sides[0], sides[1], missions(sides[0].rows), (lost[0], lost[1]), prices, seed)


def shares(what: str, before: Sequence[int], after: Sequence[int], p: float) -> AuditEvidence:
    """The share of cases of a kind in two groups, each given as (of the kind, others)."""
    first, second = (part / max(part + rest, 1) for part, rest in (before, after))
    return AuditEvidence.unsampled(what, SHARE, first, second, sum(after), p)


def has_error(row: Row) -> bool:
    """Whether a delivery has no result."""
    return row.get("error") is not None


def largest_step(event: Row) -> float:
    """Most that was exchanged in one physics step [N s]; the whole impulse where nobody kept it."""
    peak = event.get("peak_step_impulse_ns")
    return float(event["impulse_ns"] if peak is None else peak)


def _delivery(row: Row) -> tuple[int | None, int]:
    return row.get("seed"), row["episode"]


def _side(rows: Sequence[Row]) -> PairedSide:
    """One candidate's finished deliveries with their events."""
    if any(row.get(EVENTS) is None for row in rows):
        return PairedSide(tuple(rows), None)
    owned = (
        {**event, "stack": row["stack"], "episode": row["episode"]}
        for row in rows
        for event in row[EVENTS]
    )
    return PairedSide(tuple(rows), tuple(owned))
