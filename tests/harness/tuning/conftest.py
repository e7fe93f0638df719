"""A made-up world in which what each parameter is worth is known, and studies in it."""

import importlib
import math
from collections.abc import Callable, Mapping, Sequence
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from harness.audit.pairs import EVENTS
from harness.economics.prices import load_prices
from harness.metrics.columns import Row
from harness.tuning.evaluation import (
    MARGIN,
    Candidate,
    Value,
    seed_and_episode,
    unseen_missions,
)
from harness.tuning.result import COMPLETE, PRUNED, StudyResult, Trial
from harness.tuning.space.space import Parameter, Space
from harness.tuning.stack_evaluator import margin_of

SEED = 7
SPACE = Space(
    "made-up",
    "A made-up controller",
    (
        Parameter(
            "clearance",
            ("controller_server.FollowPath.clearance",),
            0.2,
            0.05,
            1.0,
            is_log=True,
            unit="m",
        ),
        Parameter("horizon", ("controller_server.FollowPath.horizon",), 1.0, 0.5, 3.0, unit="s"),
        Parameter(
            "speed",
            ("controller_server.FollowPath.max_vel_x", "velocity_smoother.max"),
            2.0,
            0.5,
            2.5,
        ),
        Parameter("samples", ("controller_server.FollowPath.samples",), 20, 5.0, 40.0, is_int=True),
        Parameter("stop", ("collision_monitor.stop",), "off", choices=("off", "slow", "stop")),
        Parameter("idle", ("controller_server.FollowPath.idle",), 0.5, 0.0, 1.0),
    ),
)
TUNED: dict[str, Value] = {
    "clearance": 0.5,
    "horizon": 2.0,
    "speed": 1.8,
    "samples": 30,
    "stop": "slow",
    "idle": 0.7,
}


@pytest.fixture(scope="session")
def auditor_studies() -> ModuleType:
    """The benchmark that plants exploits, and what it imports from beside it."""
    return importlib.import_module("tools.auditor_studies")


def touch_rate(point: Mapping[str, Value]) -> float:
    """Hard touches per delivery: more clearance and a longer horizon help.

    Both together help more than each alone.
    """
    clear, far = math.log(float(point["clearance"]) / 0.2), float(point["horizon"]) - 1.0
    rate = 0.35 - 0.16 * clear + 0.05 * (clear - 0.9) ** 2 - 0.06 * far - 0.05 * far * clear
    return min(max(rate + 0.05 * (point["stop"] == "off"), 0.01), 0.9)


class MadeUpEvaluator:
    """Drives nothing: touches come where a mission's own number lies below the candidate's rate."""

    def __init__(self, module: ModuleType) -> None:
        self._module, self._prices = module, load_prices("costnav")
        self.driven: list[tuple[str, int]] = []  # candidate and mission of every delivery
        self._known: dict[tuple[Any, int], Row] = {}

    def rows(self, candidate: Candidate, missions: Sequence[int]) -> list[Row]:
        """As the evaluator's protocol has it; common random numbers over candidates."""
        for mission in missions:
            if (candidate.key, mission) not in self._known:
                self.driven.append((candidate.name, mission))
                self._known[candidate.key, mission] = self._drive(candidate, mission)
        return [
            {**self._known[candidate.key, mission], "stack": candidate.name} for mission in missions
        ]

    def _drive(self, candidate: Candidate, mission: int) -> Row:
        point = dict(SPACE.original)
        for parameter in SPACE.parameters:
            point[parameter.name] = candidate.values.get(parameter.paths[0], parameter.original)
        seed, episode = seed_and_episode(SEED, mission)
        rng = np.random.default_rng((seed, episode))
        row = self._module._drawn_row(
            rng,
            episode,
            float(rng.uniform(20.0, 190.0)),
            float(point["speed"]),
            0.0,
            1.0,
        )
        lot, strength = rng.random(), float(rng.uniform(60.0, 120.0))
        if lot < touch_rate(point):
            row[EVENTS] = [self._module.new_event(self._module.PERSON, strength, 0.85 * strength)]
        self._module.settle(row, self._prices)
        row |= {"seed": seed, "recoveries": 0, "pieces_lost": 0, "pieces_at_start": 50}
        return {**row, MARGIN: margin_of(row, self._prices)}


@pytest.fixture(scope="session")
def evaluator(auditor_studies: ModuleType) -> MadeUpEvaluator:
    """An evaluator in the made-up world."""
    return MadeUpEvaluator(auditor_studies)


@pytest.fixture(scope="session")
def make_study(evaluator: MadeUpEvaluator) -> Callable[..., StudyResult]:
    """Make a finished study: random trials, and a tuned point that is good."""

    def make(
        trials: int = 60,
        train: int = 40,
        test: int = 200,
        tuned: Mapping[str, Value] = TUNED,
    ) -> StudyResult:
        rng = np.random.default_rng(SEED)
        train_missions, test_missions = tuple(range(train)), unseen_missions(test)
        points = [
            SPACE.original,
            *(_random_point(rng) for _ in range(trials - 2)),
            dict(SPACE.original) | dict(tuned),
        ]
        found = []
        for number, point in enumerate(points):
            name = f"trial-{number}" if number else "original"
            candidate = Candidate(name, SPACE.values(point))
            count = train if number % 3 == 0 or number == trials - 1 else train // 4
            rows = evaluator.rows(candidate, train_missions[:count])
            value = (float(np.mean([row[MARGIN] for row in rows])),)
            state = COMPLETE if count == train else PRUNED
            found.append(
                Trial(
                    number,
                    candidate,
                    point,
                    state,
                    train_missions[:count],
                    value,
                    value,
                    None,
                    "",
                )
            )
        original, incumbent = (
            Candidate("original", {}),
            Candidate("incumbent", SPACE.values(points[-1])),
        )
        sides = [
            tuple(tuple(evaluator.rows(each, missions)) for each in (original, incumbent))
            for missions in (train_missions, test_missions)
        ]
        return StudyResult(
            original=original,
            incumbent=incumbent,
            objectives=("margin",),
            space=SPACE,
            trials=tuple(found),
            front=(len(found) - 1,),
            seed=SEED,
            train_missions=train_missions,
            test_missions=test_missions,
            train_rows=sides[0],
            test_rows=sides[1] if test else (),
        )

    return make


def _random_point(rng: np.random.Generator) -> dict[str, Value]:
    return {
        "clearance": float(np.exp(rng.uniform(math.log(0.05), 0.0))),
        "horizon": float(rng.uniform(0.5, 3.0)),
        "speed": float(rng.uniform(0.5, 2.5)),
        "samples": int(rng.integers(5, 41)),
        "stop": str(rng.choice(["off", "slow", "stop"])),
        "idle": float(rng.random()),
    }
