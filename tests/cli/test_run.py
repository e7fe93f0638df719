"""A short run of the real program from end to end, in one process and in two."""

import json
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest

from harness.episode.episode import run_episode
from harness.task.study import make_study
from tests.rules import short_rules

NAVBENCH = [sys.executable, "-c", "from navbench.cli.app import main; main()"]
RULES = short_rules(5.0)
STACKS = ["--stack", "nav2-gps", "--stack", "parked"]
EIGHT = ["run", "--stack", "nav2-gps", "--episodes", "8", "--seed", "0", "--json"]
FEW = ["run", *STACKS, "--episodes", "2", "--seed", "0", "--json"]  # the first two of those


def navbench(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [*NAVBENCH, *arguments],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )


def read(run: Path, table: str = "episodes") -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = pq.read_table(run / f"{table}.parquet").to_pylist()
    return rows


def finish(folder: Path, name: str, *arguments: str) -> Path:
    """Run to the end and keep the document beside the run folder."""
    done = navbench(folder, *arguments, "--out", str(folder / name))
    assert done.returncode == 0, done.stderr
    (folder / f"{name}.json").write_text(done.stdout)
    return folder / name


@pytest.fixture(scope="module")
def eight(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return finish(tmp_path_factory.mktemp("eight"), "two", *EIGHT, "--workers", "2")


@pytest.fixture(scope="module")
def few(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return finish(tmp_path_factory.mktemp("few"), "one", *FEW, "--workers", "1")


@pytest.mark.slow
def test_at_least_half_of_eight_deliveries_arrive(eight: Path) -> None:
    rows = read(eight)
    assert [row["episode"] for row in rows] == list(range(8))
    assert all(row["error"] is None for row in rows)
    assert sum(row["outcome"] in ("sla", "spoiled") for row in rows) >= 4


@pytest.mark.parametrize("table", ["episodes", "events"])
def test_rows_do_not_depend_on_the_number_of_workers(few: Path, eight: Path, table: str) -> None:
    own = [row for row in read(few, table) if row["stack"] == "nav2-gps"]
    assert own == [row for row in read(eight, table) if row["episode"] < 2]


def test_rows_do_not_depend_on_what_the_process_did_before(few: Path) -> None:
    """Episode 1 after the one before it, and in this process, which did other things."""
    study = make_study(stacks=["nav2-gps"], episodes=2, seed=0)
    row = run_episode(list(study.tasks())[1]).row
    assert row == {key: value for key, value in read(few)[1].items() if key != "error"}


@pytest.mark.parametrize(
    ("number", "workers"), [(signal.SIGINT, 2), (signal.SIGTERM, 1), (signal.SIGHUP, 1)]
)
def test_an_interrupt_keeps_the_finished_deliveries(
    tmp_path: Path, hall: Path, number: int, workers: int
) -> None:
    out, rules = tmp_path / "run", tmp_path / "short.yaml"
    rules.write_text(RULES)
    arguments = [
        "run",
        "--stack",
        "parked",
        "--episodes",
        "5000",
        "--workers",
        str(workers),
        "--map",
        str(hall),
    ]
    arguments += ["--rules", str(rules), "--pedestrians", "4", "--out", str(out)]
    process = subprocess.Popen(
        [*NAVBENCH, *arguments],
        stderr=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        # background jobs and nohup's ignore some
        preexec_fn=lambda: signal.signal(number, signal.SIG_DFL),
    )
    journal = out / "journal.jsonl"
    deadline = time.monotonic() + 300.0  # a fresh checkout compiles first
    while time.monotonic() < deadline and not (journal.exists() and journal.stat().st_size):
        time.sleep(0.1)
    process.send_signal(number)
    try:
        shown, said = process.communicate(timeout=60)
    finally:
        process.kill()
    assert process.returncode == 130
    assert said.splitlines()[-1].endswith(f"next: navbench run --resume {out}")
    assert f"--resume {out}" in said and "Traceback" not in said
    assert 0 < len(read(out)) < 5000
    assert len(journal.read_bytes().splitlines()) == len(read(out))


def test_a_run_under_nohup_outlives_its_terminal() -> None:
    code = (
        "import signal; signal.signal(signal.SIGHUP, signal.SIG_IGN); from navbench.cli.app "
        "import main\n"
    )
    code += (
        "import os, threading; threading.Timer(0.1, os.kill, (os.getpid(), "
        "signal.SIGHUP)).start(); main(['paper'])"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == 0, done.stderr


def test_stacks_meet_the_same_missions(few: Path) -> None:
    missions: dict[int, set[tuple[float, ...]]] = {}
    for row in read(few):
        missions.setdefault(row["episode"], set()).add(
            (row["start_x_m"], row["start_y_m"], row["goal_x_m"])
        )
    assert len(read(few)) == 4
    assert all(len(different) == 1 for different in missions.values())


def test_the_document_is_complete(few: Path) -> None:
    document = json.loads((few.parent / "one.json").read_text())
    assert document["schema"] == 1
    nav2, parked = document["runs"]
    assert nav2["stack"] == "nav2-gps"
    assert nav2["episodes"] == 2 and nav2["errors"] == 0
    assert sum(nav2["outcomes"][name]["value"] for name in nav2["outcomes"]) == pytest.approx(1.0)
    assert nav2["measured"]["avg_velocity_mps"] > 0.5
    assert parked["measured"]["avg_distance_km"] < 0.005
    assert nav2["economics"]["hardware_usd"] == 13_000
    assert Path(nav2["folder"]) == few


def test_the_folder_tells_how_to_repeat_the_run(few: Path) -> None:
    about = json.loads((few / "run.json").read_text())
    assert about["seed"] == 0
    assert {"numpy", "pybullet", "navbench"} <= set(about["versions"])
    assert (few / "params" / "nav2-gps-nav2.yaml").is_file()
