"""How a cycle was decided, in dollars."""

from typing import NamedTuple

import numpy as np

from navstack.control.decision import (
    RUNNER_UP,
    SLOWER,
    Alternative,
    CriticScore,
    DecisionRecord,
    Option,
)
from navstack.control.expected_cost.motion_cost import TERMS, Scene, V, Y, price_one
from navstack.control.expected_cost.motions import name_of
from navstack.types import FloatArray, Twist2D

NAME = "ExpectedCostController"
_SHOWN = 4  # motions, each of another kind
_EVERY = 3  # states of a motion are drawn


class Cycle(NamedTuple):
    """One control cycle."""

    stamp: float  # [s]
    scene: Scene
    motions: FloatArray  # (M, FIELDS) that were compared
    chosen: FloatArray  # (FIELDS,)
    command: Twist2D


def record(cycle: Cycle) -> DecisionRecord:
    """The decision.

    Its scores are the chosen motion's terms [USD], its status says what kind of motion that is.
    """
    total, scores, _ = _priced(cycle.chosen, cycle.scene)
    kind = name_of(cycle.chosen)
    return DecisionRecord(
        cycle.stamp, NAME, cycle.command, len(cycle.motions), 0, total, scores, kind
    )


def alternatives(cycle: Cycle) -> tuple[Alternative, ...]:
    """The cheapest motion of another kind, and the cheapest that is at most half as fast one step from now.

    They may be cheaper by less than what changing the motion under way takes (``switch_usd``, ``switch_share``).
    """
    priced = [(*_priced(motion, cycle.scene), name_of(motion)) for motion in cycle.motions]
    _, _, first = _priced(cycle.chosen, cycle.scene)
    others = {
        RUNNER_UP: [each for each in priced if each[3] != name_of(cycle.chosen)],
        SLOWER: [each for each in priced if abs(each[2].linear_x) <= 0.5 * abs(first.linear_x)],
    }
    best = {kind: min(found, key=lambda each: each[0]) for kind, found in others.items() if found}
    return tuple(
        Alternative(kind, command, total, scores)
        for kind, (total, scores, command, _) in best.items()
    )


def options(cycle: Cycle) -> tuple[Option, ...]:
    """The chosen motion, and the cheapest of other kinds, with the way that each takes."""
    scene, terms, states = cycle.scene, np.empty(len(TERMS)), np.empty((len(cycle.scene.care), 7))
    totals = [price_one(motion, scene, terms, states) for motion in cycle.motions]
    kinds = {name_of(cycle.chosen): cycle.chosen}
    for k in np.argsort(totals, kind="stable").tolist():
        kinds.setdefault(name_of(cycle.motions[k]), cycle.motions[k])
    found = []
    for motion in list(kinds.values())[:_SHOWN]:
        total = price_one(motion, scene, terms, states)
        way = np.concatenate((scene.start[np.newaxis, : Y + 1], states[::_EVERY, : Y + 1]))
        found.append(Option(float(total), way))
    return tuple(found)


def _priced(motion: FloatArray, scene: Scene) -> tuple[float, tuple[CriticScore, ...], Twist2D]:
    """A motion's cost [USD], its terms, and its velocity after the first step."""
    terms, states = np.empty(len(TERMS)), np.empty((len(scene.care), 7))
    total = price_one(motion, scene, terms, states)
    scores = tuple(
        CriticScore(name, usd, usd, 0) for name, usd in zip(TERMS, terms.tolist(), strict=True)
    )
    return float(total), scores, Twist2D(float(states[0, V]), 0.0, float(states[0, V + 1]))
