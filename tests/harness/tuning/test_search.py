"""The search: racing, what the sampler is told, and the same trials whatever happens on the way."""

import dataclasses
from io import StringIO
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from rich.console import Console

from harness.audit.pairs import EVENTS
from harness.tuning.evaluation import MARGIN, Candidate
from harness.tuning.journal import Journal
from harness.tuning.objective import parse_objectives
from harness.tuning.progress import StudyProgress, expected_gain
from harness.tuning.racing import adjusted, p_no_worse, rungs, stratified
from harness.tuning.result import Trial
from harness.tuning.sampler import make_sampler
from harness.tuning.search import Plan, Search, front_of
from navstack.errors import InputError

from .made_up import SPACE, MadeUp

RANGES = dataclasses.replace(SPACE, parameters=SPACE.parameters[:3])  # cmaes takes no choices


def search(
    world: MadeUp,
    kind: str = "tpe",
    trials: int = 30,
    objective: str = "margin",
    raced: bool = True,
) -> Search:
    objectives = parse_objectives(objective)
    space = RANGES if kind == "cmaes" else SPACE
    plan = Plan(space, objectives, tuple(range(32)), trials, raced)
    sampler = make_sampler(kind, space, 5, trials, len(objectives))
    return Search(plan, sampler, world, lambda trial, incumbent: None)


def driven(kind: str = "tpe", world: MadeUp | None = None, **options: object) -> list[Trial]:
    found = search(world or MadeUp(), kind, **options)  # type: ignore[arg-type]
    found.run()
    return found.trials


@pytest.mark.parametrize("kind", ["tpe", "cmaes", "random", "grid"])
def test_same_seed_gives_the_same_trials(kind: str) -> None:
    assert driven(kind) == driven(kind)


@pytest.mark.parametrize("kind", ["tpe", "cmaes", "random", "grid"])
def test_trials_go_on_as_if_nothing_had_stopped_them(kind: str) -> None:
    whole = driven(kind, trials=20)
    world = MadeUp(stop_after=150)
    with pytest.raises(KeyboardInterrupt):
        driven(kind, world, trials=20)
    world.stop_after = None
    assert driven(kind, world, trials=20) == whole


def test_more_trials_begin_with_the_same_ones() -> None:
    assert driven(trials=20)[:13] == driven(trials=12)


def test_search_improves_and_racing_saves_episodes() -> None:
    raced, plain = MadeUp(), MadeUp()
    best = search(raced)
    best.run()
    unraced = search(plain, raced=False)
    unraced.run()
    assert best.incumbent.values[0] > best.trials[0].values[0] + 10.0
    assert len(raced.driven) < 0.7 * len(plain.driven)
    assert all(len(trial.missions) == 32 for trial in unraced.trials)
    pruned = [trial for trial in best.trials if trial.state == "pruned"]
    assert pruned and all(
        trial.p is not None and trial.p < 0.3 and trial.reason for trial in pruned
    )
    assert {len(trial.missions) for trial in pruned} <= {8, 16, 24}


def test_trials_do_not_all_begin_with_the_same_missions() -> None:
    plan = Plan(SPACE, parse_objectives("margin"), tuple(range(32)), 5)
    firsts = [plan.order(number)[:8] for number in range(4)]
    assert len(set(firsts)) == 4
    assert sorted(mission for first in firsts for mission in first) == list(range(32))


def test_incumbent_is_the_best_complete_trial() -> None:
    found = search(MadeUp())
    found.run()
    complete = [trial for trial in found.trials if trial.state == "complete"]
    assert max(trial.values for trial in complete)[0] - found.incumbent.values[0] <= 0.01


def test_a_gain_of_less_than_a_cent_is_none() -> None:
    world = MadeUp()
    world.rows = lambda candidate, missions: [  # type: ignore[method-assign]
        {"error": None, "outcome": "sla", MARGIN: 3.49 + 1e-6 * len(candidate.values)}
        for _ in missions
    ]
    found = search(world, trials=5)
    found.run()
    assert found.incumbent.number == 0


def test_a_failed_trial_does_not_end_the_study() -> None:
    trials = driven(world=MadeUp(failing="trial-3"), trials=6)
    assert [trial.state == "failed" for trial in trials] == [
        False,
        False,
        False,
        True,
        False,
        False,
        False,
    ]
    assert trials[3].reason == "its worker died" and trials[3].told == ()


def test_an_original_that_fails_does() -> None:
    with pytest.raises(InputError, match="original file cannot be tuned: its worker died"):
        driven(world=MadeUp(failing="original"))


def test_pareto_front_holds_what_nothing_beats() -> None:
    trials = driven(objective="margin,-duration_s", trials=12)
    front = front_of(trials)
    assert all(len(trial.missions) == 32 for trial in trials)
    for number in front:
        own = trials[number].values
        assert not any(
            all(a >= b for a, b in zip(t.values, own, strict=True)) and t.values != own
            for t in trials
        )
    assert set(range(len(trials))) - set(front), "some trial is beaten"


def test_side_condition_comes_before_the_margin() -> None:
    world = MadeUp(rash_within=0.9)
    found = search(world, objective="margin@sla>=0.9", trials=15)
    found.run()
    objective = parse_objectives("margin@sla>=0.9")[0]
    complete = [each for each in found.trials if each.state == "complete"]
    shortfalls = [objective.shortfall(world.rows(each.candidate, range(32))) for each in complete]
    own = objective.shortfall(world.rows(found.incumbent.candidate, range(32)))
    assert own == min(shortfalls)
    assert max(complete, key=lambda trial: trial.values[0]) is not found.incumbent


@pytest.mark.parametrize("missing", [2, 30])
def test_a_metric_that_some_missions_lack_can_be_raced(missing: int) -> None:
    world = MadeUp()
    plain = world.rows
    world.rows = lambda candidate, missions: [  # type: ignore[method-assign]
        {**row, "spl": None if mission % 32 < missing else row[MARGIN]}
        for mission, row in zip(missions, plain(candidate, missions), strict=True)
    ]
    found = search(world, objective="spl", trials=12)
    found.run()
    assert {trial.state for trial in found.trials} <= {"complete", "pruned"} and len(
        found.trials
    ) == 13
    assert all(np.isfinite(trial.told).all() and trial.told for trial in found.trials)
    assert found.incumbent.values[0] >= found.trials[0].values[0]


def test_cmaes_wants_ranges() -> None:
    with pytest.raises(InputError, match="--sampler cmaes wants"):
        make_sampler("cmaes", SPACE, 0, 10, 1)
    points = []
    for _ in range(2):
        sampler = make_sampler("cmaes", RANGES, 0, 10, 1)
        sampler.tell(RANGES.original, [0.0])
        asked = []
        for number in range(12):
            point = sampler.ask()
            assert point is not None
            sampler.tell(point, [-float(number)])
            asked.append(point)
        points.append(asked)
    assert points[0] == points[1]


def test_rungs_and_strata() -> None:
    assert rungs(64) == (8, 16, 24, 32, 48, 64) and rungs(4) == (4,) and rungs(31) == (31,)
    lengths = {number: float((number * 37) % 64) for number in range(64)}
    order = stratified(lengths, 1)
    assert sorted(order) == list(range(64)) and order == stratified(lengths, 1) != stratified(
        lengths, 2
    )
    for begin in range(0, 64, 8):  # each rung's worth has one mission of each eighth
        assert sorted(int(lengths[mission] // 8) for mission in order[begin : begin + 8]) == list(
            range(8)
        )


def test_looks_drop_one_as_good_as_rarely_as_they_say() -> None:
    rng = np.random.default_rng(0)
    p_values = []
    for _ in range(400):
        own, other = (
            3.49 - 40.0 * (rng.random(16) < 0.4) * rng.uniform(0.8, 1.2, 16) for _ in range(2)
        )
        p_values.append(p_no_worse(own, other))
    assert 0.2 < np.mean(np.array(p_values) < 0.3) < 0.36
    assert p_no_worse(np.full(8, 3.49), np.full(8, 3.48)) == 1.0, "a cent is no difference"
    assert p_no_worse(np.full(8, 6e-4), np.full(8, 8e-4), 0.0) < 0.01, "of a metric in kWh it is"


def test_control_variate_takes_off_half_of_the_noise_where_missions_decide() -> None:
    rng = np.random.default_rng(1)
    plain, better = [], []
    for _ in range(300):
        mission = rng.normal(0.0, 10.0, 64)
        own, other = (mission + rng.normal(0.0, 4.0, 64) for _ in range(2))
        plain.append(own[:16].mean() - own.mean())
        better.append(adjusted(own[:16], other[:16], float(other.mean())) - own.mean())
    assert np.std(better) < 0.6 * np.std(plain)
    with_gaps = [np.append(scores[:16], np.nan) for scores in (own, other)]
    assert adjusted(*with_gaps, float(other.mean())) == adjusted(
        own[:16], other[:16], float(other.mean())
    )


@pytest.mark.parametrize(("factor", "slope"), [(-1.0, 0.0), (0.5, 0.5), (2.0, 1.0)])
def test_the_coefficient_of_the_control_variate_is_held_to_0_to_1(
    factor: float, slope: float
) -> None:
    other = np.random.default_rng(2).normal(0.0, 10.0, 16)
    own = factor * other + 3.0
    assert adjusted(own, other, 7.0) == pytest.approx(
        own.mean() - slope * (other.mean() - 7.0), rel=1e-12
    )
    assert adjusted(own, np.full(16, 2.0), 7.0) == own.mean(), (
        "an incumbent that always earns the same tells nothing"
    )


def test_live_table_tells_the_best_what_was_saved_and_what_may_come(tmp_path: Path) -> None:
    world, objectives = MadeUp(), parse_objectives("margin")
    plan = Plan(SPACE, objectives, tuple(range(32)), 30)
    with Journal(tmp_path) as journal:
        progress = StudyProgress(plan, journal, None)
        assert progress.text == "original: 0 of 32 deliveries driven"
        found = Search(
            plan,
            make_sampler("tpe", SPACE, 5, 30, 1),
            world,
            lambda a, b: progress.trial(a, b, world),
        )
        found.run(lambda candidate, missions: candidate.name != "trial-21")
        console = Console(file=StringIO(), width=200)
        console.print(progress)
        assert isinstance(console.file, StringIO)
        shown = " ".join(console.file.getvalue().split())
    driven = sum(len(trial.missions) for trial in found.trials)
    assert len(found.trials) == 21 and f"trial 20/30, best {found.incumbent.values[0]:.2f}" in shown
    assert f"{driven} deliveries, {32 * 21 - driven} saved by racing" in shown
    assert "expected further gain" in shown and "s left" in shown and "pruned" in shown
    assert progress.gain is not None and 0.0 <= progress.gain < 40.0
    error = (progress.interval.high - progress.interval.low) / 3.92
    for later in (20, 19):  # the sampler's, of which the later half counts
        told = [trial.told[0] for trial in progress.trials[: later + 1] if trial.number > 0]
        progress.trials = progress.trials[: later + 1]
        assert progress.gain == expected_gain(told, progress.best.values[0], error, 30 - later)


def test_time_left_is_counted_in_episodes_of_search_and_what_comes_after(tmp_path: Path) -> None:
    now = [0.0]
    plan = Plan(SPACE, parse_objectives("margin"), tuple(range(8)), 4)
    original, other = Candidate("original", {}), Candidate("trial-1", {"node.x": 0.5})
    row = {"stack": "a", "outcome": "sla", MARGIN: 1.0, EVENTS: []}
    with Journal(tmp_path, clock=lambda: now[0]) as journal:
        progress, world = StudyProgress(plan, journal, None, later=10), MadeUp()

        def drive(candidate: Candidate, missions: range) -> None:
            for mission in missions:
                now[0] += 2.0  # [s]
                journal.add(candidate, mission, row)
                progress.episode(candidate, row)

        def trial(number: int, candidate: Candidate, count: int) -> Trial:
            return Trial(
                number,
                candidate,
                {},
                "complete",
                tuple(range(count)),
                (1.0,),
                (1.0,),
                None,
                "",
            )

        assert progress.when == "while the original was driven"
        drive(original, range(8))
        best = trial(0, original, 8)
        progress.trial(best, best, world)
        assert progress.remaining is None and progress.when == "after 0 of 4 trials"
        drive(other, range(4))
        progress.trial(trial(1, other, 4), best, world)
        assert progress.remaining == pytest.approx(2.0 * (3 * 4 + 10))
        drive(Candidate("trial-2", {"node.x": 0.6}), range(3))
        assert progress.remaining == pytest.approx(2.0 * (3 * 4 - 3 + 10)), (
            "it falls while a trial is driven"
        )
        now[0] += 1.5
        assert progress.remaining == pytest.approx(2.0 * (3 * 4 - 3 + 10) - 1.5)
        progress.begin("final choice and test")
        assert progress.when == "during the final choice and test"
        now[0] -= 1.5
        drive(Candidate("incumbent", {"node.x": 0.6}), range(8, 12))
        assert progress.remaining == pytest.approx(2.0 * (10 - 4))
        assert (
            progress.text
            == "final choice and test: 4 of at most 10 deliveries driven, at most about 12 s left"
        )


@pytest.mark.parametrize(
    "name", ["margin", "lower_bound", "cvar", "margin@sla>=0.9", "-duration_s"]
)
def test_the_live_interval_is_that_of_the_objective(tmp_path: Path, name: str) -> None:
    world, objectives = MadeUp(), parse_objectives(name)
    plan = Plan(SPACE, objectives, tuple(range(48)), 3)
    with Journal(tmp_path) as journal:
        progress = StudyProgress(plan, journal, None)
        Search(
            plan,
            make_sampler("random", SPACE, 5, 3, 1),
            world,
            lambda a, b: progress.trial(a, b, world),
        ).run()
    interval, best = progress.interval, progress.best
    assert best is not None and interval.value == best.values[0]
    assert interval.low is None or (
        interval.high is not None and interval.low <= best.values[0] <= interval.high
    )
    text = f"{best.values[0]:.4g}" if name == "-duration_s" else f"{best.values[0]:.2f}"
    assert f"best {text} " in progress.text


def test_a_gain_of_no_more_than_a_cent_is_none() -> None:
    (objective,) = parse_objectives("margin")
    plan, evaluator = (
        SimpleNamespace(objectives=[objective], missions=()),
        SimpleNamespace(rows=lambda *given: []),
    )
    asked = SimpleNamespace(_plan=plan, _evaluator=evaluator)
    cent, more, zero = (
        SimpleNamespace(values=(value,), candidate=None)
        for value in (objective.resolution, 0.011, 0.0)
    )
    assert not Search._is_better(asked, cent, zero) and Search._is_better(asked, more, zero)
