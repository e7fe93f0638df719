"""The examples of docs/scaling.md, executed as far as this machine can."""

import dataclasses
import importlib.util
import multiprocessing
import os
import shutil
import signal
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from types import ModuleType

import pytest

from harness.execution.executors import InProcess
from harness.execution.workers import Workers
from harness.storage.new_run import create_run
from harness.storage.run_folder import RunFolder
from harness.study.drive import TABLES, drive_missing
from harness.study.manifest import about, load_study, parameters
from harness.task.study import Study, make_study
from navstack.errors import InputError
from tests.rules import short_rules

pytestmark = pytest.mark.slow

EXAMPLES = Path(__file__).parents[2] / "docs" / "examples"
RULES = short_rules(2.0)
SAME = ("episodes.parquet", "events.parquet")
EPISODES = 3
MPIEXEC = shutil.which("mpiexec", path=str(Path(sys.executable).parent)) or shutil.which("mpiexec")


def load(name: str) -> ModuleType:
    """An example as a module."""
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def rules(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("files") / "short.yaml"
    path.write_text(RULES)
    return path


@pytest.fixture(scope="module")
def study(rules: Path) -> Study:
    return make_study(stacks=["parked"], episodes=EPISODES, rules=str(rules))


def same(path: Path) -> dict[str, bytes]:
    return {name: (path / name).read_bytes() for name in SAME}


@pytest.fixture(scope="module")
def expected(study: Study, tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """The tables of a run in this process."""
    path = tmp_path_factory.mktemp("local") / "run"
    create_run(path, about(study, ["navbench"]), parameters(study))
    with RunFolder(path, TABLES, study.total) as folder:
        drive_missing(
            load_study(path), folder, Workers(1, InProcess), lambda finished, record: None
        )
    return same(path)


def test_any_executor_drives_a_study(
    study: Study,
    expected: dict[str, bytes],
    tmp_path: Path,
) -> None:
    """The MPI example's own function, on an executor that is here everywhere.

    The second time all is done.
    """
    drive = load("mpi_study").drive
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as executor:
        drive(executor, 1, study, tmp_path / "run")
        assert same(tmp_path / "run") == expected
        drive(executor, 1, study, tmp_path / "run")
        other = dataclasses.replace(study, episodes=EPISODES + 1)
        with pytest.raises(InputError, match="has another study; give what it began with"):
            drive(executor, 1, other, tmp_path / "run")
    assert same(tmp_path / "run") == expected


def test_mpi_drives_a_study(rules: Path, expected: dict[str, bytes], tmp_path: Path) -> None:
    try:
        from mpi4py import MPI  # noqa: F401 - whether it and its library are there
    except (ImportError, RuntimeError) as error:
        pytest.skip(f"mpi4py or an MPI library is not installed ({str(error).splitlines()[0]})")
    if MPIEXEC is None:
        pytest.skip("no mpiexec is installed")
    command = [
        MPIEXEC,
        "-n",
        "2",
        sys.executable,
        "-m",
        "mpi4py.futures",
        str(EXAMPLES / "mpi_study.py"),
    ]
    study = [
        "--stack",
        "parked",
        "--episodes",
        str(EPISODES),
        "--rules",
        str(rules),
        "--out",
        str(tmp_path / "run"),
    ]
    done = subprocess.run(
        [*command, *study],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert f"{EPISODES} of {EPISODES} deliveries" in done.stderr
    assert same(tmp_path / "run") == expected


def test_slurm_jobs_have_workers_of_one_thread() -> None:
    on_interrupt = signal.getsignal(signal.SIGINT)
    jobqueue = pytest.importorskip("dask_jobqueue", reason="dask-jobqueue is not installed")
    signal.signal(signal.SIGINT, on_interrupt)  # the import has replaced it
    example = load("slurm_study")
    options = {"queue": "long", "account": "robots", "walltime": "4:00:00"}
    scheduler = {"dashboard_address": None, "host": "127.0.0.1"}
    with example.make_cluster(
        jobqueue.SLURMCluster, 16, scheduler_options=scheduler, **options
    ) as cluster:
        script = cluster.job_script()
    for line in ("-p long", "-A robots", "-n 1", "--cpus-per-task=16", "--mem=45G", "-t 4:00:00"):
        assert f"#SBATCH {line}\n" in script
    assert "--nthreads 1" in script and "--nworkers 16" in script and "--nanny" in script
    assert "--preload-nanny navbench" in script
    assert f"{sys.executable} -m distributed.cli.dask_worker" in script


INTERRUPTED = """
import signal, sys
from types import SimpleNamespace
sys.path.insert(0, {examples!r})
import dask_jobqueue, slurm_study
slurm_study.NAVBENCH = [sys.executable, "-c", {navbench!r}]
cluster = SimpleNamespace(
    scale=lambda jobs: None, wait_for_workers=lambda n: None, scheduler_address="tcp://here:1"
)
sys.exit(slurm_study.run(cluster, 1, ["run"]))
"""
KEEPS_WHAT_IS_FINISHED = """
import signal, sys, time
try:
    print("driving", flush=True)
    time.sleep(60)
except KeyboardInterrupt:
    time.sleep(1)
    print("kept", flush=True)
    sys.exit(130)
"""


def test_an_interrupted_slurm_study_waits_for_what_navbench_keeps() -> None:
    pytest.importorskip("dask_jobqueue", reason="dask-jobqueue is not installed")
    program = INTERRUPTED.format(examples=str(EXAMPLES), navbench=KEEPS_WHAT_IS_FINISHED)
    command = [sys.executable, "-c", program]
    with subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as study:
        assert study.stdout is not None and study.stdout.readline() == "driving\n"
        os.killpg(study.pid, signal.SIGINT)  # as Ctrl-C in a terminal
        assert study.stdout.read() == "kept\n"
    assert study.returncode == 130
