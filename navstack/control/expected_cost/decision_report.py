"""How a cycle was decided, in dollars."""

from typing import NamedTuple

import numpy as np

from navstack.control.contact_risk import OMEGA, V, Y
from navstack.control.decision import (
    RUNNER_UP,
    SLOWER,
    Alternative,
    CriticScore,
    DecisionRecord,
    Option,
)
from navstack.control.expected_cost.motion_cost import (
    TERMS,
    MotionScene,
    price_each,
    price_one,
)
from navstack.control.expected_cost.motions import name_of
from navstack.types import FloatArray, Twist2D

NAME = "ExpectedCostController"
_SHOWN = 4  # motions, each of another kind
_EVERY = 3  # states of a motion are drawn


class Cycle(NamedTuple):
    """One control cycle."""

    stamp: float  # [s]
    scene: MotionScene
    motions: FloatArray  # (M, FIELDS) that were compared
    chosen: FloatArray  # (FIELDS,)
    command: Twist2D


def record(cycle: Cycle) -> DecisionRecord:
    """The decision; scores are the chosen motion's terms [USD], the status its kind."""
    chosen = _priced(cycle.chosen, cycle.scene)
    return DecisionRecord(
        cycle.stamp,
        NAME,
        cycle.command,
        samples=len(cycle.motions),
        total=chosen.total,
        scores=chosen.scores,
        status=chosen.kind,
    )


def alternatives(cycle: Cycle) -> tuple[Alternative, ...]:
    """The cheapest motion of another kind, and the cheapest at most half as fast after a step.

    They may be cheaper by less than what changing the motion under way takes (``switch_usd``,
    ``switch_share``).
    """
    chosen = _priced(cycle.chosen, cycle.scene)
    half = 0.5 * abs(chosen.command.linear_x)
    totals, speeds = _prices(cycle)
    best: dict[str, _Priced] = {}
    for k in np.argsort(totals, kind="stable").tolist():
        motion = cycle.motions[k]
        if RUNNER_UP not in best and name_of(motion) != chosen.kind:
            best[RUNNER_UP] = _priced(motion, cycle.scene)
        if SLOWER not in best and abs(speeds[k]) <= half:
            best[SLOWER] = _priced(motion, cycle.scene)
        if len(best) == len((RUNNER_UP, SLOWER)):
            break
    return tuple(
        Alternative(kind, best[kind].command, best[kind].total, best[kind].scores)
        for kind in (RUNNER_UP, SLOWER)
        if kind in best
    )


def options(cycle: Cycle) -> tuple[Option, ...]:
    """The chosen motion, and the cheapest of other kinds, with the way that each takes."""
    scene = cycle.scene
    terms = np.empty(len(TERMS))
    states = np.empty((len(cycle.scene.care), 7))
    kinds = {name_of(cycle.chosen): cycle.chosen}
    totals, _ = _prices(cycle)
    for k in np.argsort(totals, kind="stable").tolist():
        kind = name_of(cycle.motions[k])
        if kind not in kinds:
            kinds[kind] = cycle.motions[k]
        if len(kinds) == _SHOWN:
            break
    found = []
    for motion in kinds.values():
        total = price_one(motion, scene, terms, states)
        way = np.concatenate((scene.start[np.newaxis, : Y + 1], states[::_EVERY, : Y + 1]))
        found.append(Option(float(total), way))
    return tuple(found)


def _prices(cycle: Cycle) -> tuple[FloatArray, FloatArray]:
    """Cost (M,) [USD] and speed after a step (M,) [m/s] of each motion that was compared."""
    totals = np.empty(len(cycle.motions))
    speeds = np.empty(len(cycle.motions))
    price_each(np.ascontiguousarray(cycle.motions), cycle.scene, totals, speeds)
    return totals, speeds


class _Priced(NamedTuple):
    """What is said of one motion."""

    kind: str
    total: float  # [USD]
    scores: tuple[CriticScore, ...]  # [USD]
    command: Twist2D  # its velocity after the first step


def _priced(motion: FloatArray, scene: MotionScene) -> _Priced:
    terms = np.empty(len(TERMS))
    states = np.empty((len(scene.care), 7))
    total = price_one(motion, scene, terms, states)
    scores = tuple(
        CriticScore(name, usd, usd, 0) for name, usd in zip(TERMS, terms.tolist(), strict=True)
    )
    command = Twist2D(float(states[0, V]), 0.0, float(states[0, OMEGA]))
    return _Priced(name_of(motion), float(total), scores, command)
