"""Where people walk in towns of other shapes: alleys, bends, motorways and the box's edge."""

from pathlib import Path

import pytest
import shapely

from harness.street.district import District, build_district
from harness.street.osm_file import GeoBox, read_extract
from harness.street.route_graph import build_graph
from harness.street.routes import find_route, nearest_point
from navstack.errors import InputError
from tests.street.town import BOX, Point, Town

MIDDLE = shapely.Point(75, 100)  # of the street between the houses


def district_of(town: Town, folder: Path) -> District:
    path = town.write(folder / "town.osm")
    return build_district(read_extract(path, GeoBox(*map(float, BOX.split(",")))), 0)


def house(town: Town, low: float, high: float) -> None:
    """One beside the street at y = 100 m."""
    corners = ((60.0, low), (90.0, low), (90.0, high), (60.0, high), (60.0, low))
    town.way(*corners, building="yes")


@pytest.mark.parametrize(
    ("tags", "is_shared"),
    [
        ({"highway": "residential"}, True),
        ({"highway": "residential", "sidewalk": "both", "foot": "use_sidepath"}, False),
        ({"highway": "trunk", "sidewalk": "both", "width": "5.5"}, False),
    ],
)
def test_people_share_streets_of_towns_only(
    tmp_path: Path, tags: dict[str, str], is_shared: bool
) -> None:
    town = Town()
    town.way((0, 100), (200, 100), **tags)
    town.way((0, 20), (200, 20), highway="footway")
    house(town, 102, 120)
    house(town, 80, 98)
    assert district_of(town, tmp_path).ground.walkable.intersects(MIDDLE) is is_shared


def test_nobody_shares_a_motorway_beside_a_street_without_room(tmp_path: Path) -> None:
    town = Town()
    town.way((0, 100), (200, 100), highway="residential", sidewalk="both")
    town.way((0, 111.5), (200, 111.5), highway="motorway", lanes="3")
    house(town, 102.2, 106.2)
    house(town, 80, 98)
    walkable = district_of(town, tmp_path).ground.walkable
    assert walkable.intersects(MIDDLE)
    assert not walkable.intersects(shapely.Point(75, 111.5))


@pytest.mark.parametrize("beyond", [(), ("guard_rail",)])
def test_nobody_shares_a_street_of_two_carriageways(
    tmp_path: Path, beyond: tuple[str, ...]
) -> None:
    town = Town()
    town.way((0, 20), (200, 20), highway="footway")
    town.way((0, 100), (200, 100), highway="primary", oneway="yes")
    town.way((200, 110), (0, 110), highway="primary", oneway="yes")
    for barrier in beyond:
        town.way((0, 105), (200, 105), barrier=barrier)
    house(town, 80, 98)
    assert not district_of(town, tmp_path).ground.walkable.intersects(MIDDLE)


def test_a_street_that_leads_back_upon_itself_is_shared_between_its_houses(tmp_path: Path) -> None:
    town = Town()
    town.way((0, 20), (200, 20), highway="footway")
    town.way((20, 100), (130, 100), (20, 100), highway="residential")
    house(town, 80, 98)
    house(town, 102, 120)
    walkable = district_of(town, tmp_path).ground.walkable
    assert walkable.intersects(MIDDLE)
    assert not walkable.intersects(shapely.Point(110, 100))


@pytest.mark.parametrize("highway", ["motorway_link", "residential"])
def test_no_link_leads_over_a_motorway(tmp_path: Path, highway: str) -> None:
    town = Town()
    town.way((0, 100), (200, 100), highway="footway")
    town.way((0, 109), (200, 109), highway="footway")
    town.way((-40, 104.5), (240, 104.5), highway=highway, width="4")
    parts = shapely.get_parts(district_of(town, tmp_path).ground.walkable)
    assert len(parts) == (2 if highway == "motorway_link" else 1)


def test_a_street_that_is_drawn_as_an_area_is_one_and_no_loop(tmp_path: Path) -> None:
    town = Town()
    town.way((0, 20), (200, 20), highway="footway")
    town.way((0, 100), (100, 100), highway="residential")
    corners = ((100.0, 90.0), (130.0, 90.0), (130.0, 120.0), (100.0, 120.0), (100.0, 90.0))
    town.way(*corners, highway="residential", area="yes")
    ground = district_of(town, tmp_path).ground
    assert ground.roads.contains(shapely.box(102, 92, 128, 118))
    assert not ground.walkable.intersects(shapely.box(100.5, 90.5, 200, 200))


@pytest.mark.parametrize("highway", ["motorway", "primary"])
def test_no_crossing_is_filled_in_over_a_motorway(tmp_path: Path, highway: str) -> None:
    town = Town()
    town.way((0, 94), (200, 94), highway="footway")
    town.way((0, 106), (200, 106), highway="footway")
    town.way((-40, 100), (100, 100), (240, 100), highway=highway, width="6.5")
    town.way((100, 100), (200, 80), highway="motorway_link")
    walks = district_of(town, tmp_path).ground.walks
    over = [walk for walk in walks if walk.kind == "crossing" and walk.line.length > 10.0]
    assert bool(over) is (highway == "primary")


BLOCK = (  # a corner, and the middle of the side that begins there
    ((50.0, 50.0), (100.0, 56.0)),
    ((150.0, 50.0), (144.0, 100.0)),
    ((150.0, 150.0), (100.0, 144.0)),
    ((50.0, 150.0), (56.0, 100.0)),
)


def ring(town: Town, corners: tuple[tuple[Point, Point], ...]) -> None:
    """Streets around a block, of two ways on each side."""
    for number, (corner, middle) in enumerate(corners):
        end = corners[(number + 1) % len(corners)][0]
        town.way(corner, middle, highway="residential", sidewalk="both")
        town.way(middle, end, highway="residential", sidewalk="both")


def test_a_sidewalk_goes_on_where_its_street_becomes_another_way(tmp_path: Path) -> None:
    town = Town()
    ring(town, BLOCK)
    district = district_of(town, tmp_path)
    assert not [walk for walk in district.ground.walks if walk.kind == "footway"], "no links"
    graph = build_graph(district)
    sides = (((97, 61), (103, 61)), ((139, 97), (139, 103)), ((97, 139), (103, 139)))
    for begin, end in (*sides, ((61, 97), (61, 103))):
        route = find_route(graph, nearest_point(graph, *begin), nearest_point(graph, *end))
        assert route is not None and route.length < 10.0
    for x, y in ((47.2, 47.2), (152.8, 47.2), (152.8, 152.8), (47.2, 152.8)):
        corner = shapely.Point(x, y).buffer(0.7)
        assert district.ground.walkable.contains(corner), "around it from outside, too"


@pytest.mark.parametrize("bend", [0.0, 0.5, 8.0])
def test_a_side_without_a_sidewalk_gets_none_at_a_bend(tmp_path: Path, bend: float) -> None:
    town = Town()
    town.way((0, 100), (100, 100), highway="residential", sidewalk="right")
    town.way((100, 100), (200, 100 + bend), highway="residential", sidewalk="right")
    ground = district_of(town, tmp_path).ground
    assert not ground.walkable.intersects(shapely.Point(100, 104))
    assert ground.walkable.contains(shapely.LineString(((90, 96), (100, 96), (110, 96))))


@pytest.mark.parametrize("highway", ["footway", "service", "living_street", "pedestrian"])
def test_a_way_that_the_box_cuts_goes_on_however_wide_it_is(tmp_path: Path, highway: str) -> None:
    town = Town()
    town.way((-20, 100), (150, 100), highway=highway)
    town.way((20, 20), (100, 20), highway="footway")
    graph = build_graph(district_of(town, tmp_path))
    goes_on = graph.goes_on[graph.points[:, 1] > 50.0]
    assert goes_on.all() and not graph.goes_on.all()


def test_a_box_beside_all_ways_is_refused(tmp_path: Path) -> None:
    """The footway ends 15 m before the box, so that it is among the ways but not on its ground."""
    town = Town()
    town.way((0, -15), (200, -15), highway="footway")
    with pytest.raises(InputError, match="the box has no sidewalk, footway or area for people"):
        district_of(town, tmp_path)
