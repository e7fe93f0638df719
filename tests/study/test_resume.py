"""A run that was cut off goes on, from its folder alone, to what it would have been."""

import dataclasses
import json
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Generator, Iterable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from harness.execution.executors import InProcess
from harness.execution.workers import Finished, Workers
from harness.storage.checksums import CHECKSUMS
from harness.storage.manifest_file import extended_from
from harness.storage.new_run import MANIFEST, create_run
from harness.storage.run_folder import JOURNAL, RunFolder
from harness.storage.shipped import shipped
from harness.study.drive import TABLES, drive_missing, finish
from harness.study.manifest import about, load_study, parameters
from harness.task.study import Study, make_study
from navbench.cli.app import main
from navstack.errors import InputError
from tests.rules import short_rules

NAVBENCH = [sys.executable, "-c", "from navbench.cli.app import main; main()"]
SAME = ("episodes.parquet", "events.parquet", "summary.json")  # whatever the machine does
EPISODES = 6
RULES = short_rules(2.0)


class Shuffled(Workers):
    """Takes the tasks in another order."""

    def run(
        self,
        function: Callable[[Any], Any],
        tasks: Iterable[Any],
        *more: Any,
    ) -> Generator[Finished[Any, Any], None, None]:
        """Shuffle first."""
        shuffled = list(tasks)
        random.Random(1).shuffle(shuffled)
        return super().run(function, shuffled, *more)


class Failing(Workers):
    """Loses some of the deliveries to the machine."""

    def run(
        self,
        function: Callable[[Any], Any],
        tasks: Iterable[Any],
        *more: Any,
    ) -> Generator[Finished[Any, Any], None, None]:
        """Fail in every second one."""
        for finished in super().run(function, tasks, *more):
            if finished.task.episode % 2:
                finished = dataclasses.replace(finished, result=None, error="there is no map")
            yield finished


def options(folder: Path, hall: Path) -> dict[str, Any]:
    """A study of short deliveries in a hall with files of the user's own."""
    (folder / "short.yaml").write_text(RULES)
    (folder / "world.yaml").write_text((shipped("params") / "worlds" / "easy.yaml").read_text())
    files = {"rules": str(folder / "short.yaml"), "world": str(folder / "world.yaml")}
    files["map_name"] = str(hall)
    return {"stacks": ["parked"], "episodes": EPISODES, "seed": 3, "pedestrians": 4, **files}


def begin(path: Path, study: Study) -> Path:
    create_run(path, about(study, ["navbench"]), parameters(study))
    return path


def go_on(path: Path, stop_after: int = EPISODES, workers: Workers | None = None) -> Path:
    """Drive what a folder lacks, in this process, until as many deliveries are finished.

    Then interrupt.
    """
    study = load_study(path, 1)

    def on_finished(finished: object, record: object) -> None:
        if len(folder.rows) == stop_after < EPISODES:
            raise KeyboardInterrupt

    with RunFolder(path, TABLES, study.total) as folder:
        try:
            drive_missing(study, folder, workers or Workers(1, InProcess), on_finished)
        except KeyboardInterrupt:
            assert len(folder.rows) == stop_after
        finish(study, folder)
    return path


def same(path: Path) -> dict[str, bytes]:
    return {name: (path / name).read_bytes() for name in SAME}


def complain(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    with pytest.raises(SystemExit) as leaving:
        main(["run", *arguments])
    assert leaving.value.code == 1
    said = capsys.readouterr()
    assert said.out == "" and said.err.count("\n") == 1
    return said.err


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory, hall: Path) -> Study:
    return make_study(**options(tmp_path_factory.mktemp("files"), hall))


@pytest.fixture(scope="module")
def whole(study: Study, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return go_on(begin(tmp_path_factory.mktemp("whole") / "run", study))


def test_interrupted_twice_it_ends_as_uninterrupted(
    study: Study,
    whole: Path,
    tmp_path: Path,
) -> None:
    path = begin(tmp_path / "run", study)
    for stop_after in (2, 5, EPISODES):
        go_on(path, stop_after)
    assert same(path) == same(whole)


@pytest.mark.parametrize("stop_after", [EPISODES, 4])
def test_what_ended_in_an_error_is_driven_again_on_request(
    study: Study,
    whole: Path,
    tmp_path: Path,
    stop_after: int,
    capsys: pytest.CaptureFixture[str],
) -> None:
    path = go_on(begin(tmp_path / "run", study), stop_after, Failing(1, InProcess))
    with RunFolder(path, TABLES, EPISODES) as folder:
        assert sum(map(bool, folder.rows.values("error"))) == stop_after // 2
    go_on(path)
    assert same(path) != same(whole), "errors stay unless that is asked for"
    for _ in range(2):  # the second time there is nothing to drive
        with pytest.raises(SystemExit) as leaving:
            main(["run", "--resume", str(path), "--retry-errors", "--workers", "1"])
        assert not leaving.value.code
        assert same(path) == same(whole)
    said = capsys.readouterr().err
    assert "is complete" in said and f"going on after {EPISODES - stop_after // 2} of 6" in said
    assert "--retry-errors goes with --resume" in complain(capsys, "--retry-errors")


def test_lines_that_were_cut_off_or_damaged_are_driven_again_too(
    study: Study, whole: Path, tmp_path: Path
) -> None:
    path = go_on(begin(tmp_path / "run", study), 4, Failing(1, InProcess))
    lines = (path / JOURNAL).read_bytes().splitlines(keepends=True)
    (path / JOURNAL).write_bytes(b"".join([b"{}\n", *lines[1:], lines[0][:40]]))
    with RunFolder(path, TABLES, EPISODES, drops_errors=True) as folder:
        assert len(folder.rows) == 1 and not any(folder.rows.values("error"))
        assert "line 1 is damaged" in folder.notes[0]
    assert same(go_on(path)) == same(whole)


@pytest.mark.parametrize("kind", ["pipe", "link"])
def test_a_journal_that_is_no_file_is_refused(study: Study, tmp_path: Path, kind: str) -> None:
    path = begin(tmp_path / "run", study)
    elsewhere = tmp_path / "elsewhere"
    elsewhere.write_bytes(b"{}\n")
    if kind == "pipe":
        os.mkfifo(path / JOURNAL)
    else:
        (path / JOURNAL).symlink_to(elsewhere)
    with pytest.raises(InputError, match="cannot be written"):
        RunFolder(path, TABLES, EPISODES, drops_errors=True)
    assert (path / JOURNAL).is_symlink() is (kind == "link")
    assert elsewhere.read_bytes() == b"{}\n"


def test_the_order_of_work_changes_nothing(study: Study, whole: Path, tmp_path: Path) -> None:
    path = go_on(begin(tmp_path / "run", study), workers=Shuffled(1, InProcess))
    assert same(path) == same(whole)


def test_the_folder_alone_tells_what_to_drive(whole: Path, tmp_path: Path, hall: Path) -> None:
    """The user's files change and vanish after the beginning."""
    path = begin(tmp_path / "run", make_study(**options(tmp_path, hall)))
    go_on(path, 2)
    (tmp_path / "short.yaml").write_text(short_rules(3.0))
    (tmp_path / "world.yaml").unlink()
    assert same(go_on(path)) == same(whole)


@pytest.mark.slow
def test_killed_with_its_workers_it_goes_on_with_a_cold_cache(
    whole: Path, tmp_path: Path, hall: Path
) -> None:
    path = tmp_path / "run"
    given = options(tmp_path, hall)
    arguments = [
        "--stack",
        "parked",
        "--episodes",
        str(EPISODES),
        "--seed",
        "3",
        "--pedestrians",
        "4",
    ]
    arguments += [
        "--rules",
        given["rules"],
        "--world",
        given["world"],
        "--map",
        given["map_name"],
        "--out",
        str(path),
        "--workers",
        "2",
    ]
    process = subprocess.Popen(
        [*NAVBENCH, "run", *arguments], start_new_session=True, stderr=subprocess.PIPE
    )
    deadline = time.monotonic() + 120.0
    while not (path / JOURNAL).exists() or not (path / JOURNAL).stat().st_size:
        assert time.monotonic() < deadline and process.poll() is None
        time.sleep(0.02)
    os.killpg(process.pid, signal.SIGKILL)
    process.communicate()
    assert not (path / "episodes.parquet").exists()
    environment = {**os.environ, "NAVSTACK_CACHE": str(tmp_path / "cold")}
    resumed = subprocess.run(
        [*NAVBENCH, "run", "--resume", str(path), "--workers", "1", "--json"],
        capture_output=True,
        text=True,
        env=environment,
        timeout=120,
        check=False,
    )
    assert resumed.returncode == 0, resumed.stderr
    assert "going on after" in resumed.stderr
    counted = f"{EPISODES} of {EPISODES} deliveries: {EPISODES} timeout\n"
    assert resumed.stderr.endswith(counted), "those of before as well"
    assert same(path) == same(whole)


class Listening(Workers):
    """Hears of tasks, and drives none."""

    heard: list[tuple[int, int]]

    def run(
        self,
        function: Callable[[Any], Any],
        tasks: Iterable[Any],
        *more: Any,
    ) -> Generator[Finished[Any, Any], None, None]:
        """Remember stack and mission of each."""
        self.heard = [(task.stack_number, task.episode) for task in tasks]
        yield from ()


@pytest.mark.parametrize(
    ("stacks", "turn", "told"),
    [
        (2, 1, [(0, 0), (1, 0), (1, 1), (0, 1), (0, 2), (1, 2)]),
        (3, 2, [(0, 0), (0, 1), (1, 0), (1, 1), (2, 0), (2, 1), (2, 2), (1, 2), (0, 2)]),
    ],
)
def test_stacks_take_turns_of_a_mission_or_where_there_are_many_of_several(
    stacks: int, turn: int, told: list[tuple[int, int]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Stack and mission of each delivery: what an interrupt leaves are the same missions."""
    monkeypatch.setattr("harness.study.drive.TURN", turn)
    known = make_study(stacks=["parked", "nav2-gps"], episodes=3, workers=1)
    study = dataclasses.replace(known, stacks=(known.stacks * 2)[:stacks])
    workers = Listening(1, InProcess)
    folder = SimpleNamespace(finished=frozenset())
    drive_missing(study, folder, workers, lambda *_: None)  # type: ignore[arg-type]
    assert workers.heard == told and len(set(told)) == study.total


def test_a_finished_run_says_so_and_prints_its_tables(
    whole: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = same(whole)
    with pytest.raises(SystemExit) as leaving:
        main(["run", "--resume", str(whole), "--json"])
    said = capsys.readouterr()
    assert leaving.value.code == 0
    assert f"is complete, with {EPISODES} deliveries" in said.err
    assert json.loads(said.out)["runs"][0]["episodes"] == EPISODES
    assert same(whole) == before


@pytest.mark.parametrize(
    "others", [["--seed", "4"], ["--stack", "parked"], ["--out", "x"], ["--strict"]]
)
def test_a_resumed_run_takes_no_other_study(
    whole: Path,
    capsys: pytest.CaptureFixture[str],
    others: list[str],
) -> None:
    line = complain(capsys, "--resume", str(whole), "--workers", "1", *others)
    assert f"leave out {others[0]}" in line


def lengthened(path: Path, episodes: int) -> None:
    with pytest.raises(SystemExit) as leaving:
        main(["run", "--resume", str(path), "--episodes", str(episodes), "--workers", "1"])
    assert leaving.value.code == 0


@pytest.mark.slow
def test_a_run_that_gets_more_deliveries_is_as_one_that_had_them_at_once(
    study: Study, whole: Path, tmp_path: Path, in_process: None
) -> None:
    """Its rows; the manifest tells how many somebody had seen when he asked for more."""
    few = go_on(begin(tmp_path / "run", dataclasses.replace(study, episodes=2)), stop_after=2)
    assert extended_from(few) == []
    for episodes in (4, 4, EPISODES):
        lengthened(few, episodes)
    assert same(few) == same(whole) and extended_from(few) == [2, 4]
    assert json.loads((few / MANIFEST).read_text())["episodes"] == EPISODES


@pytest.mark.parametrize(
    ("only", "episodes", "words"),
    [
        ((), EPISODES - 1, f"made for {EPISODES} deliveries a stack; give {EPISODES} or more"),
        ((), 10_000_000, "at most 1000000"),
        (tuple(range(1, 1 + EPISODES)), EPISODES + 1, "that --only chose"),
    ],
)
def test_a_run_gets_no_fewer_and_no_others(
    study: Study,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    only: tuple[int, ...],
    episodes: int,
    words: str,
) -> None:
    path = begin(tmp_path / "run", dataclasses.replace(study, only=only))
    before = (path / MANIFEST).read_bytes()
    asked = ["--resume", str(path), "--episodes", str(episodes)]
    assert words in complain(capsys, *asked, "--workers", "1")
    assert (path / MANIFEST).read_bytes() == before


def test_a_resumed_run_needs_a_worker(whole: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "--workers 0 is out of range" in complain(
        capsys, "--resume", str(whole), "--workers", "0"
    )


def test_a_folder_without_a_run_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert f"'{tmp_path}' holds no run" in complain(capsys, "--resume", str(tmp_path))


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("versions", {"navbench": "0.0.1"}, "made by navbench 0.0.1"),
        ("map_sha256", "0" * 64, "map '.*hall.yaml' has changed"),
        ("episodes", 0, "whole number of 1 to"),
        ("episodes", 1e9, "not a whole number"),
        ("stacks", [], "stacks"),
        ("seed", "many", "seed"),
        ("start", [1, 2], "start"),
    ],
)
def test_a_manifest_that_does_not_fit_is_refused(
    study: Study,
    tmp_path: Path,
    key: str,
    value: object,
    words: str,
) -> None:
    path = begin(tmp_path / "run", study)
    content = json.loads((path / MANIFEST).read_text()) | {key: value}
    (path / MANIFEST).write_text(json.dumps(content))
    (path / CHECKSUMS).unlink()
    with pytest.raises(InputError, match=words):
        load_study(path)


def test_a_stack_cannot_lead_out_of_the_folder(study: Study, tmp_path: Path) -> None:
    path = begin(tmp_path / "run", study)
    content = json.loads((path / MANIFEST).read_text())
    content["stacks"][0]["robot"] = "/etc/passwd"
    (path / CHECKSUMS).unlink()
    (path / MANIFEST).write_text(json.dumps(content))
    assert load_study(path).stacks[0].robot == str(path / "params" / "parked-robot.yaml")
    content["stacks"][0]["name"] = "../../stack"
    (path / MANIFEST).write_text(json.dumps(content))
    with pytest.raises(InputError, match="not the name of a stack"):
        load_study(path)


@pytest.mark.parametrize("stack", ["nav2-gps", "nav2-stock", "paper-gps", "rpp-gps"])
def test_stored_parameters_are_those_that_were_given(stack: str, tmp_path: Path) -> None:
    """Written, read back and written again, the parameters of a run are the same."""
    given = make_study(
        stacks=[stack],
        episodes=1,
        pedestrians=7,
        people="social_force",
        start=(1.0, 2.0, 0.5),
    )
    path = begin(tmp_path / "run", given)
    stored = load_study(path)
    files = [name for name in parameters(given) if name.endswith(".yaml")]
    assert len(files) == 6
    assert all(parameters(stored)[name] == parameters(given)[name] for name in files)
    unlike = ("stack", "world", "rules", "prices", "pedestrians", "people")
    assert dataclasses.replace(
        stored.template, **{key: getattr(given.template, key) for key in unlike}
    ) == (given.template)
