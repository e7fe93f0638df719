"""Do racing and the final choice save episodes without costing quality?

A made-up world with a known optimum: five parameters, of which each has a best value; the farther off they are, the
more contacts happen. A contact costs 31 to 49 USD, one in a hundred 1000 USD, and a delivery without any earns
3.49 USD: the order of CostNav's prices. Missions have easy and hard places in common for all candidates (common random
numbers), and chance of their own for each, as a small change of a real robot's file leads to other encounters. The true
mean margin of every candidate is known without drawing anything. A study that drives all trials on all of its missions
stands beside a raced one on fewer, whose best trials meet again in the final choice.

Run: python benchmarks/check_racing.py [--seeds 20] [--trials 100] [--missions 64] [--raced-missions 32]
           [--finalists 4] [--final-episodes 128] [--sampler tpe] [--rate 1.2]
"""

import argparse
import hashlib
import json
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.stats import norm

from harness.metrics import Row
from harness.tuning.evaluation import MARGIN, Candidate
from harness.tuning.finals import decide
from harness.tuning.objective import parse_objectives
from harness.tuning.racing import stratified
from harness.tuning.sampler import make_sampler
from harness.tuning.search import Plan, Search
from harness.tuning.space import Parameter, Space
from navstack.types import FloatArray

BEST = (0.3, 0.7, 0.45, 0.6, 0.5)  # of each parameter, in 0..1
SPACE = Space("made-up", "", tuple(Parameter(f"p{i}", (f"p{i}",), 0.05, 0.0, 1.0) for i in range(len(BEST))))
LEAST_RATE, MORE_RATE = 0.05, 1.2  # contacts per delivery at the optimum, and beyond per squared distance (--rate)
PLACES = 4  # per mission, where a contact may happen
EARNED, CONTACT, DISASTER, DISASTERS = 3.49, (31.0, 49.0), 1000.0, 0.01  # [USD], [USD], [USD], share of contacts
SHARED = 0.6  # correlation of a place's danger between candidates
ALLOWED_GAP, ALLOWED_SHARE = 2.0, 0.4  # [USD/run] and episodes of the unraced study


def contact_rate(point: FloatArray, more: float) -> float:
    """Chance of a contact at an average place."""
    distance = float(((point - np.array(BEST)) ** 2).sum())
    return min((LEAST_RATE + more * distance) / PLACES, 0.9)


def true_margin(point: FloatArray, more: float) -> float:
    """Expected margin [USD/run]."""
    cost = (1.0 - DISASTERS) * sum(CONTACT) / 2.0 + DISASTERS * DISASTER
    return EARNED - PLACES * contact_rate(point, more) * cost


def point_of(candidate: Candidate) -> FloatArray:
    """The parameters of a candidate, shape (5,)."""
    return np.array([candidate.values.get(each.name, each.original) for each in SPACE.parameters], dtype=np.float64)


class MadeUpWorld:
    """An evaluator that counts what it drives."""

    def __init__(self, seed: int, more: float) -> None:
        self._seed, self._more = seed, more
        self._known: dict[tuple[object, int], float] = {}

    @property
    def episodes(self) -> int:
        """Driven so far."""
        return len(self._known)

    def rows(self, candidate: Candidate, missions: Sequence[int]) -> list[Row]:
        """As :class:`harness.tuning.evaluation.Evaluator` has it."""
        return [{MARGIN: self._margin(candidate, mission)} for mission in missions]

    def _margin(self, candidate: Candidate, mission: int) -> float:
        key = (candidate.key, mission)
        if key not in self._known:
            shared = np.random.default_rng((self._seed, mission))
            digest = hashlib.sha256(json.dumps([candidate.key, mission, self._seed]).encode()).digest()
            own = np.random.default_rng(int.from_bytes(digest[:8], "little"))
            danger = SHARED * shared.standard_normal(PLACES) + np.sqrt(1.0 - SHARED**2) * own.standard_normal(PLACES)
            happens = danger > norm.isf(contact_rate(point_of(candidate), self._more))
            costs = np.where(own.random(PLACES) < DISASTERS, DISASTER, own.uniform(*CONTACT, PLACES))
            self._known[key] = EARNED - float(costs[happens].sum())
        return self._known[key]


@dataclass(frozen=True, slots=True)
class Outcome:
    """What one study came to."""

    before: float  # [USD/run] true mean margin of the search's incumbent
    quality: float  # [USD/run] of what the final choice took
    episodes: int
    trials_to_end: int  # trials that drove every mission


def study(seed: int, missions: int, asked: argparse.Namespace, is_raced: bool) -> Outcome:
    """One study in the world of a seed; a raced one ends with a final choice."""
    world = MadeUpWorld(seed, asked.rate)
    order = stratified({mission: float(mission) for mission in range(missions)}, seed)
    plan = Plan(SPACE, parse_objectives("margin"), order, asked.trials, is_raced)
    sampler = make_sampler(asked.sampler, SPACE, seed, asked.trials, 1)
    search = Search(plan, sampler, world, lambda trial, incumbent: None)
    search.run()
    complete = sum(trial.state == "complete" for trial in search.trials)
    best, further = search.incumbent.candidate, range(missions, missions + asked.final_episodes)
    finals = decide(search.trials, asked.finalists if is_raced else 0, further, plan.objectives[0], world)
    chosen = finals[0].candidate if finals else best
    before, quality = (true_margin(point_of(each), asked.rate) for each in (best, chosen))
    return Outcome(before, quality, world.episodes, complete)


def mean_and_error(gaps: Sequence[float]) -> tuple[float, float]:
    """Mean and its standard error."""
    return float(np.mean(gaps)), float(np.std(gaps, ddof=1) / np.sqrt(len(gaps)))


def main() -> int:
    """Compare raced and unraced studies; 0 if racing keeps its promise."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    numbers = {"seeds": 20, "trials": 100, "missions": 64, "raced-missions": 32, "finalists": 4, "final-episodes": 128}
    for name, default in numbers.items():
        parser.add_argument(f"--{name}", type=int, default=default)
    parser.add_argument("--sampler", default="tpe")
    parser.add_argument("--rate", type=float, default=MORE_RATE)
    arguments = parser.parse_args()
    table = Table("seed", "unraced USD/run", "raced", "and chosen", "gap", "episodes", "raced", "share", "to the end")
    gaps, before, shares = [], [], []
    began = time.process_time()
    for seed in range(arguments.seeds):
        plain = study(seed, arguments.missions, arguments, is_raced=False)
        raced = study(seed, arguments.raced_missions, arguments, is_raced=True)
        gaps.append(plain.quality - raced.quality)
        before.append(plain.quality - raced.before)
        shares.append(raced.episodes / plain.episodes)
        numbers = (f"{plain.quality:.2f}", f"{raced.before:.2f}", f"{raced.quality:.2f}", f"{gaps[-1]:+.2f}")
        table.add_row(
            str(seed), *numbers, str(plain.episodes), str(raced.episodes), f"{shares[-1]:.0%}", str(raced.trials_to_end)
        )
    console = Console(width=120)
    console.print(table)
    gap, error = mean_and_error(gaps)
    best, original = (true_margin(each, arguments.rate) for each in (np.array(BEST), point_of(Candidate("", {}))))
    console.print(f"optimum {best:.2f} USD/run, original {original:.2f}")
    console.print(f"gap {gap:+.2f} USD/run (standard error {error:.2f}; allowed {ALLOWED_GAP:g})")
    console.print("without the final choice {:+.2f} (standard error {:.2f})".format(*mean_and_error(before)))
    console.print(f"episodes {np.mean(shares):.0%} of the unraced study's (allowed {ALLOWED_SHARE:.0%})")
    console.print(f"{time.process_time() - began:.0f} s of CPU time")
    return 0 if gap <= ALLOWED_GAP and np.mean(shares) <= ALLOWED_SHARE else 1


if __name__ == "__main__":
    sys.exit(main())
