"""The BARN challenge's worlds as maps, its score, and a run in one of them."""

import io
import json
import math
import os
import pickle
import tarfile
from pathlib import Path

import numpy as np
import pytest

from harness.study.barn import (
    CELL,
    GOAL,
    START,
    cylinders,
    made_maps,
    optimal_time,
    scene_of,
    score,
    score_of,
)
from navstack.costmap.occupancy_grid import OCCUPIED
from navstack.errors import InputError
from tests import command

DATA = os.environ.get("NAVSTACK_DATA")
MODEL = """<model name='unit_cylinder_{n}'><pose frame=''>{x} {y} 0 0 0 0</pose>
<link name='link'><collision name='c'>
<geometry><cylinder><radius>0.075</radius><length>1</length></cylinder></geometry>
</collision></link></model>"""
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
    for outcome in ("sla", "spoiled"):  # where cargo is modelled
        rows[0]["outcome"] = outcome
        assert score_of(rows, {"barn_0": 5.0}) == found


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


def as_npy(header: str, content: bytes = b"") -> bytes:
    """A file of numbers whose header is written by hand."""
    text = header.ljust(117) + "\n"
    return b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text.encode() + content


def saved(values: object, **options: object) -> bytes:
    stream = io.BytesIO()
    np.save(stream, np.array(values, **options))  # type: ignore[call-overload]
    return stream.getvalue()


SHAPED = "{{'descr': '{}', 'fortran_order': False, 'shape': {}, }}"
PATHS: dict[str, bytes] = {
    "is empty": b"",
    "is a zip archive": b"PK\x03\x04" + bytes(100),
    "is a pickle": pickle.dumps([(1, 2)]),
    "claims more than there is": as_npy(SHAPED.format("<f8", "(9000000000, 2)"), bytes(32)),
    "claims a little more than there is": as_npy(SHAPED.format("<f8", "(3, 2)"), bytes(32)),
    "claims more than can be counted": as_npy(SHAPED.format("<f8", f"({2**62}, 2)"), bytes(32)),
    "has a negative shape": as_npy(SHAPED.format("<f8", "(-1, 2)"), bytes(32)),
    "has a header that is no literal": as_npy("open('x', 'w')"),
    "has a header that is cut off": as_npy("{'descr': (((("),
    "has a header that is deep": as_npy("(" * 5000),
    "has a header without a type": as_npy("{'fortran_order': False, 'shape': (1, 2)}", bytes(16)),
    "has a header of another version": b"\x93NUMPY\x09\x00" + bytes(100),
    "holds objects": saved([(None, {})], dtype=object),
    "holds a NaN": saved([(17.0, math.nan)]),
    "holds an infinity": saved([(math.inf, 3.0)]),
    "holds a number beyond all measure": saved([(1e300, 3.0)]),
    "is complex": saved([(17.0 + 1j, 3.0)]),
    "holds truths": saved([(True, False)]),
    "holds texts": saved([("17", "3")]),
    "holds times": saved([(17, 3)], dtype="M8[s]"),
    "has no dimension": saved(17.0),
    "has one dimension": saved([17.0, 3.0]),
    "has three columns": saved([(17.0, 3.0, 1.0)]),
    "has three dimensions": saved([[(17.0, 3.0)]]),
    "has no cells": saved(np.zeros((0, 2))),
}


@pytest.mark.parametrize("content", PATHS.values(), ids=PATHS)
def test_what_is_no_path_is_one_line(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "path_1.npy").write_bytes(content)
    with pytest.raises(InputError, match=r"path_1\.npy: is no path of a world") as told:
        optimal_time(tmp_path / "path_1.npy")
    assert "\n" not in str(told.value) and len(str(told.value)) < 500


@pytest.mark.parametrize("kind", ["<f8", ">f4", "<f2", "<i4", "u1", "<i8"])
@pytest.mark.parametrize("order", ["C", "F"])
def test_a_path_may_have_any_real_type(tmp_path: Path, kind: str, order: str) -> None:
    cells = [(17, row) for row in range(30)]
    (tmp_path / "path_1.npy").write_bytes(saved(cells, dtype=kind, order=order))
    write_world(tmp_path, 3, [])
    assert optimal_time(tmp_path / "path_1.npy") == optimal_time(tmp_path / "path_3.npy")


@pytest.mark.parametrize("post", [("nan", "6"), ("inf", "6"), ("1e300", "6"), ("1", "-1e7")])
def test_a_post_off_this_world_is_one_line(tmp_path: Path, post: tuple[str, str]) -> None:
    model = MODEL.format(n=0, x=post[0], y=post[1])
    (tmp_path / "world_1.world").write_text(WORLD.format(models=model))
    with pytest.raises(InputError, match=r"world_1\.world: has 1 cylinders; .* up to 1e\+06 m"):
        cylinders(tmp_path / "world_1.world")


def snapshot(folder: Path) -> set[Path]:
    return set(folder.rglob("*"))


@pytest.mark.parametrize(
    ("file", "content"),
    [
        ("world_2.world", b"<sdf/>"),
        ("path_2.npy", saved([(17.0, math.nan)])),
        ("path_2.npy", b"PK\x03\x04"),
    ],
)
@pytest.mark.parametrize("out", ["new", "made"])
def test_a_refused_world_leaves_no_maps_behind(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    file: str,
    content: bytes,
    out: str,
) -> None:
    worlds = tmp_path / "worlds"
    worlds.mkdir()
    (tmp_path / "made").mkdir()
    for number in (1, 2, 3):
        write_world(worlds, number, [(-3.0, 6.0)])
    (worlds / file).write_bytes(content)
    before = snapshot(tmp_path)
    status, _, error = navbench(
        capsys,
        "--worlds",
        str(worlds),
        "--stack",
        "jackal-dwb",
        "--out",
        str(tmp_path / out),
    )
    assert status == 1 and file in error and error.count("\n") == 1
    assert snapshot(tmp_path) - before == set()


def test_a_study_that_is_refused_takes_its_maps_away_and_keeps_those_of_others(
    tmp_path: Path,
) -> None:
    write_world(tmp_path, 1, [(-3.0, 6.0)])
    out = tmp_path / "out"
    with made_maps(tmp_path, out):
        pass
    known = snapshot(out)
    assert {path.name for path in known} >= {"maps", "barn_1.yaml", "optimal_times.json"}
    write_world(tmp_path, 2, [(-3.0, 6.0)])
    with pytest.raises(InputError, match="start"), made_maps(tmp_path, out):
        assert snapshot(out) > known
        raise InputError("no start")
    assert snapshot(out) == known


def navbench(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    return command.navbench(capsys, "suite", "barn", "--workers", "1", *arguments)


def test_worlds_are_needed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert (
        navbench(capsys)[2]
        == "navbench: the suite barn needs --worlds DIR, the folder with the challenge's "
        "world_<i>.world files\n"
    )
    status, _, error = navbench(capsys, "--worlds", str(tmp_path))
    assert status == 1 and "has no world_<number>.world" in error


@pytest.mark.slow
def test_a_stack_drives_the_worlds(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_world(tmp_path, 0, [(-3.0, 6.0), (-1.0, 7.0)])
    out = tmp_path / "out"
    status, printed, _ = navbench(
        capsys,
        "--worlds",
        str(tmp_path),
        "--stack",
        "jackal-dwb",
        "--json",
        "--out",
        str(out),
    )
    found = json.loads(printed)["barn"]
    assert status == 0 and list(found) == ["jackal-dwb"]
    assert (found["jackal-dwb"]["arrived"], found["jackal-dwb"]["score"]) == (1, 0.25), (
        "ten metres of open ground"
    )
