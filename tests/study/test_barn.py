"""The BARN challenge's worlds as maps, its score, and a run in one of them."""

import json
import math
import os
import tarfile
from pathlib import Path

import numpy as np
import pytest

from harness.study.barn import CELL, GOAL, START, cylinders, optimal_time, scene_of, score, score_of
from navbench.cli.app import main
from navstack.costmap.occupancy_grid import OCCUPIED
from navstack.errors import InputError

DATA = os.environ.get("NAVSTACK_DATA")
MODEL = """<model name='unit_cylinder_{n}'><pose frame=''>{x} {y} 0 0 0 0</pose><link name='link'><collision name='c'>
<geometry><cylinder><radius>0.075</radius><length>1</length></cylinder></geometry></collision></link></model>"""
WORLD = (
    "<sdf version='1.6'><world name='default'><model name='ground_plane'/>{models}</world></sdf>"
)


def write_world(folder: Path, number: int, posts: list[tuple[float, float]]) -> None:
    """A world with posts, and a straight path through it."""
    models = "".join(MODEL.format(n=n, x=x, y=y) for n, (x, y) in enumerate(posts))
    (folder / f"world_{number}.world").write_text(WORLD.format(models=models))
    np.save(folder / f"path_{number}.npy", np.array([(17, row) for row in range(30)]))


def test_a_world_becomes_posts_and_a_map(tmp_path: Path) -> None:
    write_world(tmp_path, 3, [(-2.5, 6.0), (-1.0, 7.5)])
    circles = cylinders(tmp_path / "world_3.world")
    assert circles.tolist() == [[-2.5, 6.0, 0.075], [-1.0, 7.5, 0.075]]
    scene = scene_of("barn_3", circles)
    rows, columns = np.nonzero(scene.geometry.data == OCCUPIED)
    x, y = (
        scene.geometry.origin.x + (columns + 0.5) * CELL,
        scene.geometry.origin.y + (rows + 0.5) * CELL,
    )
    distance = np.hypot(x[:, None] - circles[:, 0], y[:, None] - circles[:, 1]).min(axis=1)
    assert len(rows) > 40 and distance.max() < 0.075 + 1.5 * CELL
    for obstacle, circle in zip(scene.obstacles, circles, strict=True):  # drawn around the circle
        edges = 0.5 * (obstacle.polygon + np.roll(obstacle.polygon, 1, axis=0)) - circle[:2]
        assert np.hypot(*edges.T) == pytest.approx(0.075)


def test_the_optimal_time_is_that_of_the_path_with_its_ends_at_two_metres_per_second(
    tmp_path: Path,
) -> None:
    write_world(tmp_path, 3, [])
    x, low, high = 0.15 * 17 - 4.575, 5.075, 0.15 * 29 + 5.075
    length = (
        math.hypot(x - START.x, low - START.y)
        + (high - low)
        + math.hypot(GOAL.x - x, GOAL.y - high)
    )
    assert optimal_time(tmp_path / "path_3.npy") == pytest.approx(length / 2.0)


@pytest.mark.parametrize(
    ("seconds", "old", "new"),
    [(4.0, 0.25, 0.5), (15.0, 0.25, 1 / 3), (30.0, 1 / 6, 1 / 6), (99.0, 0.125, 0.125)],
)
def test_a_run_scores_optimal_over_clipped_time(seconds: float, old: float, new: float) -> None:
    assert score(True, seconds, 5.0) == pytest.approx(old)
    assert score(True, seconds, 5.0, least=2.0) == pytest.approx(new)
    assert score(False, seconds, 5.0) == 0.0


def test_runs_are_counted_by_how_they_ended() -> None:
    ends = [
        ("arrived", "cargo not modelled", 10.0),
        ("physical_assistance", "impulse", 3.0),
        ("timeout", "timeout", 100.0),
    ]
    rows = [
        {"outcome": outcome, "reason": why, "duration_s": s, "map": "barn_0"}
        for outcome, why, s in ends
    ]
    found = score_of(rows, {"barn_0": 5.0})
    assert (found.runs, found.arrived, found.collided, found.seconds) == (3, 1, 1, 10.0)
    assert (found.score, found.newer_score) == (pytest.approx(0.25 / 3), pytest.approx(0.5 / 3))


@pytest.mark.skipif(DATA is None, reason="NAVSTACK_DATA is not set: no BARN worlds here")
def test_the_published_dwa_gets_its_published_score(tmp_path: Path) -> None:
    folder = Path(DATA or "") / "barn"
    with tarfile.open(folder / "worlds.tar.gz") as worlds:
        worlds.extractall(tmp_path, filter="data")
    # world, success, collided, timed out, time [s], time over optimal time
    runs = np.loadtxt(folder / "dwa_out.txt")
    optimal = np.array([optimal_time(tmp_path / f"path_{int(world)}.npy") for world in runs[:, 0]])
    came = runs[:, 1] == 1.0  # of the others another time is told
    assert (runs[:, 4] / optimal)[came] == pytest.approx(runs[came, 5], rel=1e-3)
    scores = [score(bool(run[1]), run[4], time) for run, time in zip(runs, optimal, strict=True)]
    assert (runs[:, 1].mean(), round(float(np.mean(scores)), 3)) == (0.85, 0.158)
    assert len(cylinders(tmp_path / "world_0.world")) == 209


@pytest.mark.parametrize(
    "text", ["", "<sdf/>", WORLD.format(models=MODEL.format(n=0, x="east", y=1)), "\0"]
)
def test_what_is_no_world_is_one_line(tmp_path: Path, text: str) -> None:
    (tmp_path / "world_1.world").write_text(text)
    with pytest.raises(InputError, match="world_1.world: "):
        cylinders(tmp_path / "world_1.world")


def navbench(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as leaving:
        main(["suite", "barn", "--workers", "1", *arguments])
    told = capsys.readouterr()
    return int(leaving.value.code or 0), told.out, told.err


def test_worlds_are_needed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert (
        navbench(capsys)[2]
        == "navbench: the suite barn needs --worlds DIR, the folder with the challenge's world_<i>.world files\n"
    )
    status, _, error = navbench(capsys, "--worlds", str(tmp_path))
    assert status == 1 and "has no world_<number>.world" in error


def test_a_stack_drives_the_worlds(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_world(tmp_path, 0, [(-3.0, 6.0), (-1.0, 7.0)])
    out = tmp_path / "out"
    status, printed, _ = navbench(
        capsys, "--worlds", str(tmp_path), "--stack", "jackal-dwb", "--json", "--out", str(out)
    )
    found = json.loads(printed)["barn"]
    assert status == 0 and list(found) == ["jackal-dwb"]
    assert (found["jackal-dwb"]["arrived"], found["jackal-dwb"]["score"]) == (1, 0.25), (
        "ten metres of open ground"
    )
