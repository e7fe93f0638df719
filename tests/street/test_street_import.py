"""Streets of OpenStreetMap become ground, furniture and maps."""

import errno
import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely

from harness.street.district import District, build_district, clipped, scene_of, windows_of
from harness.street.ground import lay_ground
from harness.street.links import links_between
from harness.street.osm_file import CREDIT, GeoBox, read_extract
from harness.street.raster import cells_of
from harness.street.rules import tagged_length
from harness.world.map.scene_io import load_scene
from harness.world.map.shapes import Rect
from navstack.costmap.occupancy_grid import FREE
from navstack.errors import InputError, MapError
from tests import command
from tests.street.town import BOX, Town, small_town

pytest.importorskip("osmium", reason="needs osmium (pip install 'navbench[street]')")
GEO = GeoBox(*map(float, BOX.split(",")))


def district_of(town: Town, folder: Path, seed: int = 0) -> District:
    return build_district(read_extract(town.write(folder / "town.osm"), GEO), seed)


def status(*arguments: str) -> int:
    return command.status("map", *arguments)


@pytest.fixture
def district(tmp_path: Path) -> District:
    return district_of(small_town(), tmp_path)


def test_a_tagged_street_has_a_sidewalk_on_both_sides(district: District) -> None:
    tagged = [walk for walk in district.ground.walks if walk.source == "tag"]
    sides = {round(float(walk.line.centroid.y)) for walk in tagged}
    assert {side < 100 for side in sides} == {True, False}
    # half a carriageway of 5.5 m and half a sidewalk of 2.1 to 2.9 m
    assert all(3.8 <= abs(walk.line.centroid.y - 100.0) <= 4.3 for walk in tagged)


@pytest.mark.parametrize(("value", "is_north"), [("left", True), ("right", False)])
def test_a_sidewalk_on_one_side_lies_on_that_side(
    tmp_path: Path, value: str, is_north: bool
) -> None:
    town = Town()
    town.way((0, 100), (200, 100), highway="residential", sidewalk=value)
    ground = district_of(town, tmp_path).ground
    assert all((walk.line.centroid.y > 100.0) is is_north for walk in ground.walks)
    assert ground.walks


def test_a_width_that_is_tagged_counts(tmp_path: Path) -> None:
    town = Town()
    town.way((0, 50), (200, 50), highway="footway", width="3.2 m")
    ground = district_of(town, tmp_path).ground
    assert shapely.clip_by_rect(ground.walkable, 99, 0, 101, 200).area == pytest.approx(6.4, 0.02)


@pytest.mark.parametrize(
    ("text", "metres"),
    [
        ("3", 3.0),
        ("3.5 m", 3.5),
        ("2,5", 2.5),
        ("250 cm", 2.5),
        ("2 metres", 2.0),
        ("8'", 2.4384),
        ("7'6\"", 2.286),
        ("10 ft", 3.048),
        ("8 feet", 2.4384),
    ],
)
def test_a_length_may_be_in_metres_or_feet(text: str, metres: float) -> None:
    assert tagged_length({"width": text}, "width") == pytest.approx(metres)


@pytest.mark.parametrize("text", ["", "wide", "7'6", "2;3", "-2", "0.1", "1e3"])
def test_a_length_that_is_none_is_not_believed(text: str) -> None:
    assert tagged_length({"width": text}, "width") is None


@pytest.mark.parametrize("has_signals", [False, True])
def test_sidewalks_drawn_beside_streets_are_joined_at_junctions(
    tmp_path: Path, has_signals: bool
) -> None:
    town = Town()
    town.way((0, 100), (100, 100), (200, 100), highway="residential", sidewalk="separate")
    town.way((100, 0), (100, 100), (100, 200), highway="residential", sidewalk="separate")
    if has_signals:
        town.node((100, 100), highway="traffic_signals")
    for x in (-1, 1):
        for y in (-1, 1):
            corner = (100 + 7 * x, 100 + 7 * y)
            ends = (100 + 95 * x, corner[1]), corner, (corner[0], 100 + 95 * y)
            town.way(*ends, highway="footway", footway="sidewalk")
    ground = district_of(town, tmp_path).ground
    crossings = [walk for walk in ground.walks if walk.kind == "crossing"]
    assert len(crossings) == 4  # one for each arm
    assert all(walk.has_signals is has_signals for walk in crossings)
    assert shapely.get_num_geometries(ground.walkable) == 1


def test_a_crossing_mapped_in_the_middle_of_a_junction_is_one_for_each_arm(tmp_path: Path) -> None:
    town = Town()
    town.way((0, 100), (100, 100), (200, 100), highway="residential", sidewalk="both")
    town.way((100, 0), (100, 100), (100, 200), highway="residential", sidewalk="both")
    town.node((100, 100), highway="crossing", crossing="traffic_signals")
    walks = district_of(town, tmp_path).ground.walks
    crossings = [walk for walk in walks if walk.kind == "crossing"]
    assert len(crossings) == 4
    assert all(walk.has_signals for walk in crossings)
    assert all(shapely.distance(walk.line, shapely.Point(100.0, 100.0)) > 4.0 for walk in crossings)


def test_a_window_that_cuts_off_the_tip_of_a_spike_has_its_part() -> None:
    window = Rect(200.0, 200.0, 400.0, 360.0)
    spike = (
        (402.9406306506378, 308.6216015314235),
        (399.42240952796857, 308.62121621825787),
        (402.94065968548745, 308.62160153460337),
    )
    outline = ((402.935, 360.013), (405.745, 360.013), (405.766, 168.287), (402.956, 168.287))
    road = shapely.Polygon((*outline, *spike))
    with pytest.raises(shapely.GEOSException):  # or the case is no longer worth a test
        shapely.clip_by_rect(road, 200.0, 200.0, 400.0, 360.0)
    assert clipped(road, window).area < 1e-3


def test_what_a_street_does_not_say_is_filled_in_from_the_seed(tmp_path: Path) -> None:
    town = small_town()
    first, again, other = (district_of(town, tmp_path, seed) for seed in (0, 0, 1))
    filled = [walk for walk in first.ground.walks if walk.source == "rule"]
    assert any(walk.kind == "sidewalk" for walk in filled)
    assert any(walk.kind == "crossing" for walk in filled)
    assert first.ground.walkable.equals(again.ground.walkable)
    assert not first.ground.walkable.equals(other.ground.walkable)


def test_each_arm_of_a_junction_within_a_way_has_a_crossing(district: District) -> None:
    filled = [walk for walk in district.ground.walks if walk.kind == "crossing"]
    places = {tuple(np.round(walk.line.centroid.coords[0])) for walk in filled}
    assert {(95, 100), (105, 100), (100, 95), (100, 105)} < places


def test_a_side_with_a_drawn_sidewalk_gets_no_second_one(tmp_path: Path) -> None:
    town = Town()
    town.way((0, 100), (200, 100), highway="residential")
    town.way((0, 105), (200, 105), highway="footway", footway="sidewalk")
    walks = district_of(town, tmp_path).ground.walks
    filled = [walk for walk in walks if walk.source == "rule" and walk.kind == "sidewalk"]
    assert filled
    assert all(walk.line.centroid.y < 100.0 for walk in filled)


def test_nobody_drives_over_a_raised_kerb_and_signals_stand_beside_it(district: District) -> None:
    crossing = next(walk for walk in district.ground.walks if walk.has_signals)
    assert crossing.has_step
    assert not shapely.intersects_xy(district.ground.walkable, 60.0, 100.0)
    scene = scene_of(district, district.ground.box, "town")
    low = [zone for zone in scene.zones if zone.kind == "crosswalk" and zone.elevation < 0.0]
    assert len(low) == 1
    assert shapely.Polygon(low[0].polygon).centroid.x == pytest.approx(60.0, abs=0.5)
    assert district.furniture.mapped["traffic_light"] == 2


def test_nothing_stands_in_the_middle_of_a_way(district: District) -> None:
    for piece in district.furniture.pieces:
        shape = shapely.Polygon(piece.polygon)
        nearest = min(shapely.distance(walk.line, shape) for walk in district.ground.walks)
        assert nearest > 0.6
    assert district.furniture.mapped["trash_bin"] == 1


def test_buildings_are_convex_pieces_of_the_tagged_height(district: District) -> None:
    walls = [each for each in district.ground.solid if each.kind == "building_glass"]
    assert {each.height for each in walls} == {15.0}
    area = sum(shapely.Polygon(each.polygon).area for each in walls)
    assert area == pytest.approx(1600.0, rel=0.01)


@pytest.mark.parametrize("tags", [{"tunnel": "building_passage"}, {"covered": "arcade"}])
def test_a_passage_leads_through_a_building(tmp_path: Path, tags: dict[str, str]) -> None:
    town = small_town()
    town.way((140, 100), (140, 200), highway="footway", **tags)
    walkable = district_of(town, tmp_path).ground.walkable
    assert walkable.contains(shapely.LineString(((140, 115), (140, 165))))


def test_stairs_that_begin_in_the_middle_of_a_street_leave_its_sidewalk(tmp_path: Path) -> None:
    town = small_town()
    town.way((160, 100), (160, 120), highway="steps")
    walkable = district_of(town, tmp_path).ground.walkable
    along = shapely.LineString(((150, 104), (170, 104)))
    assert walkable.contains(along)
    assert not walkable.intersects(shapely.Point(160, 115))


def test_a_way_that_meets_a_street_is_no_sidewalk_of_it(tmp_path: Path) -> None:
    town = small_town()
    town.way((180, 100), (180, 180), highway="footway")
    walkable = district_of(town, tmp_path).ground.walkable
    assert walkable.contains(shapely.LineString(((130, 104), (190, 104))))
    assert walkable.contains(shapely.LineString(((180, 105), (180, 175))))


@pytest.mark.parametrize("is_shut", [True, False])
def test_people_share_an_alley_where_houses_leave_no_sidewalk(
    tmp_path: Path, is_shut: bool
) -> None:
    town = Town()
    town.way((0, 100), (200, 100), highway="residential")
    town.way((0, 20), (200, 20), highway="footway")
    for low, high in ((102, 120), (80, 98 if is_shut else 94)):
        corners = ((60, low), (90, low), (90, high), (60, high), (60, low))
        town.way(*corners, building="yes")
    ground = district_of(town, tmp_path).ground
    carriageway = shapely.Point(75, 100)
    assert ground.walkable.intersects(carriageway) is is_shut
    parts = [part for part in shapely.get_parts(ground.walkable) if part.bounds[3] > 50.0]
    assert len(parts) == 1, "the alley joins both ends, or the southern side does"
    assert not ground.walkable.intersects(shapely.Point(30, 100))
    assert not ground.roads.intersects(carriageway) or not is_shut


def test_parts_near_by_are_joined_however_many_there_are() -> None:
    large, second = shapely.box(0, 0, 100, 10), shapely.box(0, 18, 60, 28)
    islands = [shapely.box(x, 29.5, x + 3, 33) for x in range(0, 60, 5)]
    apart = shapely.MultiPolygon([large, second, *islands, shapely.box(0, 60, 20, 70)])
    wall = shapely.box(-20, 12, 45, 15)
    links = links_between(apart, wall, shapely.box(-20, 10, 120, 18))
    assert len(links) == len(islands) + 1
    joined = shapely.union_all([apart, *(link.polygon for link in links)])
    assert len(shapely.get_parts(joined)) == 2, "what is farther away stays apart"
    crossing = [link for link in links if link.kind == "crossing"]
    assert len(crossing) == 1 and not crossing[0].line.intersects(wall)


@pytest.mark.parametrize(
    ("tags", "is_joined"),
    [
        ({}, True),
        ({"waterway": "stream"}, False),
        ({"waterway": "canal", "layer": "-1"}, False),
        ({"waterway": "stream", "tunnel": "culvert"}, True),
        ({"railway": "rail"}, False),
        ({"railway": "tram"}, True),
    ],
)
def test_nothing_joins_ways_over_water_or_rails(
    tmp_path: Path, tags: dict[str, str], is_joined: bool
) -> None:
    town = Town()
    town.way((0, 20), (200, 20), highway="footway")
    town.way((0, 28), (200, 28), highway="footway")
    town.way((-40, 24), (240, 24), **tags)
    parts = shapely.get_parts(district_of(town, tmp_path).ground.walkable)
    assert len(parts) == (1 if is_joined else 2)


@pytest.mark.parametrize("tags", [{"min_height": "4"}, {"building__min_level": "1"}])
def test_a_building_above_a_way_leaves_it_free(tmp_path: Path, tags: dict[str, str]) -> None:
    town = small_town()
    town.way((20, 20), (40, 20), (40, 40), (20, 40), (20, 20), building="yes", **tags)
    town.way((30, 0), (30, 90), highway="footway")
    ground = district_of(town, tmp_path).ground
    assert ground.walkable.contains(shapely.LineString(((30, 5), (30, 85))))
    assert sum(kind == "building_glass" for kind, _, _ in ground.built) == 1


def test_cells_have_their_centre_in_the_polygon() -> None:
    ring = shapely.Polygon(
        ((1.01, 1.02), (9, 2.03), (8.1, 9.07), (2, 7)), [((4, 4), (6, 4), (5, 6))]
    )
    cells = cells_of(ring, Rect(0.0, 0.0, 10.0, 10.0), 0.25)
    y, x = (np.indices(cells.shape) + 0.5) * 0.25
    assert np.array_equal(cells, shapely.contains_xy(ring, x, y))


def test_a_large_box_becomes_tiles() -> None:
    windows = windows_of(Rect(0.0, 0.0, 450.03, 300.0))
    assert [suffix for suffix, _ in windows] == ["_0_0", "_1_0", "_2_0", "_0_1", "_1_1", "_2_1"]
    assert sum(window.width * window.depth for _, window in windows) == pytest.approx(135_000.0)


def test_the_command_writes_maps_that_load_with_credit_everywhere(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = small_town().write(tmp_path / "town.osm")
    out = tmp_path / "maps"
    assert status("osm", str(file), "--bbox", BOX, "--out", str(out), "--json") == 0
    document: Any = json.loads(capsys.readouterr().out)
    assert document["walks"]["sidewalk"]["filled_share"] == pytest.approx(0.5, abs=0.15)
    assert document["crossings"]["signals"] == 1
    scene = load_scene(out / "town.yaml")
    assert (scene.navigation_mesh.data == FREE).sum() * 0.05**2 > 1000.0
    assert scene.credit == CREDIT
    written = {file.suffix: file for file in out.iterdir() if file.suffix != ".png"}
    assert written.keys() == {".yaml", ".geojson", ".md"}
    credited = [file for file in out.iterdir() if file.suffix != ".png"]
    texts = [file.read_text(encoding="utf-8").replace("\n", " ") for file in credited]
    assert all(CREDIT in text for text in texts)
    assert status("osm", str(file), "--bbox", BOX, "--out", str(out)) == 1
    assert "exists already" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("content", "box", "says"),
    [
        ("<osm>", BOX, "broken or cut off"),
        ("<osm version='0.6'></osm>", BOX, "has no node"),
        ("<osm version='0.6'><node id='1' lon='24.9' lat='60.1'/></osm>", BOX, "no way in the box"),
        ("<osm version='0.6'></osm>", "1,2,3", "not W,S,E,N"),
        ("<osm version='0.6'></osm>", "3,2,1,4", "west < east"),
        ("<osm version='0.6'></osm>", "24,60,25,61", "at most 5000 m a side"),
        (
            "<osm version='0.6'><bounds minlat='1' minlon='1' maxlat='2' maxlon='2'/></osm>",
            BOX,
            "lies outside of town.osm",
        ),
    ],
)
def test_what_cannot_be_used_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], content: str, box: str, says: str
) -> None:
    file = tmp_path / "town.osm"
    file.write_text(content, encoding="utf-8")
    assert status("osm", str(file), "--bbox", box, "--out", str(tmp_path)) == 1
    error = capsys.readouterr().err
    assert says in error
    assert error.count("\n") == 1


@pytest.mark.parametrize(
    ("width", "told"), [(200.0, ""), (100.0, "note: 50 % of the box lie beyond")]
)
def test_a_box_over_the_edge_of_a_file_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], width: float, told: str
) -> None:
    """The file says to have the west of the town, or all of it."""
    file = small_town().write(tmp_path / "town.osm")
    west, south, east, north = map(float, BOX.split(","))
    east = west + width / 200.0 * (east - west)
    bounds = f'<bounds minlon="{west}" minlat="{south}" maxlon="{east}" maxlat="{north}"/>'
    file.write_text(file.read_text().replace('"0.6">', f'"0.6">{bounds}'), encoding="utf-8")
    assert status("osm", str(file), "--bbox", BOX, "--out", str(tmp_path / "out")) == 0
    said = capsys.readouterr().err
    assert told in said
    assert ("note:" in said) == bool(told)


def test_a_box_without_sidewalks_is_refused(tmp_path: Path) -> None:
    town = Town()
    town.way((0, 100), (200, 100), highway="residential")
    extract = read_extract(town.write(tmp_path / "town.osm"), GEO)
    with pytest.raises(InputError, match="no sidewalk, footway or area for people"):
        lay_ground(extract, np.random.default_rng(0))


def test_other_and_huge_files_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(MapError, match=r"is no OpenStreetMap file; give one of \.pbf"):
        read_extract(tmp_path / "town.txt", GEO)
    file = small_town().write(tmp_path / "town.osm")
    monkeypatch.setattr("harness.street.osm_file.MOST_BYTES", 100)
    with pytest.raises(MapError, match="osmium extract --bbox"):
        read_extract(file, GEO)


def test_half_a_district_is_none(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def fill(district: None, out: Path, name: str) -> list[Path]:
        (out / f"{name}.yaml").write_text("half")
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(out / f"{name}.png"))

    for name in ("build_district", "build_graph", "with_places"):
        monkeypatch.setattr(f"navbench.api.street.{name}", lambda *_: None)
    monkeypatch.setattr("navbench.api.street.save_maps", fill)
    file, out = small_town().write(tmp_path / "town.osm"), tmp_path / "out"
    left = out / ".town.x1.partial"  # by a program that was killed
    left.mkdir(parents=True)
    (left / "town.yaml").write_text("half")
    assert status("osm", str(file), "--bbox", BOX, "--out", str(out)) == 1
    assert "town.png" in (said := capsys.readouterr().err) and said.count("\n") == 1
    assert list(out.iterdir()) == []
