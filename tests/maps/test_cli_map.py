"""``navbench map`` as a user meets it."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from harness.storage.shipped import shipped
from harness.task.mission import MissionSampler
from harness.world.map.scene_io import load_scene
from navstack.costmap.map_io import save_map
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.errors import MapError
from navstack.types import Pose2D
from tests import command

MAPS = shipped("maps")


def status(*arguments: str) -> int:
    return command.status("map", *arguments)


@pytest.fixture
def hall(tmp_path: Path) -> Path:
    """A hall of 20 m x 12 m with a pillar, as a user's map."""
    cells = np.zeros((120, 200), dtype=np.int8)
    cells[[0, -1]], cells[:, [0, -1]] = 100, 100
    cells[50:60, 90:100] = 100
    save_map(OccupancyGrid(cells, 0.1, Pose2D(-3.0, 1.0)), tmp_path / "hall.yaml")
    return tmp_path / "hall.yaml"


def show(capsys: pytest.CaptureFixture[str], *arguments: str) -> Any:
    assert status("show", *arguments, "--json") == 0
    return json.loads(capsys.readouterr().out)


def test_a_users_map_is_measured_and_drawn(
    hall: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    picture = tmp_path / "picture.png"
    document = show(
        capsys,
        str(hall),
        "--samples",
        "20",
        "--out",
        str(picture),
        "--view",
        "navmesh",
    )
    assert (document["schema"], document["map"], document["size_m"]) == (1, "hall", [20.0, 12.0])
    measured = document["measured"]
    assert measured["walkable_area_m2"] == pytest.approx(19.8 * 11.8 - 1.0)
    assert measured["connected_parts"] == 1
    assert measured["furniture_medium_share"] is None
    assert measured["furniture_spacings_m"] == {"10": None, "50": None, "90": None}
    assert measured["edges_open_half_metre_share"] == 0.0
    assert measured["edge_gaps_m"] == {"50": 0.0, "95": 0.0}
    assert measured.keys() < document["published"].keys()
    assert document["published"]["mean_shortest_path_m"] == {"published": 102.0, "uniform": 129.0}
    assert Image.open(picture).size[0] == 1600


def test_missions_of_both_samplings_are_those_of_the_seed(
    hall: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    document = show(capsys, str(hall), "--samples", "15", "--seed", "4")
    for sampling, drawn in document["missions"].items():
        sampler, rng = MissionSampler(load_scene(hall).walkable, sampling), np.random.default_rng(4)
        lengths = [sampler.sample(rng).shortest_path for _ in range(15)]
        assert drawn["mean_shortest_path_m"]["value"] == pytest.approx(np.mean(lengths))
        assert drawn["mean_shortest_path_m"]["n"] == 15
        assert drawn["shortest_paths_m"]["50"] == pytest.approx(np.median(lengths))
    assert document["missions"]["published"] != document["missions"]["uniform"]


def test_a_map_without_room_has_no_missions(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    save_map(OccupancyGrid(np.zeros((12, 12), dtype=np.int8), 0.1, Pose2D()), tmp_path / "box.yaml")
    assert show(capsys, str(tmp_path / "box.yaml"))["missions"] == {
        "published": None,
        "uniform": None,
    }
    assert status("show", str(tmp_path / "box.yaml")) == 0
    assert "No room for missions" in capsys.readouterr().out


def test_the_tables_show_the_papers_values_beside(
    hall: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert status("show", str(hall), "--samples", "5") == 0
    assert "12,620" not in capsys.readouterr().out
    assert status("show", str(hall), "--samples", "5", "--paper") == 0
    text = capsys.readouterr().out
    for words in (
        "Map hall, 20 x 12 m",
        "12,620",
        "Shortest path of 5 missions",
        "published",
        "uniform",
    ):
        assert words in text


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("new", "--name", "a/b"), "plain file name"),
        (("new", "--name", "town_navmesh"), "does not end with _walkable, _navmesh"),
        (("new", "--name", "town", "--seed", "-1"), "--seed -1"),
        (("new", "--name", "sidewalk", "--out", "{maps}"), "exists already"),
        (
            ("new", "--name", "town", "--out", "{maps}/sidewalk.yaml"),
            "sidewalk.yaml' cannot be written",
        ),
        (("show", "sidewolk"), "did you mean 'sidewalk'"),
        (("show", "sidewalk", "--samples", "1"), "at least 2 samples"),
        (("show", "sidewalk", "--view", "navmash"), "did you mean 'navmesh'"),
        (("show", "absent.yaml"), "cannot be read"),
    ],
)
def test_bad_input_is_one_clear_line(
    arguments: tuple[str, ...],
    words: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert status(*(argument.replace("{maps}", str(MAPS)) for argument in arguments)) == 1
    captured = capsys.readouterr()
    assert words in captured.err
    assert captured.err.count("\n") == 1
    assert captured.out == ""


@pytest.mark.slow
def test_the_shipped_world_is_the_one_that_the_command_makes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert status("new", "--seed", "0", "--name", "town", "--out", str(tmp_path / "maps")) == 0
    path = Path(capsys.readouterr().out.strip())
    assert path == tmp_path / "maps" / "town.yaml"
    assert path.with_name("town.geojson").read_bytes() == (MAPS / "sidewalk.geojson").read_bytes()
    for part in (".png", "_walkable.png", "_navmesh.png"):
        made, kept = (
            Image.open(each) for each in (path.with_name(f"town{part}"), MAPS / f"sidewalk{part}")
        )
        assert made.mode == kept.mode and np.array_equal(np.asarray(made), np.asarray(kept))
    assert load_scene(path).name == "town"


def test_half_a_map_is_none(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def fill(seed: int, folder: Path, name: str) -> None:
        (folder / f"{name}.geojson").write_text("half")
        raise MapError("no space left on device")

    monkeypatch.setattr("navbench.api.maps.write", fill)
    out = tmp_path / "out"
    assert status("new", "--name", "town", "--out", str(out)) == 1
    assert "no space left" in capsys.readouterr().err
    assert list(out.iterdir()) == []


def test_nothing_of_a_map_is_written_over(hall: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (image,) = (file for file in hall.parent.glob("hall.*") if file != hall)
    before = image.read_bytes()
    assert status("show", str(hall), "--out", str(image)) == 1
    assert "is a file that is read" in capsys.readouterr().err and image.read_bytes() == before
    alone = hall.parent / "new"
    alone.mkdir()
    (alone / "mine_walkable.png").write_bytes(b"somebody's")
    assert status("new", "--seed", "0", "--name", "mine", "--out", str(alone)) == 1
    assert "mine_walkable.png exists already" in capsys.readouterr().err
    assert [file.name for file in alone.iterdir()] == ["mine_walkable.png"]
