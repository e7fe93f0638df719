"""Kinds of streets and tags that other cities have."""

from pathlib import Path

import pytest
import shapely

from harness.street.district import District, build_district
from harness.street.osm_file import GeoBox, read_extract
from harness.street.places import with_places
from harness.street.route_graph import build_graph
from harness.street.rules import sidewalk_sides, walk_kind
from harness.street.walks import Street, has_signals
from harness.world.map.scene_io import load_scene
from navbench.api.street import import_osm
from tests.street.town import BOX, SOUTH, WEST, Point, Town, small_town

pytest.importorskip("osmium", reason="needs osmium (pip install 'navbench[street]')")
GEO = GeoBox(*map(float, BOX.split(",")))


def district_of(town: Town, folder: Path) -> District:
    return build_district(read_extract(town.write(folder / "town.osm"), GEO), 0)


def square(x: float, y: float, side: float) -> tuple[Point, ...]:
    """Its corners counter-clockwise, the first again at the end."""
    return (x, y), (x + side, y), (x + side, y + side), (x, y + side), (x, y)


def crossings_of(district: District) -> list[shapely.Geometry]:
    return [walk for walk in district.ground.walks if walk.kind == "crossing"]


def test_a_district_of_one_square_has_no_length_to_count_furniture_by(tmp_path: Path) -> None:
    town = Town()
    town.way(*square(50, 50, 60), highway="pedestrian", area="yes")
    town.node((60, 60), barrier="bollard")
    file = town.write(tmp_path / "town.osm")
    found = import_osm(file, bbox=(GEO.west, GEO.south, GEO.east, GEO.north), out=tmp_path)
    assert found["walks"] == {}
    assert found["furniture"]["bollard"] == {"n": 1, "filled_share": 0.0, "per_100m": None}
    assert "| bollard" in (tmp_path / "town_statistics.md").read_text(encoding="utf-8")


def test_ground_of_a_way_that_is_drawn_as_an_area_is_walked_on(tmp_path: Path) -> None:
    town = Town()
    town.way((0, 80), (200, 80), highway="footway")
    town.way(*square(50, 50, 60), area__highway="footway")
    walkable = district_of(town, tmp_path).ground.walkable
    assert shapely.intersects_xy(walkable, 100.0, 60.0)


def test_a_road_for_buses_is_crossed_as_a_street_is(tmp_path: Path) -> None:
    town = Town()
    town.way((0, 100), (200, 100), highway="busway")
    town.way((0, 80), (200, 80), highway="footway")
    ground = district_of(town, tmp_path).ground
    assert shapely.intersects_xy(ground.roads, 100.0, 102.0)
    assert not shapely.intersects_xy(ground.walkable, 100.0, 102.0)


def test_a_way_through_the_corner_of_a_tile_has_its_ground(tmp_path: Path) -> None:
    town = Town()
    town.way((10, 195), (190, 195), (206, 206), (215, 195), (300, 195), highway="path", width="1.2")
    file = town.write(tmp_path / "town.osm")
    box = WEST, SOUTH, WEST + 320 / 55_600.0, SOUTH + 280 / 111_410.0
    found = import_osm(file, bbox=box, out=tmp_path)
    assert [Path(each).stem for each in found["maps"]] == [
        f"town_{tile}" for tile in ("0_0", "1_0", "0_1", "1_1")
    ]
    corner = load_scene(tmp_path / "town_1_1.yaml").walkable
    assert 5.0 < (corner.data == 0).sum() * corner.resolution**2 < 25.0


def test_sidewalks_that_are_tagged_stay_where_nothing_joins_them(tmp_path: Path) -> None:
    town = Town()
    town.way((0, 20), (200, 20), highway="footway", width="6")
    town.way((0, 150), (200, 150), highway="residential", sidewalk="left")
    assert shapely.get_num_geometries(district_of(town, tmp_path).ground.walkable) == 2


def test_half_a_town_stays_though_nothing_joins_it_but_a_side_of_a_street_does_not(
    tmp_path: Path,
) -> None:
    town = Town()
    town.way((0, 20), (200, 20), highway="residential", sidewalk="right")
    town.way((0, 150), (200, 150), highway="residential", sidewalk__left="no")
    town.way((0, 100), (30, 100), highway="residential", sidewalk__left="no")
    walkable = district_of(town, tmp_path).ground.walkable
    assert shapely.intersects_xy(walkable, 100.0, 146.0)
    assert not shapely.intersects_xy(walkable, 15.0, 96.0)


def roundabout() -> Town:
    """One of eight sides with four arms, driven counter-clockwise."""
    town = Town()
    ring = (
        (120, 100),
        (114, 114),
        (100, 120),
        (86, 114),
        (80, 100),
        (86, 86),
        (100, 80),
        (114, 86),
    )
    town.way(*ring, ring[0], highway="residential", junction="roundabout")
    for corner, end in zip(ring[::2], ((200, 100), (100, 200), (0, 100), (100, 0)), strict=True):
        town.way(corner, end, highway="residential", sidewalk="both")
    return town


def test_a_roundabout_has_no_sidewalk_around_its_island_and_no_crossing_to_it(
    tmp_path: Path,
) -> None:
    district = district_of(roundabout(), tmp_path)
    middle = shapely.Point(100.0, 100.0)
    assert shapely.distance(district.ground.walkable, middle) > 20.0
    assert len(crossings_of(district)) == 4
    assert shapely.get_num_geometries(district.ground.walkable) == 1


@pytest.mark.parametrize(
    ("ring", "side"),
    [
        (((120, 100), (100, 120), (80, 100), (100, 80)), "left"),
        (((120, 100), (100, 80), (80, 100), (100, 120)), "right"),
        (((120, 100), (114, 114), (100, 120)), "left"),  # a part of one
        (((120, 100), (114, 114)), "left"),
    ],
)
def test_the_island_is_where_a_roundabout_turns_to(ring: tuple[Point, ...], side: str) -> None:
    street = Street({"junction": "roundabout"}, shapely.LineString(ring), 6.0, ())
    assert street.inner_side == side
    assert Street({}, street.line, 6.0, ()).inner_side == ""


def test_both_sides_of_a_loop_have_their_whole_sidewalk(tmp_path: Path) -> None:
    town = Town()
    town.way(*square(50, 50, 100), highway="residential", sidewalk="both", sidewalk__width="2")
    walks = district_of(town, tmp_path).ground.walks
    away = 0.5 * 5.5 + 0.5 * 2.0
    total = sum(walk.line.length for walk in walks if walk.source == "tag")
    assert total == pytest.approx(4 * (100 + 2 * away) + 4 * (100 - 2 * away), rel=0.005)


@pytest.mark.parametrize("kind", ["pelican", "puffin", "toucan"])
def test_british_crossings_with_signals_have_them(tmp_path: Path, kind: str) -> None:
    town = Town()
    town.way((0, 100), (60, 100), (200, 100), highway="residential", sidewalk="both")
    town.node((60, 100), highway="crossing", crossing=kind)
    assert [walk.has_signals for walk in crossings_of(district_of(town, tmp_path))] == [True]


@pytest.mark.parametrize(("crossing", "count"), [("traffic_signals", 1), ("no", 0)])
def test_signals_between_junctions_are_a_crossing_where_they_say_so(
    tmp_path: Path, crossing: str, count: int
) -> None:
    town = Town()
    town.way((0, 100), (60, 100), (200, 100), highway="residential", sidewalk="left")
    town.node((60, 100), highway="traffic_signals", crossing=crossing)
    crossings = crossings_of(district_of(town, tmp_path))
    assert [walk.has_signals for walk in crossings] == [True] * count


@pytest.mark.parametrize(("value", "count"), [("marked", 1), ("no", 0)])
def test_a_drawn_crossing_that_is_none_is_left_out(tmp_path: Path, value: str, count: int) -> None:
    town = small_town()
    town.way((20, 50), (20, 150), highway="footway", footway="crossing", crossing=value)
    drawn = [walk for walk in crossings_of(district_of(town, tmp_path)) if walk.line.length > 99.0]
    assert len(drawn) == count


@pytest.mark.parametrize(
    ("tags", "homes"),
    [
        ({"building": "house"}, 1),
        ({"building": "yes", "addr__housenumber": "7"}, 1),
        ({"building": "yes", "addr__housenumber": "7", "office": "company"}, 0),
        ({"building": "yes"}, 0),
    ],
)
def test_a_house_of_which_only_the_address_is_mapped_is_a_home(
    tmp_path: Path, tags: dict[str, str], homes: int
) -> None:
    town = Town()
    town.way((0, 50), (200, 50), highway="footway")
    town.way(*square(100, 60, 10), **tags)
    assert homes_of(town, tmp_path) == homes


def test_addresses_are_homes_where_no_building_is_one(tmp_path: Path) -> None:
    town = Town()
    town.way((0, 50), (200, 50), highway="footway")
    for x in (20, 150):
        town.node((x, 56), addr__housenumber=str(x))
    town.node((80, 56), addr__housenumber="80", shop="bakery")
    assert homes_of(town, tmp_path) == 2
    town.way(*square(100, 60, 10), building="apartments")
    assert homes_of(town, tmp_path) == 1


def homes_of(town: Town, folder: Path) -> int:
    """The number of homes along the ways of a town."""
    extract = read_extract(town.write(folder / "town.osm"), GEO)
    graph = with_places(build_graph(build_district(extract, 0)), extract)
    assert graph.homes is not None
    return int(graph.homes.sum())


def test_a_width_that_is_estimated_counts_where_none_is_measured(tmp_path: Path) -> None:
    town = Town()
    town.way((0, 50), (200, 50), highway="footway", est_width="4")
    town.way((0, 150), (200, 150), highway="footway", est_width="4", width="3")
    walkable = district_of(town, tmp_path).ground.walkable
    across = shapely.clip_by_rect(walkable, 99.0, 0.0, 100.0, 200.0)
    assert across.area == pytest.approx(4.0 + 3.0, rel=0.01)


def test_towers_and_low_walls_are_as_high_as_tagged(tmp_path: Path) -> None:
    town = small_town()
    town.way(*square(20, 20, 20), building="yes", height="180 m")
    town.way((120, 20), (180, 20), barrier="wall", height="0.2")
    built = district_of(town, tmp_path).ground.built
    assert {height for _, _, height in built} == {15.0, 180.0, 0.2}


@pytest.mark.parametrize(
    ("tags", "is_there"),
    [
        ({"level": "0-1"}, True),
        ({"level": "1;0"}, True),
        ({"level": "-1-1"}, True),
        ({"level": "-1"}, False),
        ({"level": ""}, True),
        ({"level": "mezzanine"}, False),
        ({"level": "0.0"}, True),
        ({"level": "1-2"}, False),
        ({"layer": "+1"}, True),
        ({"layer": "ground"}, True),
        ({"layer": "-1"}, False),
        ({"access": "military"}, False),
        ({"access": "customers"}, True),
        ({"access": "private", "foot": "destination"}, True),
        ({"foot": "use_sidepath"}, False),
    ],
)
def test_a_path_is_there_if_it_is_on_the_ground_and_open(
    tmp_path: Path, tags: dict[str, str], is_there: bool
) -> None:
    town = small_town()
    town.way((0, 20), (90, 20), highway="footway", **tags)
    walks = district_of(town, tmp_path).ground.walks
    assert any(walk.kind == "footway" and walk.source == "drawn" for walk in walks) == is_there


@pytest.mark.parametrize(
    ("tags", "sides"),
    [
        ({"sidewalk": "left;right"}, {"left": "tag", "right": "tag"}),
        ({"access": "private"}, {}),
        ({"access": "private", "sidewalk": "both", "foot": "yes"}, {"left": "tag", "right": "tag"}),
        ({"access": "private", "sidewalk": "both"}, {}),
        ({"access": "no", "bus": "yes"}, {"left": "rule", "right": "rule"}),
        ({"foot": "no"}, {}),
        ({"foot": "no", "sidewalk": "left"}, {"left": "tag"}),
    ],
)
def test_sidewalks_are_filled_in_where_people_may_walk(
    tags: dict[str, str], sides: dict[str, str]
) -> None:
    assert sidewalk_sides({"highway": "residential", **tags}) == sides


@pytest.mark.parametrize(
    ("tags", "signals"),
    [
        ({"crossing": "traffic_signals;island"}, True),
        ({"crossing": "marked", "crossing:signals": "shared"}, True),
        ({"crossing": "marked", "crossing:signals": "no"}, False),
        ({"crossing": "zebra"}, False),
    ],
)
def test_signals_of_a_crossing_are_tagged_in_several_ways(
    tags: dict[str, str], signals: bool
) -> None:
    assert has_signals(tags) == signals


def test_people_may_walk_on_a_cycleway_that_permits_it() -> None:
    assert walk_kind({"highway": "cycleway", "foot": "permissive"}) == "cycleway"
    assert walk_kind({"highway": "cycleway"}) == ""


def test_a_concrete_barrier_stands_in_the_way(tmp_path: Path) -> None:
    town = small_town()
    town.way((120, 20), (180, 20), barrier="jersey_barrier")
    built = district_of(town, tmp_path).ground.built
    assert "barrier" in [kind for kind, _, _ in built]
