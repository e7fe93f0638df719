"""A study on disk: nothing is driven twice, and nothing on the way changes its trials."""

import dataclasses
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from harness.audit.pairs import EVENTS
from harness.economics.prices import load_prices
from harness.execution.executors import InProcess
from harness.execution.workers import Workers
from harness.storage.files import LOCK
from harness.storage.new_run import ABLATION, TUNING
from harness.storage.run_folder import JOURNAL
from harness.storage.shipped import shipped
from harness.storage.tables import read_rows
from harness.study.places import Where
from harness.study.stored_run import load_run
from harness.task.study import EpisodeTask, RandomStreams, make_study
from harness.tuning.budget import Budget
from harness.tuning.declaration import StudyDeclaration, parse_duration, sizes
from harness.tuning.evaluation import (
    FIRST_TEST,
    MARGIN,
    Candidate,
    seed_and_episode,
    unseen_seed,
)
from harness.tuning.journal import Journal
from harness.tuning.notes import notes_after_search, notes_before
from harness.tuning.objective import parse_objectives
from harness.tuning.output import (
    DOCUMENT,
    TRIALS,
    TUNED,
    Request,
    _difference,
    requested,
)
from harness.tuning.result import Trial
from harness.tuning.sampler import make_sampler
from harness.tuning.search import Plan, Search
from harness.tuning.space.file import OF_TRIAL
from harness.tuning.stack_evaluator import StackEvaluator, margin_of
from harness.tuning.study import TuningStudy, has_begun, load_tuning, run_search
from navbench.api.tuning.tune import resume_tuning
from navbench.cli.app import main
from navstack.errors import InputError, ParameterError
from tests.rules import short_rules

from .made_up import SPACE, MadeUp

NAVBENCH = [sys.executable, "-c", "from navbench.cli.app import main; main()"]
RULES = short_rules(2.0)
OTHER = Candidate("trial-1", {"controller_server.FollowPath.PathAlign.scale": 3.0})
ORIGINAL = Candidate("original", {})
DRAWN = 25  # deliveries after which trials come from the sampler's model


@pytest.fixture
def task(tmp_path: Path, hall: Path) -> EpisodeTask:
    """A short delivery in a hall."""
    (tmp_path / "short.yaml").write_text(RULES)
    study = make_study(
        stacks=["nav2-stock"],
        localizer="ground_truth",
        episodes=4,
        seed=3,
        pedestrians=4,
        map_name=str(hall),
        rules=str(tmp_path / "short.yaml"),
    )
    return study.template


def rows(
    folder: Path,
    task: EpisodeTask,
    asked: list[tuple[Candidate, list[int]]],
    most: int = 99,
) -> list[Any]:
    """The rows of candidates, and how many episodes were driven for them.

    Interrupted after ``most``.
    """
    driven: list[str] = []

    def on_episode(candidate: Candidate, row: dict[str, Any]) -> None:
        driven.append(candidate.name)
        if len(driven) >= most:
            raise KeyboardInterrupt

    with Journal(folder) as journal, Workers(1, InProcess) as workers:
        evaluator = StackEvaluator(task, workers, journal, on_episode, folder)
        return [*(evaluator.rows(*each) for each in asked), len(driven)]


def test_nothing_is_driven_twice_and_an_interrupt_changes_nothing(
    tmp_path: Path, task: EpisodeTask
) -> None:
    whole, cut = tmp_path / "whole", tmp_path / "cut"
    whole.mkdir()
    cut.mkdir()
    asked = [(ORIGINAL, [1, 0]), (OTHER, [0, FIRST_TEST])]
    first, second, driven = rows(whole, task, asked)
    assert driven == 4 and [row["episode"] for row in first] == [1, 0]
    assert [row["seed"] for row in second] == [3, unseen_seed(3)]
    assert {row["stack"] for row in first} == {"original"} and all(
        row[MARGIN] < 0.0 for row in first
    )
    assert all(isinstance(row[EVENTS], list) for row in first)
    assert {row["outcome"] for row in first} == {"timeout"}
    assert margin_of({**first[0], "pieces_at_start": None}, load_prices("costnav")) is None, (
        "no cargo, no margin"
    )
    assert rows(whole, task, asked) == [first, second, 0]
    with pytest.raises(KeyboardInterrupt):
        rows(cut, task, asked, 3)
    with (cut / JOURNAL).open("ab") as journal:
        journal.write(b'{"values": {}, "mission": 7, "ro')  # as if the power had failed
    assert rows(cut, task, asked) == [first, second, 1]
    incumbent = Candidate("incumbent", OTHER.values)
    assert rows(whole, task, [(incumbent, [0])])[0][0] == {**second[0], "stack": "incumbent"}


def test_what_follows_a_small_search_is_small() -> None:
    assert sizes(100, 32) == {"test_episodes": 400, "final_episodes": 128, "waterfall_missions": 40}
    assert sizes(50, 16) == {"test_episodes": 100, "final_episodes": 32, "waterfall_missions": 10}
    assert sizes(3, 2) == {"test_episodes": 20, "final_episodes": 4, "waterfall_missions": 0}


def test_values_that_cannot_be_had_are_refused(tmp_path: Path, task: EpisodeTask) -> None:
    bad = Candidate("trial-1", {"controller_server.FollowPath.vx_samples": 1_000_000})
    with pytest.raises(ParameterError, match="at most 100,000 are allowed"):
        rows(tmp_path, task, [(bad, [0])])


def test_a_damaged_journal_is_refused(tmp_path: Path) -> None:
    good = {
        "values": {},
        "mission": 0,
        "row": {"stack": "a", "outcome": "sla"},
        EVENTS: [],
        "elapsed_s": 2.0,
    }
    (tmp_path / JOURNAL).write_text("nonsense\n" + json.dumps(good) + "\n")
    with pytest.raises(InputError, match="line 1 is damaged"):
        Journal(tmp_path)
    (tmp_path / JOURNAL).write_text(json.dumps(good) + "\n")
    with Journal(tmp_path, clock=lambda: 5.0) as journal:
        assert len(journal) == 1 and journal.elapsed == 2.0 and (tmp_path / LOCK).exists()
        with pytest.raises(InputError, match="being written"):
            Journal(tmp_path)


def test_training_and_test_missions_share_no_generator() -> None:
    train = {seed_and_episode(7, number) for number in range(200)}
    test = {seed_and_episode(7, FIRST_TEST + number) for number in range(200)}
    assert not train & test and {seed for seed, _ in test} == {unseen_seed(7)} != {7}
    draws = {float(RandomStreams(*each)["mission"].random()) for each in train | test}
    assert len(draws) == 400


def test_budgets() -> None:
    assert [parse_duration(text) for text in ("90s", "30m", "1h30m", "1.5h")] == [
        90.0,
        1800.0,
        5400.0,
        5400.0,
    ]
    for text in ("", "0s", "30", "half an hour", "-5m"):
        with pytest.raises(InputError, match="--budget"):
            parse_duration(text)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--space", "dwb_critic"], "did you mean 'dwb_critics'?"),
        (["--space", "dwb_critics", "--space", "dwb_critics"], "dwb_critics is given twice"),
        (["--finalists", "-1"], "--finalists -1 is out of range"),
        (["--objective", "margim"], "did you mean 'margin'?"),
        (["--sampler", "tpa"], "did you mean 'tpe'?"),
        (["--trials", "0"], "--trials 0 is out of range"),
        (["--episodes", "1"], "--episodes 1 is out of range"),
        (["--stack", "parked"], "does not drive by a Nav2 file"),
        (["--stack", "mpc-gps-ekf"], "has none of its parameters"),
        (["--budget", "soon"], "is no duration"),
        (["--resume", "/nowhere"], "holds no run"),
        (["--resume", "/nowhere", "--trials", "7"], "leave out --trials"),
    ],
)
def test_bad_input_is_one_line(
    arguments: list[str],
    said: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    out = [] if "--resume" in arguments else ["--out", str(tmp_path / "out")]
    with pytest.raises(SystemExit) as leaving:
        main(["tune", *arguments, *out])
    error = capsys.readouterr().err
    assert leaving.value.code == 1 and said in error and error.count("\n") == 1
    assert not (tmp_path / "out").exists()


def arguments(task: EpisodeTask, workers: int, more: list[str]) -> list[str]:
    options = ["tune", "--json", "--workers", str(workers)]
    if "--resume" not in more:
        options += [
            "--stack",
            str(shipped("params") / "nav2" / "stock.yaml"),
            "--localizer",
            "ground_truth",
        ]
        options += ["--map", task.map_name, "--rules", task.rules, "--pedestrians", "4"]
        options += ["--trials", "14", "--episodes", "2"]
        options += ["--test-episodes", "2", "--waterfall", "0", "--objective", "+distance_m"]
        options += ["--finalists", "2", "--final-episodes", "2"]
    return [*options, *more]


def tune_here(task: EpisodeTask, folder: Path, *more: str) -> None:
    """A study in this process, with ``in_process``."""
    with pytest.raises(SystemExit) as leaving:
        main(arguments(task, 1, [*more, "--out", str(folder)]))
    assert leaving.value.code == 0


def tune(task: EpisodeTask, workers: int, more: list[str]) -> "subprocess.Popen[str]":
    """A study in a process of its own."""
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[3])}
    words = [*NAVBENCH, *arguments(task, workers, more)]
    return subprocess.Popen(words, stdout=subprocess.PIPE, text=True, env=environment)


def told(text: str, folder: Path) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """The document but for what names its folder, and the trials."""
    document = json.loads(text)
    assert json.loads((folder / DOCUMENT).read_text())["folder"] == str(folder)
    plain = {key: value for key, value in document.items() if key not in ("folder", "command")}
    return plain, list(
        read_rows(folder / TRIALS, {**OF_TRIAL, "path_align": "double", "forward_point": "double"})
    )


@pytest.mark.slow
def test_a_killed_study_goes_on_with_two_workers_to_what_one_makes(
    tmp_path: Path,
    task: EpisodeTask,
    in_process: None,
    capsys: pytest.CaptureFixture[str],
) -> None:
    whole, cut = tmp_path / "whole", tmp_path / "cut"
    tune_here(task, whole)
    one = told(capsys.readouterr().out, whole)
    killed = tune(task, 1, ["--out", str(cut)])
    deadline = time.monotonic() + 300.0
    while not (cut / JOURNAL).exists() or (cut / JOURNAL).read_bytes().count(b"\n") < DRAWN:
        assert time.monotonic() < deadline and killed.poll() is None
        time.sleep(0.05)
    killed.send_signal(signal.SIGKILL)
    killed.wait()
    assert not (cut / DOCUMENT).exists()
    resumed = tune(task, 2, ["--resume", str(cut)])
    assert told(resumed.communicate(timeout=500)[0], cut) == one and resumed.returncode == 0
    assert (cut / TUNED).read_bytes() == (whole / TUNED).read_bytes()
    assert "# odometry noise" in (cut / TUNED).read_text(), "comments stay"


def test_what_resume_was_asked_for_holds_until_it_is_done(
    tmp_path: Path,
    task: EpisodeTask,
    in_process: None,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """The command that is printed after Ctrl-C names the folder alone."""
    asked: list[tuple[float | None, int]] = []

    def interrupted(study: TuningStudy, *_: Any) -> None:
        asked.append((study.declaration.budget, study.declaration.test_episodes))
        raise KeyboardInterrupt

    monkeypatch.setattr("navbench.api.tuning.driving._search_and_test", interrupted)
    folder = tmp_path / "study"
    with pytest.raises(SystemExit):
        main(arguments(task, 1, ["--budget", "1h", "--out", str(folder)]))
    assert requested(folder) == Request()
    for more in (["--budget", "3h"], [], ["--test-episodes", "9"], []):
        with pytest.raises(SystemExit):
            main(["tune", "--resume", str(folder), "--workers", "1", *more])
    assert asked == [(3600.0, 2), (10_800.0, 2), (10_800.0, 2), (10_800.0, 9), (10_800.0, 9)]
    assert f"next: navbench tune --resume {folder}\n" in capsys.readouterr().err
    monkeypatch.setattr("navbench.api.tuning.driving._search_and_test", lambda *_: None)
    monkeypatch.setattr("navbench.api.tuning.driving.written", lambda *_: None)
    assert requested(folder) == Request(10_800.0, 9)
    resume_tuning(folder, where=Where(workers=1))
    assert requested(folder) == Request(), "it is done"


@pytest.mark.slow
def test_a_study_with_a_lost_delivery_says_so_and_ends_with_3(
    tmp_path: Path,
    task: EpisodeTask,
    in_process: None,
    capsys: pytest.CaptureFixture[str],
) -> None:
    folder = tmp_path / "study"
    tune_here(task, folder, "--trials", "2", "--test-episodes", "0", "--finalists", "0")
    lines = (folder / JOURNAL).read_text().splitlines(keepends=True)
    lost = json.loads(lines[2])  # the first of the first trial, which the second followed
    del lost["crc"]
    lost["row"] |= {
        "error": "its worker was lost 2 times",
        MARGIN: None,
        "outcome": None,
        "distance_m": None,
    }
    (folder / JOURNAL).write_text("".join((*lines[:2], json.dumps(lost) + "\n", *lines[3:])))
    with pytest.raises(SystemExit) as leaving:
        main(["tune", "--resume", str(folder), "--workers", "1"])
    assert leaving.value.code == 3
    assert (
        "episodes that ended in an error: 1, e.g. its worker was lost 2 times"
        in capsys.readouterr().err
    )


def test_the_explanation_takes_no_time_of_the_budget(tmp_path: Path) -> None:
    now = [0.0]
    row = {"stack": "a", "outcome": "sla", EVENTS: []}
    with Journal(tmp_path, clock=lambda: now[0]) as journal:
        now[0] = 10.0
        journal.stop_clock()
        now[0] = 500.0
        journal.add(ORIGINAL, 0, row)
        assert journal.elapsed == 10.0
    with Journal(tmp_path, clock=lambda: now[0]) as journal:
        now[0] = 503.0
        assert journal.elapsed == 13.0


def test_deliveries_without_a_result_are_driven_again_in_the_next_session(tmp_path: Path) -> None:
    lost = {"stack": "a", "error": "its worker was lost 2 times", MARGIN: None, EVENTS: []}
    row = {"stack": "a", "outcome": "sla", EVENTS: []}
    with Journal(tmp_path) as journal:
        journal.add(ORIGINAL, 0, row)
        journal.add(ORIGINAL, 1, lost)
        assert journal.get(ORIGINAL, 1) is not None, "in this session it stays lost"
        assert journal.errors == ["its worker was lost 2 times"]
    with Journal(tmp_path) as journal:
        assert (len(journal), journal.get(ORIGINAL, 1)) == (1, None)
        journal.add(ORIGINAL, 1, row)
    with Journal(tmp_path) as journal:
        assert (journal.get(ORIGINAL, 1) or {})["outcome"] == "sla"


def test_a_lost_delivery_of_a_trial_that_others_followed_stays_lost(tmp_path: Path) -> None:
    """The sampler was told of it, and asked for the next trial accordingly."""
    lost = {"stack": "a", "error": "its worker was lost 2 times", MARGIN: None, EVENTS: []}
    row = {"stack": "a", "outcome": "sla", EVENTS: []}
    last = Candidate("trial-2", {"controller_server.FollowPath.PathAlign.scale": 9.0})
    with Journal(tmp_path) as journal:
        for candidate, mission in ((OTHER, 0), (OTHER, FIRST_TEST), (last, 1)):
            journal.add(candidate, mission, lost)
        journal.add(last, 0, row)
    with Journal(tmp_path, searched=4) as journal:
        assert (journal.get(OTHER, 0) or {})["error"] and journal.errors == [lost["error"]]
        assert journal.get(OTHER, FIRST_TEST) is None and journal.get(last, 1) is None, (
            "these are driven again"
        )
        assert has_begun(journal, OTHER, (0,)), "it has begun before"


def test_a_text_that_is_not_utf_8_does_not_lock_a_study(tmp_path: Path) -> None:
    """Its journal may have been written before texts were cleaned."""
    lost, other = Candidate("trial", {"FollowPath.sim_time": 1.0}), Candidate("original", {})
    failed = {"stack": "trial-\udcff", "outcome": None, "error": "\udcff" * 9000, EVENTS: []}
    with Journal(tmp_path) as journal:
        journal.add(lost, 0, failed)
        journal.add(other, 0, {"stack": "x", "outcome": "arrived", EVENTS: [{"kind": "\udc80"}]})
    with Journal(tmp_path, searched=4) as journal:
        (error,) = journal.errors
        row = journal.get(other, 0)
    assert len(error) == 1000 and error.startswith(r"\udcff\udcff")
    assert row is not None and row[EVENTS] == [{"kind": r"\udc80"}]


def test_a_trial_that_no_file_can_have_is_gone_through_again(
    tmp_path: Path, task: EpisodeTask
) -> None:
    bad = Candidate("trial-1", {"controller_server.FollowPath.vx_samples": 1_000_000})
    with pytest.raises(ParameterError):
        rows(tmp_path, task, [(bad, [2, 0])])
    rows(tmp_path, task, [(OTHER, [0])])
    with Journal(tmp_path, searched=4) as journal:
        assert has_begun(journal, bad, (2, 0)) and journal.errors == []
        known = [journal.get(bad, mission) or {} for mission in (2, 0)]
        assert all("at most 100,000 are allowed" in row["error"] for row in known), (
            "nothing is added the next time"
        )
    with pytest.raises(ParameterError, match="at most 100,000 are allowed"):
        rows(tmp_path, task, [(bad, [2, 0])])


def test_the_pace_is_that_of_the_search(tmp_path: Path) -> None:
    now, row = [0.0], {"stack": "a", "outcome": "sla", EVENTS: []}
    with Journal(tmp_path, clock=lambda: now[0]) as journal:
        for mission in range(3):
            now[0] += 10.0
            journal.add(ORIGINAL, mission, row)
        journal.stop_clock()
        now[0] += 500.0
        journal.add(OTHER, 0, row)
        assert (len(journal), journal.timed, journal.elapsed) == (4, 3, 30.0)
    with Journal(tmp_path, clock=lambda: now[0]) as journal:
        assert (len(journal), journal.timed, journal.elapsed) == (4, 3, 30.0)


def test_notes_tell_what_one_might_not_expect() -> None:
    declaration = StudyDeclaration("a", "b", "margin", "tpe", 9, 31, 9, True, 0, None, "", "", ())
    both = notes_before(declaration, {"start": "0,0,0", "goal": "9,0,0"})
    assert ["the same way" in both[0], "no trial is dropped early: 31 --episodes" in both[1]] == [
        True,
        True,
    ]
    whole = dataclasses.replace(declaration, episodes=32)
    assert notes_before(whole, {"start": None, "goal": "9,0,0"}) == []
    assert len(notes_before(dataclasses.replace(whole, is_raced=False, episodes=31), {})) == 0


@pytest.mark.parametrize(
    ("driven", "is_exhausted", "budget", "elapsed", "told"),
    [
        (9, False, None, 50.0, []),
        (9, False, 100.0, 10.0, []),
        (
            9,
            False,
            100.0,
            50.0,
            ["note: the budget lasts for about 9 of the 20 deliveries of final choice and test;"],
        ),
        (7, False, 100.0, 10.0, ["the budget of 100 s cut off 2 of 9 trials; --resume"]),
        (7, True, 100.0, 10.0, ["after 7 of 9 trials there is no further point"]),
        (
            9,
            True,
            100.0,
            70.0,
            [
                "after 9 of 9 trials there is no further point",
                "note: the budget lasts for about 2 ",
            ],
        ),
    ],
)
def test_notes_after_the_search(
    driven: int,
    is_exhausted: bool,
    budget: float | None,
    elapsed: float,
    told: list[str],
) -> None:
    """Twenty deliveries of 3 s follow."""
    study: Any = SimpleNamespace(
        declaration=SimpleNamespace(trials=9),
        plan=SimpleNamespace(missions=range(8)),
        episodes_after_search=20,
    )
    search: Any = SimpleNamespace(
        trials=[None] * (driven + 1),
        is_exhausted=is_exhausted,
        is_futile=False,
    )
    journal: Any = SimpleNamespace(pace=3.0, elapsed=elapsed)
    notes = notes_after_search(study, search, journal, Budget(budget, journal))
    assert [note.startswith(begin) for note, begin in zip(notes, told, strict=True)] == [
        True
    ] * len(told)


class Earning(MadeUp):
    """A world in which every delivery earns the same."""

    usd = 3.49

    def _new(self, candidate: Candidate, mission: int) -> dict[str, Any]:
        return {**super()._new(candidate, mission), MARGIN: self.usd}


@pytest.mark.parametrize(
    ("usd", "begun", "is_over", "driven"),
    [
        (3.49, 0, False, 0),
        (3.49, 2, False, 2),  # of a study from before there was this rule
        (3.00, 0, False, 0),
        (2.98, 0, False, 5),
        (2.98, 2, True, 2),
    ],
)
def test_a_search_that_can_gain_nothing_or_is_over_drives_no_further_trial(
    tmp_path: Path,
    usd: float,
    begun: int,
    is_over: bool,
    driven: int,
) -> None:
    plan = Plan(SPACE, parse_objectives("margin"), tuple(range(4)), 5, fee=3.49)
    study: Any = SimpleNamespace(
        plan=plan,
        make_sampler=lambda: make_sampler("random", SPACE, 5, 5, 1),
        declaration=SimpleNamespace(trials=5),
        episodes_after_search=0,
        ended_after=begun if is_over else None,
    )
    world = Earning()
    world.usd = usd
    told: list[str] = []
    with Journal(tmp_path) as journal:

        def on_trial(trial: Trial, best: Trial) -> None:
            told.append(trial.candidate.name)

        whole = Search(plan, study.make_sampler(), world, lambda trial, best: None)
        whole.run()
        for trial in whole.trials[1 : 1 + begun]:
            journal.add(trial.candidate, 0, {"stack": "a", "outcome": "sla", EVENTS: []})
        budget = Budget(None, journal)
        found = run_search(study, world, journal, on_trial, budget)
        notes = notes_after_search(study, found, journal, budget)
    assert told == ["original", *(f"trial-{number}" for number in range(1, driven + 1))]
    stops = "the search stops: on its 4 training missions no file can earn 0.50 USD more than yours"
    assert notes == ([stops] if not driven else [])


def test_a_test_stays_as_long_as_it_was_driven(tmp_path: Path) -> None:
    row = {"stack": "a", "outcome": "sla", EVENTS: []}
    with Journal(tmp_path) as journal:
        for candidate, count in ((ORIGINAL, 9), (OTHER, 7)):
            for number in range(count):
                journal.add(candidate, FIRST_TEST + number, row)
        assert journal.driven((ORIGINAL, OTHER)) == 7
        assert journal.driven((ORIGINAL, Candidate("new", {"a": 1.0}))) == 0
        assert journal.driven([ORIGINAL], FIRST_TEST + 2) == 7


def test_a_folder_without_a_declaration_is_no_tuning_study(tmp_path: Path) -> None:
    nothing: Any = None
    with pytest.raises(
        InputError, match=r"is no tuning study: params/tuning\.yaml is missing; use navbench run"
    ):
        load_tuning(tmp_path, nothing)
    (tmp_path / "params").mkdir()
    (tmp_path / "params" / TUNING).write_text("speed: 3\n")
    with pytest.raises(InputError, match="unknown key 'speed'"):
        load_tuning(tmp_path, nothing)


def test_another_study_names_the_command_that_goes_on(tmp_path: Path) -> None:
    nothing: Any = None
    (tmp_path / "params").mkdir()
    (tmp_path / "params" / ABLATION).touch()
    said = (
        f"is no tuning study: it is an ablation, so go on with navbench ablate --resume {tmp_path}"
    )
    with pytest.raises(InputError, match=said):
        load_tuning(tmp_path, nothing)


def test_a_tuning_study_is_no_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "params").mkdir()
    (tmp_path / "params" / TUNING).touch()
    with pytest.raises(SystemExit):
        main(["run", "--resume", str(tmp_path)])
    assert (
        f"is a tuning study; go on with navbench tune --resume {tmp_path}"
        in capsys.readouterr().err
    )


def test_a_study_that_is_driven_names_the_newest_run_beside_it(tmp_path: Path) -> None:
    study = tmp_path / "study"
    (study / "params").mkdir(parents=True)
    for name in (f"params/{TUNING}", "run.json"):
        (study / name).write_text('{"seed": 0, "map_name": "a", "stacks": []}')
    (tmp_path / "latest").symlink_to(study)
    for age, name in enumerate(("new", "old", "older")):
        (tmp_path / name).mkdir()
        table = tmp_path / name / "episodes.parquet"
        table.touch()
        os.utime(table, (9.0 - age, 9.0 - age))
    with pytest.raises(InputError, match=f"newest run beside it is {tmp_path}/new$"):
        load_run(str(tmp_path / "latest"))


def test_a_finished_tuning_study_is_not_called_unfinished(tmp_path: Path) -> None:
    for name in (f"params/{TUNING}", "run.json"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text('{"seed": 0, "map_name": "a", "stacks": []}')
    with pytest.raises(InputError, match=f"navbench tune --resume {tmp_path} finishes it"):
        load_run(str(tmp_path))
    (tmp_path / DOCUMENT).touch()
    with pytest.raises(InputError, match=f"is finished, .* navbench run --stack {tmp_path}/tuned"):
        load_run(str(tmp_path))
    driven = tmp_path / "partings" / "abc" / "files"
    driven.mkdir(parents=True)
    (driven / "run.json").touch()
    with pytest.raises(InputError, match=f"is finished, and no run; give {driven}, the deliv"):
        load_run(str(tmp_path))


def test_a_full_disk_is_told_of_and_loses_nothing(tmp_path: Path) -> None:
    row = {"stack": "a", "outcome": "sla", EVENTS: []}
    with Journal(tmp_path) as journal:
        journal.add(ORIGINAL, 0, row)
        journal._file.close()
        journal._file = open("/dev/full", "ab")
        journal._open.callback(journal._file.close)
        with pytest.raises(
            InputError, match="1 finished deliveries are kept; make room and go on with --resume"
        ):
            journal.add(ORIGINAL, 1, row)
    with Journal(tmp_path) as journal:
        assert len(journal) == 1 and journal.get(ORIGINAL, 1) is None


def test_a_study_whose_folder_is_removed_keeps_its_deliveries(tmp_path: Path) -> None:
    folder, row = tmp_path / "study", {"stack": "a", "outcome": "sla", EVENTS: []}
    (folder / "params").mkdir(parents=True)
    (folder / "params" / TUNING).write_text("a: 1\n")
    with pytest.raises(InputError, match="removed, moved or replaced") as stopped:  # noqa: PT012
        with Journal(folder) as journal:
            journal.add(ORIGINAL, 0, row)
            shutil.rmtree(folder)
            journal.add(ORIGINAL, 1, row)
    kept = Path(str(stopped.value).rpartition(" ")[2])
    with Journal(kept) as journal:
        assert len(journal) == 2
    assert (kept / "params" / TUNING).is_file()


def test_a_difference_is_a_patch_also_without_a_last_line_end() -> None:
    assert _difference("a: 1\nb: 2", "a: 1\nb: 3").splitlines()[-4:] == [
        "-b: 2",
        "\\ No newline at end of file",
        "+b: 3",
        "\\ No newline at end of file",
    ]
    assert _difference("a: 1\r\n", "a: 1\r\n") == ""
