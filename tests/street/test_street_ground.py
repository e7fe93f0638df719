"""Where people walk in towns of other shapes: alleys, bends, motorways and the box's edge."""

from pathlib import Path

import pytest
import shapely

from harness.street.district import District, build_district
from harness.street.osm_file import GeoBox, read_extract
from harness.street.route_graph import build_graph
from tests.street.town import BOX, Town

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


@pytest.mark.parametrize("highway", ["footway", "service", "living_street", "pedestrian"])
def test_a_way_that_the_box_cuts_goes_on_however_wide_it_is(tmp_path: Path, highway: str) -> None:
    town = Town()
    town.way((-20, 100), (150, 100), highway=highway)
    town.way((20, 20), (100, 20), highway="footway")
    graph = build_graph(district_of(town, tmp_path))
    goes_on = graph.goes_on[graph.points[:, 1] > 50.0]
    assert goes_on.all() and not graph.goes_on.all()
