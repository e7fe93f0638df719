"""The final choice: halving, the luck of the search, and what it drives."""

import math
from collections.abc import Sequence

import numpy as np

from harness.metrics.columns import Row
from harness.tuning.evaluation import MARGIN, Candidate
from harness.tuning.finals import decide, most_episodes, schedule
from harness.tuning.objective import parse_objectives
from harness.tuning.result import COMPLETE, PRUNED, Trial

MARGIN_ONLY = parse_objectives("margin")[0]
TRAINING = tuple(range(8))
FINAL = range(100, 228)


class Noisy:
    """True margins by trial, and the same rough deliveries for all; a NaN cannot be driven."""

    def __init__(self, truth: dict[str, float], shared: bool = False) -> None:
        self.truth, self.driven, self._shared = truth, set[tuple[str, int]](), shared

    def rows(self, candidate: Candidate, missions: Sequence[int]) -> list[Row]:
        return [self._row(candidate.name, mission) for mission in missions]

    def _row(self, name: str, mission: int) -> Row:
        self.driven.add((name, mission))
        if math.isnan(self.truth[name]):
            return {"error": "its worker died", MARGIN: None}
        seed = (mission,) if self._shared else (mission, *name.encode())
        return {
            "error": None,
            "outcome": "sla",
            MARGIN: self.truth[name] + np.random.default_rng(seed).normal(0.0, 5.0),
        }


def trial(
    number: int,
    value: float,
    state: str = COMPLETE,
    values: dict[str, float] | None = None,
) -> Trial:
    changed = {"node.x": float(number)} if values is None else values
    candidate = Candidate(f"trial-{number}" if number else "original", changed if number else {})
    return Trial(number, candidate, {}, state, TRAINING, (value,), (value,), None, "")


def world(**truth: float) -> Noisy:
    return Noisy({name.replace("_", "-"): margin for name, margin in truth.items()}, shared=True)


def test_rounds_halve_the_field_and_double_the_missions() -> None:
    assert schedule(5, 128) == ((32, 3), (64, 2), (128, 1))
    assert schedule(2, 128) == ((128, 1),) and schedule(8, 4) == ((1, 4), (2, 2), (4, 1))
    assert (
        most_episodes(4, 128) == 128 + 4 * 64 + 2 * 64
        and most_episodes(0, 128) == most_episodes(4, 0) == 0
    )


def test_the_lucky_one_of_the_search_loses() -> None:
    trials = [trial(0, -5.0), trial(1, 3.4), trial(2, 1.0), trial(3, 3.4, PRUNED), trial(4, 0.5)]
    noisy = world(original=-5.0, trial_1=-3.0, trial_2=1.0, trial_4=0.0)
    found = decide(trials, 2, FINAL, MARGIN_ONLY, noisy)
    assert [each.number for each in found] == [2, 0, 1], (
        "the best two that drove all missions, and the original"
    )
    assert [each.missions for each in found] == [128, 128, 128]
    driven = {mission for _, mission in noisy.driven} - set(TRAINING)
    assert driven == set(FINAL) and len(noisy.driven) - len(TRAINING) * 4 == most_episodes(2, 128)


def test_the_original_stays_where_nothing_is_better_by_a_cent() -> None:
    trials = [trial(0, -5.0), trial(1, 3.0), trial(2, 2.0)]
    found = decide(trials, 2, FINAL, MARGIN_ONLY, world(original=1.0, trial_1=1.004, trial_2=0.0))
    assert found[0].number == 0 and found[0].missions == 128


def test_an_original_without_luck_on_the_first_missions_is_not_given_up() -> None:
    class Unlucky(Noisy):
        def _row(self, name: str, mission: int) -> Row:
            lost = 40.0 if name == "original" and mission < FINAL[32] else 0.0
            row = super()._row(name, mission)
            return {**row, MARGIN: row[MARGIN] - lost}

    trials = [trial(0, 1.0), *(trial(number, 2.0) for number in range(1, 5))]
    truth = {"original": 15.0, **{f"trial-{number}": 2.0 + number / 10.0 for number in range(1, 5)}}
    found = decide(trials, 4, FINAL, MARGIN_ONLY, Unlucky(truth, shared=True))
    assert [each.number for each in found[:2]] == [0, 4], (
        "15 - 40 / 4 on all missions is more than 2.4"
    )


def test_who_drives_alike_meets_once_and_who_cannot_be_driven_comes_last() -> None:
    trials = [
        trial(0, 0.0),
        trial(1, 3.0),
        trial(2, 2.9, values={"node.x": 1.0}),
        trial(3, 1.0),
        trial(4, 2.0),
    ]
    noisy = world(original=0.0, trial_1=3.0, trial_2=3.0, trial_3=1.0, trial_4=math.nan)
    found = decide(trials, 3, FINAL, MARGIN_ONLY, noisy)
    assert [each.number for each in found] == [1, 0, 3, 4]
    assert found[-1].as_json() == {"trial": 4, "missions": 0, "value": None}


def test_there_is_no_choice_without_a_rival() -> None:
    lone = [trial(0, 0.0), trial(1, 3.0, PRUNED)]
    assert decide(lone, 4, FINAL, MARGIN_ONLY, world(original=0.0)) == ()
    assert decide([trial(0, 0.0), trial(1, 1.0)], 0, FINAL, MARGIN_ONLY, world(original=0.0)) == ()


def test_the_side_condition_comes_first() -> None:
    objective = parse_objectives("margin@sla>=0.9")[0]

    class Late(Noisy):
        def _row(self, name: str, mission: int) -> Row:
            return {
                **super()._row(name, mission),
                "outcome": "timeout" if name == "trial-1" else "sla",
            }

    late = Late({"original": 0.0, "trial-1": 50.0, "trial-2": 1.0}, shared=True)
    found = decide([trial(0, 0.0), trial(1, 50.0), trial(2, 1.0)], 2, FINAL, objective, late)
    assert [each.number for each in found] == [2, 0, 1]


class Losing(Noisy):
    """Workers die on some deliveries."""

    def __init__(self, truth: dict[str, float], lost: set[tuple[str, int]]) -> None:
        super().__init__(truth, shared=True)
        self._lost = lost

    def _row(self, name: str, mission: int) -> Row:
        row = super()._row(name, mission)
        return {"error": "its worker died", MARGIN: None} if (name, mission) in self._lost else row


def test_a_lost_delivery_counts_for_nobody() -> None:
    trials = [trial(0, -5.0), trial(1, 3.0), trial(2, 2.0)]
    truth = {"original": 3.0, "trial-1": -50.0, "trial-2": -60.0}
    found = decide(trials, 2, FINAL, MARGIN_ONLY, Losing(truth, {("original", 105)}))
    assert [(each.number, each.missions) for each in found] == [(0, 127), (1, 127), (2, 128)]
    truth |= {"trial-1": 9.0}
    found = decide(
        trials, 2, FINAL, MARGIN_ONLY, Losing(truth, {("trial-1", 105), ("trial-2", 107)})
    )
    assert [(each.number, each.missions) for each in found] == [(1, 127), (0, 127), (2, 126)]


def test_a_tenth_of_the_missions_may_be_lost() -> None:
    lost = {("original", 103), ("trial-2", 105), ("trial-2", 106)}
    truth = {"original": 3.0, "trial-1": 9.0, "trial-2": 8.0}
    trials = [trial(0, -5.0), trial(1, 3.0), trial(2, 2.0)]
    found = decide(trials, 2, range(100, 110), MARGIN_ONLY, Losing(truth, lost))
    assert [(each.number, each.missions) for each in found] == [(1, 9), (0, 9), (2, 0)]


def test_an_original_that_loses_many_stays() -> None:
    lost = {("original", mission) for mission in range(100, 120)}
    world = Losing({"original": 3.0, "trial-1": 9.0}, lost)
    found = decide([trial(0, -5.0), trial(1, 3.0)], 1, FINAL, MARGIN_ONLY, world)
    assert [each.number for each in found] == [0, 1] and found[0].missions == 0
