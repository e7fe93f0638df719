"""Meetings drawn from a recorded crowd by Palm's law.

A meeting is a passing: somebody is as far along the way as the robot. At a random moment of a
stationary crowd the people along the way are those whom a standing robot would see there; a robot
that drives v along the way passes those who walk u along it |v - u| / v times as often a metre.
"""

from dataclasses import dataclass

import numpy as np

from harness.meetings.crowd import STEP, Record
from harness.meetings.strata import MISSES, STRATA, strata_of
from harness.meetings.way import Way
from navstack.types import FloatArray, IntArray

EVERY = 5  # steps of the record between the moments that are looked at
# [s] of the record that a meeting needs around its moment; who makes way goes on without one
BEFORE, AFTER = 14.0, 90.0
USUAL_SPEED = 1.9  # [m/s] of a robot; it decides how many are driven, never what they come to
LEAST_RATE = 0.25  # passings a metre per person; also samples people who walk along with the robot


@dataclass(frozen=True, slots=True, eq=False)
class Pool:
    """The n candidate meetings: each person near the way at each sampled moment."""

    moments: IntArray  # (n,) of the record
    persons: IntArray  # (n,)
    points: IntArray  # (n,) of the way
    along: FloatArray  # (n,) [m/s] of the person along the way
    strata: IntArray  # (n,)
    looked_at: int  # moments

    @property
    def usual(self) -> FloatArray:
        """Passings per delivery that each stands for at a usual speed, shape (n,)."""
        rates = np.maximum(np.abs(1.0 - self.along / USUAL_SPEED), LEAST_RATE)
        found: FloatArray = rates / self.looked_at
        return found

    @property
    def usual_by_stratum(self) -> FloatArray:
        """Their sums, shape (strata,)."""
        return np.bincount(self.strata, self.usual, len(STRATA)).astype(np.float64)


@dataclass(frozen=True, slots=True)
class Meeting:
    """Somebody whom the robot is to pass, among all others of that moment."""

    moment: int  # of the record
    person: int
    point: int  # of the way
    along: float  # [m/s] of the person along the way
    stratum: int
    weight: float  # of the sample, to be multiplied by the robot's passings a metre per person


def pool_of(record: Record, way: Way, ends: float, before: float = BEFORE) -> Pool:
    """The candidate meetings of a record: people near a way, moment by moment.

    Args:
        record: of a stationary crowd.
        way: of the robot.
        ends: [m] before the way's end at which a delivery is over.
        before: [s] of the record that a meeting needs before its moment.
    """
    last = record.span
    if not record.walkers:
        last -= round(AFTER / STEP)
    moments = np.concatenate(
        [
            np.arange(beginning + round(before / STEP), beginning + last, EVERY)
            for beginning in range(0, len(record.states), record.span)
        ]
    )
    moments = moments[moments < len(record.states)]
    states = record.states[moments].reshape(-1, 4)
    points, misses = way.nearest(states[:, :2])
    # at the first point are those behind it, whom nobody passes
    last_point = way.point_before_end(ends)
    near = np.flatnonzero((misses < MISSES[-1]) & (points > 0) & (points < last_point))
    along = (states[near, 2:] * way.directions[points[near]]).sum(axis=1)
    return Pool(
        moments=moments[near // record.people],
        persons=near % record.people,
        points=points[near],
        along=along,
        strata=strata_of(misses[near], along),
        looked_at=len(moments),
    )


def drawn(
    pool: Pool, spreads: FloatArray, per_meeting: float, rng: np.random.Generator
) -> list[Meeting]:
    """Meetings, the more of a stratum the more its costs spread (Neyman 1934).

    Systematic sampling over the pool in the order of strata, persons and moments: moments of one
    passing lie side by side, so that hardly two of them are drawn.

    Args:
        pool: of all meetings.
        spreads: [USD] of each stratum, above 0, shape (strata,).
        per_meeting: [USD] of the sum of passings times spread that each meeting stands for.
        rng: of the beginning.
    """
    order = np.lexsort((pool.moments, pool.persons, pool.strata))
    usual, strata = pool.usual[order], pool.strata[order]
    sums = np.cumsum(usual * spreads[strata])
    if not len(sums):
        return []
    marks = np.arange(rng.uniform(0.0, per_meeting), sums[-1], per_meeting)
    chosen = np.searchsorted(sums, marks, side="right")
    return [
        Meeting(
            moment=int(pool.moments[number]),
            person=int(pool.persons[number]),
            point=int(pool.points[number]),
            along=float(pool.along[number]),
            stratum=int(pool.strata[number]),
            weight=per_meeting
            / float(spreads[pool.strata[number]] * pool.usual[number] * pool.looked_at),
        )
        for number in order[chosen].tolist()
    ]
