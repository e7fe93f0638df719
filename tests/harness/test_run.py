"""A short run of the real program from end to end, in one process and in two."""

import json
import subprocess
import sys
from pathlib import Path

import pyarrow.parquet as pq
import pytest

NAVBENCH = [sys.executable, "-c", "from harness.cli import main; main()"]
RUN = ["run", "--stack", "nav2-gps", "--stack", "parked", "--episodes", "2", "--seed", "7", "--json"]


def navbench(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([*NAVBENCH, *arguments], cwd=folder, capture_output=True, text=True, timeout=300, check=False)


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> dict[int, Path]:
    folder = tmp_path_factory.mktemp("runs")
    done = {}
    for workers in (1, 2):
        out = folder / str(workers)
        finished = navbench(folder, *RUN, "--workers", str(workers), "--out", str(out))
        assert finished.returncode == 0, finished.stderr
        (folder / f"{workers}.json").write_text(finished.stdout)
        done[workers] = out
    return done


@pytest.mark.parametrize("name", ["episodes.parquet", "events.parquet", "summary.json"])
def test_rows_do_not_depend_on_the_number_of_workers(runs: dict[int, Path], name: str) -> None:
    assert (runs[1] / name).read_bytes() == (runs[2] / name).read_bytes()


def test_stacks_meet_the_same_missions(runs: dict[int, Path]) -> None:
    rows = pq.read_table(runs[1] / "episodes.parquet").to_pylist()
    missions = {}
    for row in rows:
        missions.setdefault(row["episode"], set()).add((row["start_x_m"], row["start_y_m"], row["goal_x_m"]))
    assert len(rows) == 4
    assert all(len(different) == 1 for different in missions.values())


def test_the_document_is_complete(runs: dict[int, Path]) -> None:
    document = json.loads((runs[1].parent / "1.json").read_text())
    assert document["schema"] == 1
    nav2, parked = document["runs"]
    assert nav2["stack"] == "nav2-gps"
    assert nav2["episodes"] == 2 and nav2["errors"] == 0
    assert sum(nav2["outcomes"][name]["value"] for name in nav2["outcomes"]) == pytest.approx(1.0)
    assert nav2["measured"]["avg_velocity_mps"] > 0.5
    assert parked["measured"]["avg_distance_km"] < 0.005
    assert nav2["economics"]["hardware_usd"] == 13_000
    assert Path(nav2["folder"]) == runs[1]


def test_the_folder_tells_how_to_repeat_the_run(runs: dict[int, Path]) -> None:
    about = json.loads((runs[1] / "run.json").read_text())
    assert about["seed"] == 7
    assert {"numpy", "pybullet", "navbench"} <= set(about["versions"])
    assert (runs[1] / "params" / "nav2-gps-nav2.yaml").is_file()
