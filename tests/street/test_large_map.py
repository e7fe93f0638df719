"""A map that is too large for one is cut into a district of tiles."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from harness.storage.shipped import is_district
from harness.street.graph_file import load_graph
from harness.street.missions import StreetMissions
from harness.world.map.shapes import Rect
from harness.world.map.tiles import load_part
from navbench.api.large_maps import drivable
from navbench.cli.app import main
from navstack.costmap.map_io import load_map
from navstack.costmap.occupancy_grid import FREE, OCCUPIED, UNKNOWN
from navstack.errors import InputError, MapError

RESOLUTION = 0.1  # [m]
ORIGIN = (-12.04, 5.0)  # [m] not on a whole cell


def town() -> np.ndarray:
    """A picture (H, W) of 62 m x 45 m: streets of 4 m around two blocks, one unknown, a yard."""
    cells = np.full((450, 620), 254, dtype=np.uint8)
    cells[40:410, 40:280] = 0
    cells[40:410, 320:580] = 205
    cells[200:230, 100:130] = 254  # nobody gets in
    return cells


@pytest.fixture
def write(tmp_path: Path) -> Callable[..., Path]:
    """Writes a map and returns its YAML file."""

    def write_map(image: str = "town.png", yaw: float = 0.0) -> Path:
        Image.fromarray(town()).save(tmp_path / image)
        origin = f"[{ORIGIN[0]}, {ORIGIN[1]}, {yaw}]"
        thresholds = "occupied_thresh: 0.65\nfree_thresh: 0.196\nnegate: 0\n"
        text = f"image: {image}\nresolution: {RESOLUTION}\norigin: {origin}\n{thresholds}"
        (tmp_path / "town.yaml").write_text(text)
        return tmp_path / "town.yaml"

    return write_map


@pytest.fixture(autouse=True)
def _small_tiles(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("harness.street.large_map.TILE", 20.0)
    monkeypatch.setattr("navstack.costmap.map_image.MAX_PIXELS", 200 * 200)


def tiles(file: Path, *more: str) -> int:
    with pytest.raises(SystemExit) as leaving:
        main(["map", "tiles", str(file), "--out", str(file.parent / "tiles"), *more])
    return int(leaving.value.code or 0)


@pytest.mark.parametrize("image", ["town.png", "town.pgm"])
def test_tiles_together_are_the_map(
    write: Callable[..., Path], image: str, capsys: pytest.CaptureFixture[str]
) -> None:
    file = write(image)
    with pytest.raises(MapError, match="navbench run drives on one of up to"):
        load_map(file)
    assert tiles(file) == 0
    told = capsys.readouterr().out
    assert "62 x 45 m; 12 maps" in told and "next: navbench run --map" in told
    window = Rect(-12.0, 5.0, 50.0, 50.0)
    part = load_part(file.parent / "tiles", "town", window, (0.0, 7.0))
    assert part.geometry.data.shape == (450, 620)
    expected = town()[::-1]
    assert ((part.geometry.data == OCCUPIED) == (expected == 0)).all()
    assert ((part.geometry.data == FREE) == (expected == 254)).all()
    assert ((part.walkable.data == FREE) == (expected == 254)).all()
    yard = part.navigation_mesh.data[225:245, 105:125]
    assert (yard == OCCUPIED).all(), "the mesh is what hangs together with the place"


def write_ground(file: Path, closed: np.ndarray) -> None:
    """Write the walkable ground beside a map: free where ``closed`` (H, W) is not set."""
    Image.fromarray(np.where(closed, 0, 254).astype(np.uint8)).save(
        file.parent / "town_walkable.png"
    )
    text = file.read_text(encoding="utf-8").replace("town.png", "town_walkable.png")
    (file.parent / "town_walkable.yaml").write_text(text, encoding="utf-8")


@pytest.mark.parametrize("has_ground", [False, True])
def test_tiles_are_walkable_where_the_map_is(
    write: Callable[..., Path], has_ground: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    file = write()
    closed = town() != 254
    closed[:, 318:322] = True  # beside the free street
    if has_ground:
        write_ground(file, closed)
    (file.parent / "town.geojson").write_text("{}", encoding="utf-8")
    assert tiles(file) == 0
    assert "town.geojson has no part in the tiles" in capsys.readouterr().err
    part = load_part(file.parent / "tiles", "town", Rect(-12.0, 5.0, 50.0, 50.0), (0.0, 7.0))
    expected = closed if has_ground else town() != 254
    assert ((part.walkable.data != FREE) == expected[::-1]).all()
    assert ((part.geometry.data == FREE) == (town()[::-1] == 254)).all()
    assert part.is_ground_given is has_ground
    unknown = part.geometry.data == UNKNOWN
    assert (unknown == (town()[::-1] == 205)).all()


@pytest.mark.parametrize("has_ground", [False, True])
def test_walls_of_a_tile_without_ground_are_there(
    tmp_path: Path, has_ground: bool, write: Callable[..., Path]
) -> None:
    """A solid tile keeps the robot out, and what no tile covers is not walkable either."""
    file = write()
    cells = np.full((200, 600), 254, dtype=np.uint8)
    cells[:, 200:400] = 0
    Image.fromarray(cells).save(tmp_path / "town.png")
    if has_ground:
        write_ground(file, cells != 254)
    assert tiles(file) == 0
    part = load_part(file.parent / "tiles", "town", Rect(-12.0, 4.0, 30.0, 20.0), (0.0, 7.0))
    assert (part.geometry.data[20:, 205:395] == OCCUPIED).all()
    assert part.obstacles
    below = part.geometry.data[:5]
    assert (below == (FREE if has_ground else OCCUPIED)).all()
    assert (part.walkable.data[:5] == OCCUPIED).all()


def test_a_map_is_cut_anew_when_its_walkable_ground_is_another(
    write: Callable[..., Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NAVSTACK_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr("navbench.api.large_maps.MAX_PIXELS", 200 * 200)
    file = write()
    without = drivable(str(file))
    write_ground(file, town() != 254)
    assert drivable(str(file)) != without


def test_a_walkable_ground_of_another_size_is_refused(
    write: Callable[..., Path], capsys: pytest.CaptureFixture[str]
) -> None:
    file = write()
    write_ground(file, town()[:-1] != 254)
    assert tiles(file) == 1
    assert "its size, resolution or origin differs from town.yaml's" in capsys.readouterr().err


def test_missions_lead_along_the_streets(write: Callable[..., Path]) -> None:
    file = write()
    assert tiles(file, "--name", "old_town") == 0
    folder = file.parent / "tiles"
    graph = load_graph(folder / "old_town_graph.geojson")
    cells = np.floor((graph.points - (-12.0, 5.0)) / RESOLUTION).astype(int)
    assert (town()[::-1][cells[:, 1], cells[:, 0]] == 254).all()
    assert len(np.unique(graph.components)) == 1, "the yard is too small for ways"
    assert {round(edge.width) for edge in graph.edges} <= {3, 4}
    legs = StreetMissions(folder, 0).legs(0)
    mesh = legs[0].scene().navigation_mesh
    for pose in (legs[0].start, legs[-1].goal):
        assert mesh.value_at(pose.x, pose.y) == FREE


@pytest.mark.parametrize(
    ("yaw", "most", "said"),
    [(0.3, 400_000_000, "is turned by 0.3 rad"), (0.0, 1000, "allowed: 1 to 1000 pixels")],
)
def test_what_cannot_be_cut_is_told_in_one_line(
    write: Callable[..., Path],
    yaw: float,
    most: int,
    said: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr("navstack.costmap.map_image.MAX_WHOLE", most)
    file = write(yaw=yaw)
    assert tiles(file) == 1
    error = capsys.readouterr().err
    assert said in error and error.count("\n") == 1
    assert not list((file.parent / "tiles").glob("*"))


def test_a_large_map_is_driven_on_in_tiles_that_the_cache_keeps(
    write: Callable[..., Path],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("NAVSTACK_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr("navbench.api.large_maps.MAX_PIXELS", 200 * 200)
    file = write()
    with pytest.raises(SystemExit) as leaving:
        main(["run", "--map", str(file), "--stack", "nobody"])
    assert leaving.value.code == 1
    note, error = capsys.readouterr().err.splitlines()[-2:]
    assert "is driven on in tiles" in note and "nobody" in error
    district = Path(drivable(str(file)))
    assert is_district(str(district)) and district.name == "town"
    graph = district / "town_graph.geojson"
    before = graph.stat().st_mtime_ns
    assert drivable(str(file)) == str(district) and graph.stat().st_mtime_ns == before
    graph.unlink()  # as a program that was killed leaves it
    assert drivable(str(file)) == str(district) and graph.is_file()
    assert drivable("sidewalk") == "sidewalk"
    whole = file.read_text(encoding="utf-8")
    for side, is_cut in ((100, False), (300, True)):
        file.write_text(f"{whole}crop: [0, 0, {side}, {side}]\n", encoding="utf-8")
        assert is_district(drivable(str(file))) is is_cut
    assert drivable(str(next(district.glob("*.yaml")))).endswith(".yaml"), "a tile is small enough"


def test_a_cache_that_cannot_be_written_is_told(
    write: Callable[..., Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("NAVSTACK_CACHE", str(tmp_path / "file"))
    monkeypatch.setattr("navbench.api.large_maps.MAX_PIXELS", 200 * 200)
    with pytest.raises(InputError, match="cannot be written"):
        drivable(str(write()))


@pytest.mark.parametrize(
    ("free", "said"),
    [(0, "has no free cell"), (1, "no way is 0.9 m wide"), (12, "is 15 m long")],
)
def test_a_map_without_ways_is_refused(
    write: Callable[..., Path], free: int, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    file = write()
    cells = np.zeros((300, 300), dtype=np.uint8)
    cells[100 : 100 + free, 100 : 100 + 4 * free] = 254
    Image.fromarray(cells).save(file.with_name("town.png"))
    assert tiles(file) == 1
    error = capsys.readouterr().err
    assert said in error and error.count("\n") == 1
    assert not list((file.parent / "tiles").glob("*"))


def test_a_district_is_not_written_over(
    write: Callable[..., Path], capsys: pytest.CaptureFixture[str]
) -> None:
    file = write()
    assert tiles(file) == 0
    assert tiles(file) == 1
    assert "exists already" in capsys.readouterr().err
