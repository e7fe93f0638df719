"""Shapes that files of OpenStreetMap have: cut ways, ways before nodes, areas of several ways."""

import gzip
import re
from pathlib import Path

import pytest
import shapely

from harness.street.district import build_district
from harness.street.osm_file import Extract, GeoBox, read_extract
from navstack.errors import InputError
from tests.street.town import BOX, element, node_element, small_town

osmium = pytest.importorskip("osmium", reason="needs osmium (pip install 'navbench[street]')")
GEO = GeoBox(*map(float, BOX.split(",")))


def extract_of(folder: Path, *elements: str) -> Extract:
    file = folder / "town.osm"
    body = "\n".join(elements)
    file.write_text(f'<osm version="0.6">\n{body}\n</osm>\n', encoding="utf-8")
    return read_extract(file, GEO)


def row_of_nodes(*places: float) -> list[str]:
    """Nodes 1, 2, ... at these x [m], in the middle of the box."""
    return [node_element(number + 1, x, 100.0) for number, x in enumerate(places)]


def test_a_way_keeps_the_parts_whose_nodes_the_file_has(tmp_path: Path) -> None:
    nodes = row_of_nodes(10.0, 50.0, 120.0, 180.0)
    way = element("way", 1, (77, 1, 2, 78, 3, 4, 79), highway="residential")
    lines = extract_of(tmp_path, *nodes, way).lines
    assert [line.nodes for line in lines] == [(1, 2), (3, 4)]
    assert [line.geometry.length for line in lines] == pytest.approx([40.0, 60.0], rel=0.01)


def test_a_node_alone_or_twice_at_a_place_is_no_line(tmp_path: Path) -> None:
    nodes = row_of_nodes(10.0, 10.0, 60.0)
    alone = element("way", 1, (1,), highway="footway")
    same = element("way", 2, (1, 2), highway="footway")
    line = element("way", 3, (1, 2, 3), highway="footway")
    lines = extract_of(tmp_path, *nodes, alone, same, line).lines
    assert [line.nodes for line in lines] == [(1, 3)]


def test_a_file_that_names_no_box_has_that_of_its_nodes(tmp_path: Path) -> None:
    file = small_town().write(tmp_path / "town.osm.xml")
    nodes = [(one.lon, one.lat) for one in osmium.FileProcessor(str(file), osmium.osm.NODE)]
    longitudes, latitudes = zip(*nodes, strict=True)
    geo = read_extract(file).geo
    assert (geo.west, geo.east) == (min(longitudes), max(longitudes))
    assert (geo.south, geo.north) == (min(latitudes), max(latitudes))
    file.write_text("<osm version='0.6'></osm>", encoding="utf-8")
    with pytest.raises(InputError, match="has no node"):
        read_extract(file)


def test_ways_may_stand_before_their_nodes(tmp_path: Path) -> None:
    nodes = row_of_nodes(10.0, 50.0, 120.0)
    way = element("way", 5, (1, 2, 3), highway="footway")
    ordered = extract_of(tmp_path, *nodes, way).lines
    lines = extract_of(tmp_path, way, *reversed(nodes)).lines
    assert lines[0].nodes == (1, 2, 3)
    assert lines[0].geometry == ordered[0].geometry


def test_pbf_may_have_ways_before_their_nodes(tmp_path: Path) -> None:
    file, town = tmp_path / "unordered.osm.pbf", small_town().write(tmp_path / "town.osm")
    with osmium.SimpleWriter(str(file)) as writer:
        for kind in (osmium.osm.WAY, osmium.osm.NODE):
            for one in osmium.FileProcessor(str(town), kind):
                writer.add(one)
    expected, found = read_extract(town, GEO), read_extract(file, GEO)
    assert [line.nodes for line in found.lines] == [line.nodes for line in expected.lines]
    assert len(found.areas) == len(expected.areas) == 1


def test_what_an_editor_has_not_uploaded_is_read(tmp_path: Path) -> None:
    town = small_town().write(tmp_path / "town.osm")
    expected = read_extract(town, GEO)
    square = element("relation", 9, (), '<member type="way" ref="3" role="outer"/>')
    text = town.read_text(encoding="utf-8").replace("</osm>", f"{square}</osm>")
    draft = tmp_path / "draft.osm"
    draft.write_text(re.sub('(id|ref)="', '\\1="-', text), encoding="utf-8")
    found = read_extract(draft, GEO)
    for kind in ("points", "lines", "areas"):
        shapes = [
            {shapely.to_wkt(thing.geometry) for thing in getattr(extract, kind)}
            for extract in (expected, found)
        ]
        assert shapes[0] == shapes[1]
        assert shapes[0]


def test_a_coastline_is_no_street(tmp_path: Path) -> None:
    nodes = row_of_nodes(-9000.0, 10.0, 100.0, 9000.0)
    coast = element("way", 1, (1, 4), natural="coastline")
    path = element("way", 2, (2, 3), highway="footway")
    assert [line.nodes for line in extract_of(tmp_path, *nodes, coast, path).lines] == [(2, 3)]


def test_a_square_of_several_ways_has_its_hole(tmp_path: Path) -> None:
    corners = [(20, 20), (80, 20), (80, 80), (20, 80), (40, 40), (60, 40), (60, 60), (40, 60)]
    nodes = [node_element(number + 1, *corner) for number, corner in enumerate(corners)]
    outer = element("way", 1, (1, 2, 3)), element("way", 2, (3, 4, 1))
    inner = element("way", 3, (5, 6, 7, 8, 5))
    members = "".join(
        f'<member type="way" ref="{number}" role="{role}"/>'
        for number, role in ((1, "outer"), (2, "outer"), (3, "inner"))
    )
    tags = {"type": "multipolygon", "highway": "pedestrian"}
    square = element("relation", 1, (), inside=members, **tags)
    extract = extract_of(tmp_path, *nodes, *outer, inner, square)
    plazas = build_district(extract, 0).ground.plazas
    assert plazas.area == pytest.approx(60.0 * 60.0 - 20.0 * 20.0, rel=0.01)
    assert not plazas.contains(shapely.Point(50.0, 50.0))


@pytest.mark.parametrize("mark", ['visible="false"', "action='delete'"])
def test_what_is_deleted_is_no_street(tmp_path: Path, mark: str) -> None:
    """Editors keep what is deleted and not uploaded, with a mark."""
    nodes = row_of_nodes(10.0, 50.0, 120.0)
    path = element("way", 1, (1, 2, 3), highway="footway")
    deleted = element("way", 2, (1, 3), highway="footway").replace("<way ", f"<way {mark} ")
    assert [line.nodes for line in extract_of(tmp_path, *nodes, path, deleted).lines] == [(1, 2, 3)]
    packed = tmp_path / "town.osm.gz"
    packed.write_bytes(gzip.compress((tmp_path / "town.osm").read_bytes()))
    assert len(read_extract(packed, GEO).lines) == 1


def test_a_history_file_has_its_streets_as_they_are_now(tmp_path: Path) -> None:
    nodes = row_of_nodes(10.0, 50.0, 120.0)
    moved = node_element(1, 30.0, 100.0)
    path = element("way", 1, (1, 3), highway="footway")
    shorter = element("way", 1, (1, 2), highway="footway")
    gone = element("way", 2, (1, 3), highway="footway")
    removed = gone.replace("<way ", "<way visible='false' ")
    later = [each.replace('version="1"', 'version="2"') for each in (moved, shorter, removed)]
    body = "".join([nodes[0], later[0], *nodes[1:], path, later[1], gone, later[2]])
    text, history = tmp_path / "town.osh", tmp_path / "town.osh.pbf"
    text.write_text(f'<osm version="0.6">{body}</osm>', encoding="utf-8")
    with osmium.SimpleWriter(str(history)) as writer:
        for one in osmium.FileProcessor(str(text)):
            writer.add(one)
    (line,) = read_extract(history, GEO).lines
    assert line.nodes == (1, 2)
    assert line.geometry.length == pytest.approx(20.0, rel=0.01)


@pytest.mark.parametrize("geo", [GEO, None])
def test_ways_without_their_nodes_are_told_from_an_empty_box(
    tmp_path: Path, geo: GeoBox | None
) -> None:
    """A query may ask for ways alone."""
    file = tmp_path / "town.osm"
    way = element("way", 1, (1, 2), highway="footway")
    file.write_text(f'<osm version="0.6">{way}</osm>', encoding="utf-8")
    with pytest.raises(InputError, match="ways with their nodes"):
        read_extract(file, geo)


def test_a_house_that_a_wall_surrounds_is_a_house(tmp_path: Path) -> None:
    corners = [(20, 20), (40, 20), (40, 40), (20, 40)]
    nodes = [node_element(number + 1, *corner) for number, corner in enumerate(corners)]
    house = element("way", 1, (1, 2, 3, 4, 1), building="yes", barrier="wall")
    (area,) = extract_of(tmp_path, *nodes, house).areas
    assert area.geometry.area == pytest.approx(400.0, rel=0.01)
