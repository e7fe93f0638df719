"""A Dask cluster gives the rows of a local run, whatever dies.

What cannot be used is refused in one line.
"""

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import pytest

from harness.execution.executors import InProcess
from harness.execution.workers import NoExecutorError, Workers
from harness.storage.new_run import create_run
from harness.storage.run_folder import RunFolder, count_finished
from harness.study.drive import TABLES, drive_missing, finish
from harness.study.manifest import about, load_study, parameters
from harness.task.study import Study, make_study
from navbench.cli.app import main
from navstack.dispatch import PINS, is_pinnable
from tests.rules import short_rules

dask = pytest.importorskip("dask", reason="the package dask (extra 'dask') is not installed")
distributed = pytest.importorskip(
    "distributed", reason="the package distributed (extra 'dask') is not installed"
)
from harness.execution.dask_cluster import DaskCluster  # noqa: E402 - needs distributed

pytestmark = pytest.mark.slow

Here = Callable[[], AbstractContextManager[None]]
EPISODES = 8
RULES = short_rules(2.0)
SAME = ("episodes.parquet", "events.parquet", "summary.json")  # whatever the machine does
TIME_LIMIT = 8.0  # [s]


def start_cluster(workers: int, threads: int = 1) -> Any:
    """A scheduler in this process, on a free port, with workers in processes of their own."""
    # it gives up workers that restart slowly
    dask.config.set({"distributed.deploy.lost-worker-timeout": "1h"})
    return distributed.LocalCluster(
        n_workers=workers,
        threads_per_worker=threads,
        processes=True,
        host="127.0.0.1",
        scheduler_port=0,
        dashboard_address=":0",
        memory_limit=0,
        silence_logs=False,
    )


PRELOADED = """
import os
from distributed import Client, LocalCluster
with (
    LocalCluster(n_workers=1, threads_per_worker=1, host="127.0.0.1", dashboard_address=":0",
                 preload_nanny=["navbench"]) as cluster,
    Client(cluster) as client,
):
    (found,) = client.run(lambda: os.environ.get("OPENBLAS_CORETYPE")).values()
    print(found)
"""


def test_a_preloaded_nanny_sets_up_its_workers() -> None:
    plain = {name: value for name, value in os.environ.items() if name not in PINS}
    done = subprocess.run(
        [sys.executable, "-c", PRELOADED],
        env={**plain, "PYTHONPATH": os.pathsep.join(sys.path)},
        capture_output=True,
        text=True,
        check=True,
    )
    expected = PINS["OPENBLAS_CORETYPE"] if is_pinnable() else None
    assert done.stdout.split() == [str(expected)]


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    with start_cluster(2) as cluster:
        yield cluster


@pytest.fixture
def two(cluster: Any) -> Any:
    """The cluster, once the workers that an earlier test killed are back."""
    with distributed.Client(cluster.scheduler_address, set_as_default=False) as client:
        client.wait_for_workers(2, timeout=120)
    return cluster


def connect(cluster: Any, *files: Path) -> DaskCluster:
    return DaskCluster(cluster.scheduler_address, ("numpy",), [str(file) for file in files], print)


def drive_on(
    cluster: Any, function: Callable[[Any], Any], tasks: list[Any], limit: float = 120.0
) -> dict[int, Any]:
    """What became of each task, by its number; the limit of each is in [s]."""
    with connect(cluster) as dask, Workers(9, dask.place, limit, dask.room) as workers:
        return {item.task[1]: item for item in workers.run(function, tasks)}


def make_attempt() -> Callable[[tuple[Path, int, str]], int]:
    """A function that travels as a whole.

    Workers need not import this module, which takes them seconds.
    """

    def attempt(task: tuple[Path, int, str]) -> int:
        """Leave a trace.

        Then, if so told, raise, or die or hang on the first attempt or on each.
        """
        folder, number, way = task
        (folder / f"{number}-{os.getpid()}").touch()
        is_first = len(list(folder.glob(f"{number}-*"))) == 1
        if way == "raise":
            raise FileNotFoundError("it is refused")
        if "always" in way or ("once" in way and is_first):
            if "die" in way:
                os.kill(os.getpid(), signal.SIGKILL)
            threading.Event().wait()
        return number

    return attempt


def test_tasks_that_raise_die_and_hang_harm_no_other(two: Any, tmp_path: Path) -> None:
    ways = {1: "die once", 3: "raise", 4: "die always", 6: "hang once"}
    tasks = [(tmp_path, number, ways.get(number, "")) for number in range(8)]
    finished = drive_on(two, make_attempt(), tasks, TIME_LIMIT)
    assert sorted(finished) == list(range(8))
    attempts = [len(list(tmp_path.glob(f"{number}-*"))) for number in range(8)]
    assert attempts == [1, 2, 1, 1, 2, 1, 2, 1]  # each in another process
    assert all(finished[number].result == number for number in (0, 1, 2, 5, 6, 7))
    assert finished[3].error == "FileNotFoundError: it is refused" and not finished[3].lost
    assert "was lost (killed" in finished[1].lost[0]
    assert finished[4].error.startswith("lost 2 times: its Dask worker tcp://127.0.0.1:")
    assert "ran for more than 8 s" in finished[6].lost[0]


def test_a_stopped_worker_is_noticed_by_its_silence(
    two: Any,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Its connection stays open, so that only its heartbeats tell; a busy worker's go on."""
    monkeypatch.setattr("harness.execution.dask_cluster.UNHEARD", 4.0)
    folder = str(tmp_path)

    def work(task: tuple[str, int]) -> int:
        import os
        import signal
        import time
        from pathlib import Path

        first = not list(Path(task[0]).glob(f"{task[1]}-*"))
        (Path(task[0]) / f"{task[1]}-{os.getpid()}").touch()
        if task[1] == 1 and first:
            os.kill(os.getpid(), signal.SIGSTOP)
        # longer than the silence, and busy
        deadline = time.monotonic() + (6.0 if task[1] == 0 else 0.0)
        while time.monotonic() < deadline:
            pass
        return task[1]

    with connect(two) as dask, Workers(9, dask.place, 60.0, dask.room) as workers:
        finished = {
            item.task[1]: item
            for item in workers.run(work, [(folder, number) for number in range(3)])
        }
    assert [finished[number].result for number in range(3)] == [0, 1, 2]
    assert not finished[0].lost and len(list(tmp_path.glob("0-*"))) == 1
    assert "stopped" in finished[1].lost[0] and len(list(tmp_path.glob("1-*"))) == 2


def test_closing_early_stops_what_runs(two: Any, tmp_path: Path) -> None:
    """As Ctrl-C does: the process of a task that would never end is killed."""
    with connect(two) as dask, Workers(9, dask.place, room=dask.room) as workers:
        tasks = workers.run(make_attempt(), [(tmp_path, 0, ""), (tmp_path, 1, "hang always")])
        assert next(tasks).result == 0
        while not (traces := list(tmp_path.glob("1-*"))):
            threading.Event().wait(0.05)
        tasks.close()
    with pytest.raises(ProcessLookupError):
        os.kill(int(traces[0].name.removeprefix("1-")), 0)


def test_workers_that_live_on_read_files_that_changed_between_studies(
    two: Any, tmp_path: Path
) -> None:
    def limit(task: tuple[str, int]) -> float:
        from harness.episode.files import rules_of

        return rules_of(task[0]).timeout

    rules = tmp_path / "short.yaml"
    for seconds in (2.0, 3.0):
        rules.write_text(short_rules(seconds))
        finished = drive_on(two, limit, [(str(rules), number) for number in range(4)])
        assert [(item.result, item.error) for item in finished.values()] == 4 * [(seconds, None)]


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory, hall: Path) -> Study:
    rules = tmp_path_factory.mktemp("files") / "short.yaml"
    rules.write_text(RULES)
    return make_study(
        stacks=["parked"],
        episodes=EPISODES,
        seed=3,
        pedestrians=4,
        rules=str(rules),
        map_name=str(hall),
    )


def begin(path: Path, study: Study) -> Path:
    create_run(path, about(study, ["navbench"]), parameters(study))
    return path


def same(path: Path) -> dict[str, bytes]:
    return {name: (path / name).read_bytes() for name in SAME}


@pytest.fixture(scope="module")
def expected(study: Study, tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """The files of a run in this process."""
    path = begin(tmp_path_factory.mktemp("local") / "run", study)
    with RunFolder(path, TABLES, study.total) as folder:
        drive_missing(
            load_study(path), folder, Workers(1, InProcess), lambda finished, record: None
        )
        finish(study, folder)
    return same(path)


def kill_one_at_work(cluster: Any) -> list[int]:
    """Kill the process of a worker that has a task; empty: none has one just now."""
    busy = {worker.address for worker in cluster.scheduler.workers.values() if worker.processing}
    at_work = [
        int(nanny.pid) for nanny in cluster.workers.values() if nanny.worker_address in busy
    ][:1]
    for process in at_work:
        os.kill(process, signal.SIGKILL)
    return at_work


def test_rows_are_those_of_a_local_run_though_a_worker_is_killed(
    two: Any,
    study: Study,
    expected: dict[str, bytes],
    tmp_path: Path,
) -> None:
    path, killed, lost = begin(tmp_path / "run", study), [], []

    def on_finished(finished: Any, record: Any) -> None:
        lost.extend(finished.lost)
        if not killed:
            killed.extend(kill_one_at_work(two))

    with (
        connect(two, path / "run.json") as dask,
        Workers(9, dask.place, room=dask.room) as workers,
        RunFolder(path, TABLES, study.total) as folder,
    ):
        drive_missing(load_study(path), folder, workers, on_finished)
        finish(study, folder)
    assert killed and len(lost) == 1 and "was lost (killed" in lost[0]
    assert same(path) == expected


SUITE = """
title: Somebody who stands
stacks: [parked]
maps: [MAP]
pedestrians: [2]
seeds: [0, 1]
episodes: 2
rules: RULES
"""
SHORT = ("--map", "MAP", "--rules", "RULES", "--pedestrians", "2", "--seed", "5")
STUDIES = {  # command, its words, and files that hold what was driven
    "suite": (
        ("suite.yaml",),
        ("*/episodes.parquet", "*/events.parquet", "suite.json", "table.parquet"),
    ),
    "ablate": ((*SHORT, "--localizers", "ground_truth,gps", "--episodes", "2"), SAME),
    "tune": (
        (
            *(
                *SHORT,
                "--stack",
                "nav2-stock",
                "--localizer",
                "ground_truth",
                "--space",
                "inflation",
                "--trials",
                "2",
            ),
            *("--episodes", "2", "--test-episodes", "2", "--finalists", "0", "--waterfall", "0"),
            *("--objective", "+distance_m"),
        ),
        ("trials.parquet", "tuned.nav2.yaml"),
    ),
}


@pytest.fixture
def files(tmp_path: Path, hall: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, str]:
    """A hall, rules that end a delivery after 2 s, and a suite; figures of suites are not drawn."""
    monkeypatch.setattr("harness.report.suite.document.draw_figures", lambda results, folder: [])
    (tmp_path / "short.yaml").write_text(RULES)
    made = {"MAP": str(hall), "RULES": str(tmp_path / "short.yaml")}
    suite = SUITE.replace("MAP", made["MAP"]).replace("RULES", made["RULES"])
    (tmp_path / "suite.yaml").write_text(suite)
    return made | {"suite.yaml": str(tmp_path / "suite.yaml")}


def kept(folder: Path, patterns: tuple[str, ...]) -> dict[str, bytes]:
    """The content of files in a folder, by their names."""
    found = {
        str(path.relative_to(folder)): path for pattern in patterns for path in folder.glob(pattern)
    }
    return {name: path.read_bytes() for name, path in found.items()}


@pytest.mark.parametrize("command", STUDIES)
def test_studies_of_every_kind_have_the_rows_of_local_ones(
    two: Any,
    command: str,
    files: dict[str, str],
    tmp_path: Path,
    driven_in_process: Here,
) -> None:
    words, patterns = STUDIES[command]
    given = [command, *(files.get(word, word) for word in words), "--workers", "2"]
    with pytest.raises(SystemExit) as ended:
        main(
            [
                *given,
                "--out",
                str(tmp_path / "dask"),
                "--executor",
                "dask",
                "--scheduler",
                two.scheduler_address,
            ]
        )
    assert ended.value.code == 0
    with pytest.raises(SystemExit) as ended, driven_in_process():
        main([*given, "--out", str(tmp_path / "local")])
    assert ended.value.code == 0
    rows = kept(tmp_path / "local", patterns)
    assert len(rows) >= len(patterns) and kept(tmp_path / "dask", patterns) == rows


def complaint(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """The last of what a command says that ends in one line of complaint."""
    with pytest.raises(SystemExit) as leaving:
        main(list(arguments))
    said = capsys.readouterr()
    assert leaving.value.code == 1 and said.out == ""
    lines = [line for line in said.err.splitlines() if line.startswith("navbench: ")]
    assert len(lines) == 1 and "Traceback" not in said.err
    return lines[0]


def test_a_lost_scheduler_keeps_what_is_finished_and_the_run_goes_on(
    two: Any,
    study: Study,
    expected: dict[str, bytes],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # so long it is looked for again
    monkeypatch.setattr("harness.execution.dask_cluster.CONNECT", 4.0)
    path, passing = begin(tmp_path / "run", study), start_cluster(1)

    def close_after_two() -> None:
        while count_finished(path) < 2:
            threading.Event().wait(0.02)
        passing.close()

    closing = threading.Thread(target=close_after_two)
    closing.start()
    line = complaint(
        capsys,
        "run",
        "--resume",
        str(path),
        "--executor",
        "dask",
        "--scheduler",
        passing.scheduler_address,
    )
    closing.join()
    assert "is lost" in line and f"--resume {path}" in line
    assert 2 <= count_finished(path) < EPISODES
    with pytest.raises(SystemExit) as leaving:
        main(
            [
                "run",
                "--resume",
                str(path),
                "--executor",
                "dask",
                "--scheduler",
                two.scheduler_address,
            ]
        )
    assert leaving.value.code == 0
    assert "going on after" in capsys.readouterr().err
    assert same(path) == expected


def test_workers_with_several_threads_are_refused() -> None:
    with (
        start_cluster(1, threads=2) as cluster,
        pytest.raises(NoExecutorError, match="has 2 threads.*--nthreads 1"),
    ):
        with connect(cluster):
            pass


def test_a_scheduler_that_is_not_there_is_one_line(
    study: Study,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("harness.execution.dask_cluster.CONNECT", 1.0)
    path = begin(tmp_path / "run", study)
    line = complaint(
        capsys,
        "run",
        "--resume",
        str(path),
        "--executor",
        "dask",
        "--scheduler",
        "tcp://127.0.0.1:1",
    )
    assert "no Dask scheduler answers at 'tcp://127.0.0.1:1'" in line and f"--resume {path}" in line
    assert count_finished(path) == 0
