"""A study ends with its budget, whatever it has driven by then."""

import dataclasses
import json
import math
import time
from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from harness.audit.pairs import EVENTS
from harness.metrics.columns import Row
from harness.tuning.budget import ENDING, Budget, enough_for
from harness.tuning.evaluation import Candidate, OutOfTimeError
from harness.tuning.journal import Journal
from harness.tuning.notes import notes_after_search
from harness.tuning.objective import parse_objectives
from harness.tuning.output import DOCUMENT, Ended, ended
from harness.tuning.result import StudyResult
from harness.tuning.search import Plan
from harness.tuning.study import TuningStudy, finish, fitted, run_search
from harness.tuning.training import missions_within
from navstack.errors import InputError

from .made_up import SPACE, MadeUp

ORIGINAL = Candidate("original", {})
ROW: Row = {"stack": "a", "outcome": "sla", EVENTS: []}
EACH = 2.0  # [s] of a delivery
TRAINING, TRIALS, TEST, FINAL = 16, 40, 30, 8


@dataclasses.dataclass
class Clock:
    """[s], moved by hand."""

    now: float = 0.0

    def __call__(self) -> float:
        return self.now


class Timed:
    """Drives in a made-up world; each delivery takes its time, and none begins too late."""

    def __init__(self, journal: Journal, clock: Clock) -> None:
        self._journal, self._clock, self._world = journal, clock, MadeUp()
        self.end = math.inf  # [s] of the clock

    @property
    def until(self) -> float:
        return self.end - self._clock.now + time.monotonic()

    @until.setter
    def until(self, seconds: float) -> None:
        self.end = seconds - time.monotonic() + self._clock.now

    def drive(self, candidates: Sequence[Candidate], missions: Sequence[int]) -> None:
        for mission in missions:
            for candidate in candidates:
                if self._journal.get(candidate, mission) is None:
                    self._drive(candidate, mission)

    def rows(self, candidate: Candidate, missions: Sequence[int]) -> list[Row]:
        self.drive((candidate,), missions)
        return [{**ROW, **(self._journal.get(candidate, mission) or {})} for mission in missions]

    def _drive(self, candidate: Candidate, mission: int) -> None:
        if self._clock.now + EACH > self.end + 0.1:
            raise OutOfTimeError
        self._clock.now += EACH
        (row,) = self._world.rows(candidate, [mission])
        self._journal.add(candidate, mission, {**ROW, **row})


def study(
    test_episodes: int = TEST, ended_after: int | None = None, fits: float | None = None
) -> TuningStudy:
    plan = Plan(
        SPACE,
        parse_objectives("margin"),
        tuple(range(TRAINING)),
        TRIALS,
        finalists=2,
        final_missions=tuple(range(TRAINING, TRAINING + FINAL)),
        fee=3.49,
    )
    declaration: Any = SimpleNamespace(trials=TRIALS, test_episodes=test_episodes, sampler="tpe")
    template: Any = SimpleNamespace(seed=5)
    nav2: Any = None  # no file
    return TuningStudy(declaration, template, plan, nav2, ended_after, fits)


def tuned(
    folder: Path, seconds: float | None, **given: Any
) -> tuple[StudyResult, list[str], float]:
    """A session of a study: its result, its notes, and when its last delivery ended [s]."""
    clock, asked = Clock(), study(**given)
    with Journal(folder, TRAINING, clock) as journal:
        evaluator, budget = Timed(journal, clock), Budget(seconds, journal)
        evaluator.until = budget.end
        asked = fitted(asked, evaluator, journal, budget)
        search = run_search(asked, evaluator, journal, lambda *_: None, budget)
        notes = notes_after_search(asked, search, journal, budget)
        driving: Any = evaluator
        found = finish(asked, search, driving, journal, budget)
        return found, notes, journal.elapsed


def test_a_budget_is_told_by_the_time_per_delivery(tmp_path: Path) -> None:
    clock = Clock()
    with Journal(tmp_path, clock=clock) as journal:
        budget, none = Budget(100.0, journal), Budget(None, journal)
        assert (budget.left, budget.share_of(5)) == (100.0, 1.0), "no pace is known yet"
        for mission in range(2):
            clock.now += EACH
            journal.add(ORIGINAL, mission, ROW)
        assert budget.left == 100.0 - 2 * EACH - ENDING * EACH
        assert budget.share_of(40) == 1.0
        assert budget.share_of(80) == pytest.approx(budget.left / (80 * EACH))
        assert budget.until == pytest.approx(time.monotonic() + budget.left, abs=1.0)
        assert budget.end == pytest.approx(time.monotonic() + 96.0, abs=1.0)
        clock.now = 99.0
        assert budget.left == 0.0
        budget.ending, clock.now = 0, 90.0
        assert budget.left == 10.0, "nothing is left to record"
        assert (none.left, none.share_of(10**6), none.end) == (math.inf, 1.0, math.inf)


@pytest.mark.parametrize(
    ("now", "later", "is_allowed"),
    [
        (20.0, 10, True),
        (46.0, 10, True),  # 16 s of the ending, 20 s of what follows, 10 s of its first look
        (60.0, 10, False),
        # what follows takes half of the 64 s between the original and the ending, no more
        (41.0, 400, True),
        (43.0, 400, False),
    ],
)
def test_a_trial_begins_where_it_leaves_time_for_what_follows(
    tmp_path: Path, now: float, later: int, is_allowed: bool
) -> None:
    clock = Clock()
    with Journal(tmp_path, clock=clock) as journal:
        for mission in range(5):
            clock.now += EACH
            journal.add(ORIGINAL, mission, ROW)
        clock.now = now
        budget = Budget(100.0, journal)
        assert budget.allows(5, later, began=20.0) == is_allowed
        assert Budget(None, journal).allows(5, later, began=20.0)


@pytest.mark.parametrize("seconds", [100.0, 150.0, 300.0])
def test_a_study_ends_within_its_budget_and_tests_as_much_as_it_allows(
    tmp_path: Path, seconds: float
) -> None:
    found, notes, took = tuned(tmp_path, seconds)
    assert found.incumbent.values
    assert took <= seconds - ENDING * EACH + 0.1
    assert took > seconds - ENDING * EACH - 2.0 * EACH, "all of the time is used"
    assert 5 <= len(found.test_missions) < TEST and found.is_tested
    assert all(len(rows) == len(found.test_missions) for rows in found.test_rows)
    assert 1 < len(found.trials) < TRIALS
    lasts = [note for note in notes if "final choice and test" in note]
    assert len(lasts) == 1 and lasts[0].startswith("note: the budget lasts for about ")


def test_a_cut_study_goes_on_with_more_of_the_same_test(tmp_path: Path) -> None:
    first, _, _ = tuned(tmp_path, 200.0)
    before = len(first.trials) - 1
    more, notes, _ = tuned(tmp_path, None, ended_after=before)
    assert len(more.test_missions) == TEST and len(more.trials) == before + 1
    count = len(first.test_missions)
    assert more.incumbent == first.incumbent, "as long a choice, of the same trials"
    assert list(more.test_rows[1][:count]) == list(first.test_rows[1])
    assert not any("final choice" in note for note in notes)


def test_a_budget_that_the_original_exceeds_ends_with_the_command_that_goes_on(
    tmp_path: Path,
) -> None:
    with pytest.raises(InputError) as refused:
        tuned(tmp_path, 20.0)
    assert str(refused.value) == (
        "the budget of 20 s ended after 10 of the 16 training missions of your file, before the "
        "first trial; a study on 16 takes 6m: your file, a few trials, a test. Fewer: --episodes "
        f"10. next: navbench tune --resume {tmp_path} --budget 6m"
    )
    found, _, took = tuned(tmp_path, 360.0)
    assert found.is_tested and took <= 360.0


@pytest.mark.parametrize(
    ("budget", "pace", "missions"),
    [(320.0, 1.0, 32), (319.0, 1.0, 20), (199.0, 1.0, 10), (9.0, 1.0, 10), (1e9, 3.0, 32)],
)
def test_a_budget_is_for_ten_deliveries_a_training_mission(
    budget: float, pace: float, missions: int
) -> None:
    assert missions_within(budget, pace) == missions


@pytest.fixture
def _in_order(monkeypatch: pytest.MonkeyPatch) -> None:
    """Missions of no length, which stay in their order."""
    monkeypatch.setattr(
        "harness.tuning.study.training_missions", lambda template, count: tuple(range(count))
    )


@pytest.mark.usefixtures("_in_order")
def test_a_short_budget_has_fewer_training_missions_also_where_the_study_goes_on(
    tmp_path: Path,
) -> None:
    first, _, took = tuned(tmp_path, 120.0, fits=120.0)
    assert len(first.train_missions) == 10 and len(first.trials) > 1
    assert first.is_tested and took <= 120.0
    again, _, _ = tuned(tmp_path, 1200.0, fits=120.0)
    assert again.train_missions == first.train_missions, "the budget of before decides"
    assert again.trials[: len(first.trials)] == first.trials


def test_without_time_for_a_trial_nothing_is_tested(tmp_path: Path) -> None:
    found, notes, took = tuned(tmp_path, 60.0)
    assert (len(found.trials), found.is_tested, took) == (1, False, 2.0 * TRAINING)
    assert len(notes) == 1 and "cut off 40 of 40 trials; --resume with --budget 7m" in notes[0]
    found, _, _ = tuned(tmp_path, 420.0)
    assert len(found.trials) > 1 and found.is_tested


@pytest.mark.usefixtures("_in_order")
def test_a_budget_for_not_even_the_fewest_says_what_they_take(tmp_path: Path) -> None:
    for seconds, driven in ((8.0, 4), (16.0, 8)):
        folder = tmp_path / str(driven)
        folder.mkdir()
        with pytest.raises(InputError, match=f"ended after {driven} of the 10 .* takes 4m"):
            tuned(folder, seconds, fits=seconds)


def test_enough_is_ten_times_the_training_missions_in_whole_minutes() -> None:
    assert enough_for(32, 1.0) == "6m"
    assert enough_for(32, 1.0, least=1800.0) == "30m"
    assert enough_for(2, 0.1) == "1m"


def test_a_finished_study_tells_how_far_it_went(tmp_path: Path) -> None:
    assert ended(tmp_path) is None
    file = tmp_path / DOCUMENT
    file.write_text(json.dumps({"trials": {"complete": 2, "pruned": 3}}))
    assert ended(tmp_path) == Ended(4, {}), "of an older program"
    sizes = {"test_episodes": 7, "final_episodes": 0, "waterfall_missions": 2}
    file.write_text(json.dumps({"trials": {"complete": 1}, "sizes": sizes}))
    assert ended(tmp_path) == Ended(0, sizes)
    for damaged in ("", "[]", "{}", '{"trials": 3}', '{"trials": {}, "sizes": {"a": null}}'):
        file.write_text(damaged)
        with pytest.raises(InputError, match="is damaged"):
            ended(tmp_path)
