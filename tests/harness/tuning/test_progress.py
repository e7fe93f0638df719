"""How far a study is, by hand."""

import dataclasses
import math
from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from scipy.stats import norm

from harness.metrics.columns import Row
from harness.statistics.interval import Interval
from harness.tuning import history
from harness.tuning.evaluation import MARGIN, Candidate
from harness.tuning.history import Best, score_interval
from harness.tuning.objective import parse_objectives
from harness.tuning.progress import StudyProgress, expected_gain
from harness.tuning.result import COMPLETE, PRUNED, Trial
from harness.tuning.search import Plan
from harness.tuning.space.space import Space

ROWS: list[Row] = [
    {MARGIN: margin, "duration_s": 50.0 + 3.0 * number, "outcome": "sla", "error": None}
    for number, margin in enumerate((3.49, -40.0, 3.4, 1.0, -2.5, 3.3, 0.5, 2.0))
]


@dataclasses.dataclass
class Clock:
    """In place of a journal: the time so far [s], and the episodes that it is of."""

    elapsed: float = 0.0
    timed: int = 0
    latest: float = 0.0  # when the last episode ended

    @property
    def pace(self) -> float:
        return self.latest / max(self.timed, 1)

    @property
    def idle(self) -> float:
        return self.elapsed - self.latest


class Known:
    """An evaluator of which every candidate drives alike."""

    def rows(self, candidate: Candidate, missions: Sequence[int]) -> list[Row]:
        return [ROWS[mission] for mission in missions]


def planned(objectives: str, trials: int) -> Plan:
    return Plan(Space("", "", ()), parse_objectives(objectives), tuple(range(8)), trials)


def begun(
    objectives: str = "margin",
    trials: int = 4,
    budget: float | None = None,
    later: int = 10,
) -> tuple[StudyProgress, Clock]:
    clock = Clock()
    return StudyProgress(planned(objectives, trials), cast(Any, clock), budget, later), clock


def drive(progress: StudyProgress, clock: Clock, episodes: int) -> None:
    for _ in range(episodes):
        clock.elapsed += 2.0
        clock.timed += 1
        clock.latest = clock.elapsed
        progress.episode(Candidate("", {}), {})


def trial(number: int, missions: int, value: float, *more: float, p: float | None = None) -> Trial:
    state, values = (COMPLETE if missions == 8 else PRUNED), (value, *more)
    name = f"trial-{number}" if number else "original"
    return Trial(
        number,
        Candidate(name, {}),
        {},
        state,
        tuple(range(missions)),
        values,
        values,
        p,
        "",
    )


def searched(budget: float | None = None, extra: int = 0) -> tuple[StudyProgress, Clock]:
    """After the original's eight episodes, four of the first trial, and some of the second.

    Each takes 2 s.
    """
    progress, clock = begun(budget=budget)
    original = trial(0, 8, 1.5)
    for each in (original, trial(1, 4, 0.5, p=0.25)):
        drive(progress, clock, len(each.missions))
        assert progress.remaining is None
        progress.trial(each, original, Known())
    drive(progress, clock, extra)
    return progress, clock


@pytest.mark.parametrize(
    ("budget", "extra", "idle", "left"),
    [
        (None, 0, 0.0, 2.0 * (3 * 4 + 10)),  # three trials as the first, and what comes later
        (None, 3, 0.0, 2.0 * (3 * 4 - 3 + 10)),
        (None, 15, 0.0, 2.0 * 10),
        (None, 0, 1.5, 2.0 * (3 * 4 + 10) - 1.5),
        (None, 0, 100.0, 0.0),
        (30.0, 0, 0.0, 30.0 - 24.0),  # the budget ends all of it
        (30.0, 0, 1.0, 30.0 - 25.0),
        (90.0, 0, 0.0, 2.0 * (3 * 4 + 10)),
        (20.0, 0, 0.0, 0.0),
    ],
)
def test_time_left(budget: float | None, extra: int, idle: float, left: float) -> None:
    progress, clock = searched(budget, extra)
    clock.elapsed += idle
    assert progress.remaining == pytest.approx(left)


def test_trials_take_what_they_took_on_average() -> None:
    progress, clock = searched()
    drive(progress, clock, 8)
    progress.trial(trial(2, 8, 1.0), trial(0, 8, 1.5), Known())
    assert progress.remaining == pytest.approx(2.0 * (2 * 6 + 10)), "four and eight episodes"


def test_time_left_after_the_search() -> None:
    progress, clock = searched(extra=3)
    progress.begin("choice")
    assert progress.remaining == pytest.approx(20.0)
    drive(progress, clock, 4)
    progress.begin("test")
    assert progress.remaining == pytest.approx(12.0)
    assert progress.text == "test: 4 of at most 10 deliveries driven, at most about 12 s left"
    assert progress.when == "during the test"
    drive(progress, clock, 7)
    assert progress.remaining == 0.0


def test_where_nothing_was_chosen_the_test_alone_is_left() -> None:
    progress, clock = searched()
    progress.begin("test", later=3)
    drive(progress, clock, 1)
    assert progress.text == "test: 1 of at most 3 deliveries driven, at most about 4 s left"
    again = StudyProgress(planned("margin", 4), cast(Any, clock), None, later=10)
    again.trials, again.best = progress.trials, progress.best
    again.begin("test")
    assert again.text == "test: 0 of at most 10 deliveries driven", "they may all be known"


def test_nothing_comes_later_unless_said() -> None:
    known, clock = searched()
    clock.timed = 1  # a journal that was read again may hold no more
    clock.latest = clock.elapsed = 24.0
    assert known.remaining == pytest.approx(24.0 * 22)
    plain = StudyProgress(planned("margin", 4), cast(Any, clock), None)
    plain.trials = known.trials
    assert plain.remaining == pytest.approx(24.0 * 12)


def test_a_budget_that_the_original_exceeds_is_told_while_it_drives() -> None:
    for budget, is_told in ((15.9, True), (16.1, False)):  # 8 episodes of 2 s
        progress, clock = begun(budget=budget)
        drive(progress, clock, 3)
        assert "budget" not in progress.text, "the pace is not known yet"
        drive(progress, clock, 1)
        assert ("longer than the budget" in progress.text) == is_told


def test_what_is_told_before_the_original_has_been_driven() -> None:
    progress, clock = begun()
    assert (progress.text, progress.when) == (
        "original: 0 of 8 deliveries driven",
        "while the original was driven",
    )
    drive(progress, clock, 3)
    assert (progress.text, progress.gain) == ("original: 3 of 8 deliveries driven", None)
    progress.begin("test")
    assert progress.text == "test: 3 deliveries driven"


@pytest.mark.parametrize("objectives", ["margin", "margin,-duration_s"])
def test_the_best_is_told_with_its_interval(objectives: str) -> None:
    progress, _ = begun(objectives, trials=2)
    best = trial(0, 8, 1.5, *([-60.5] if "," in objectives else []))
    progress.trial(best, best, Known())
    expected = score_interval(parse_objectives("margin")[0], 1.5, ROWS, 0)
    assert progress.interval == expected and expected.low is not None
    assert progress.text == (
        f"trial 0/2, best 1.50 [{expected.low:.2f}, {expected.high:.2f}] of original, 8 "
        "deliveries, 0 saved by racing"
    )
    for low, high in ((None, 2.0), (1.0, None)):
        progress.interval = Interval(1.5, low, high, 8)
        assert "best 1.50 of original" in progress.text
    for number in (1, 2):
        progress.trial(trial(number, 4, 0.5, -50.0), best, Known())
    assert progress.gain == (0.0 if objectives == "margin" else None), "no trial is left"
    assert progress.when == "after 2 of 2 trials"


@pytest.mark.parametrize(
    ("low", "high", "error"),
    [(0.2, 0.9, 0.7 / 3.92), (None, 0.9, 0.0), (0.2, None, 0.0), (None, None, 0.0)],
)
def test_what_is_left_to_gain(low: float | None, high: float | None, error: float) -> None:
    progress, _ = begun(trials=30)
    best = trial(0, 8, 1.5)
    for each in (best, *(trial(number, 8, math.sin(number)) for number in range(1, 14))):
        progress.trial(each, best, Known())
    progress.interval = Interval(1.5, low, high, 8)
    expected = expected_gain([math.sin(number) for number in range(1, 14)], 1.5, error, 17)
    assert progress.gain == expected != 0.0
    assert progress.text.endswith(f"about 0 s left, expected further gain {expected:.2f}")


def test_the_live_table_has_the_last_eight_trials() -> None:
    progress, _ = begun(trials=30)
    trials = [
        trial(number, 8 - 4 * (number % 2), 0.25 * number, p=0.125 if number == 9 else None)
        for number in range(10)
    ]
    for number, each in enumerate(trials):
        progress.trial(each, trials[8 if number > 8 else 0], Known())
    progress.trials.append(dataclasses.replace(trial(10, 8, 0.0), told=()))
    table = progress.__rich__()
    columns = [list(column.cells) for column in table.columns]
    assert [column.justify for column in table.columns] == [
        "right",
        "left",
        "right",
        "right",
        "right",
    ]
    assert columns[0] == ["3", "4", "5", "6", "7", "*8", "9", "10"]
    assert columns[2] == ["4", "8", "4", "8", "4", "8", "4", "8"]
    assert columns[3] == ["0.75", "1.00", "1.25", "1.50", "1.75", "2.00", "2.25", ""]
    assert columns[4] == ["", "", "", "", "", "", "0.125", ""]
    assert "68 deliveries, 20 saved by racing" in progress.text


VALUES = (5.0, 9.0, -3.0, 4.0, 7.0, 1.0, 2.5, 1.5, 3.0, 0.5, 2.0)  # of which the last six count


@pytest.mark.parametrize("error", [0.0, 0.5])
@pytest.mark.parametrize("best", [2.5, -20.0])
def test_one_more_trial_gains_what_a_normal_number_is_above_the_best(
    best: float, error: float
) -> None:
    """The expected excess of a normal number over z is its density less z times its tail there."""
    later = np.array(VALUES[5:])
    deviation = math.sqrt(((later - 1.75) ** 2).sum() / 5.0 - error**2)
    z = (best - 1.75) / deviation
    gain = deviation * (norm.pdf(z) - z * norm.sf(z))
    assert expected_gain(VALUES, best, error, 1) == pytest.approx(gain, rel=1e-6)


def test_further_trials_gain_the_largest_of_as_many() -> None:
    """The largest of two normal numbers lies their deviation over the root of pi above the mean."""
    deviation = float(np.std(VALUES[5:], ddof=1))
    assert expected_gain(VALUES, -20.0, 0.0, 2) == pytest.approx(
        21.75 + deviation / math.sqrt(math.pi), rel=1e-6
    )


@pytest.mark.parametrize(("best", "gain"), [(1.25, 0.5), (2.0, 0.0)])
def test_where_all_spread_is_noise_the_mean_is_what_comes(best: float, gain: float) -> None:
    assert expected_gain(VALUES, best, 9.0, 5) == gain
    assert expected_gain(VALUES[:9], best, 9.0, 5) is None
    assert expected_gain(VALUES[:9], best, 9.0, 0) == 0.0


@pytest.mark.parametrize("name", ["margin", "-duration_s"])
def test_the_best_grow_by_more_than_the_objectives_resolution(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Complete trials only, each against the last of them.

    The first one counts whatever it earns.
    """
    objective, at = parse_objectives(name)[0], (-3.0, -3.0, -2.5, 0.0, 0.0, 0.25, -1.0)
    step = objective.resolution
    values = [
        value + more * step
        for value, more in zip(at, (0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0), strict=True)
    ]
    trials = [trial(number, 8, value) for number, value in enumerate(values)]
    trials.insert(1, trial(7, 4, 99.0))
    study = SimpleNamespace(objectives=(name, "spl"), trials=trials, seed=5)
    scores = {"published": SimpleNamespace(incumbent=1.25)}
    paired: list[Any] = []
    monkeypatch.setattr(
        history, "pair_up", lambda *given: paired.append(given) or SimpleNamespace(scores=scores)
    )
    prices = object()
    found = history.history(cast(Any, study), cast(Any, Known()), cast(Any, prices))
    numbers = [0, 2, 3, 5]
    assert [each.number for each in found] == numbers
    assert found[1] == Best(2, score_interval(objective, -2.5, ROWS, 5), {"published": 1.25})
    assert paired == [(ROWS, ROWS, prices, 5)] * 4
    assert found[1].as_json() == {
        "trial": 2,
        **found[1].score.as_json(),
        "accountings": {"published": 1.25},
    }
