"""The graph of ways, its file for Nav2's route server, and routes over it."""

import dataclasses
import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely

from harness.street.district import build_district
from harness.street.graph_file import load_graph, save_graph
from harness.street.medial_axis import chains_of, medial_axis
from harness.street.osm_file import CREDIT, GeoBox, read_extract
from harness.street.route_graph import CLEARANCE, RouteGraph, WayEdge, build_graph
from harness.street.routes import draw_mission, find_route, nearest_point
from harness.world.map.shapes import Rect
from navbench.cli.app import main
from navstack.errors import InputError, MapError
from tests.street.town import BOX, small_town

pytest.importorskip("osmium", reason="needs osmium (pip install 'navbench[street]')")
HELSINKI = Path(os.environ.get("NAVSTACK_DATA", "")) / "osm" / "helsinki.osm.pbf"


def square(crossing: int = -1) -> RouteGraph:
    """Four sides of a square of 100 m, one of them a crossing; a piece apart."""
    points = np.array(((0, 0), (100, 0), (100, 100), (0, 100), (300, 0), (400, 0)), dtype=float)
    pairs = np.array(((0, 1), (1, 2), (2, 3), (0, 3), (4, 5)))
    edges = [WayEdge("sidewalk", 2.0)] * 5
    edges[1] = WayEdge("crossing", 4.0, crossing, True)
    return RouteGraph(points, pairs, edges)


def test_missions_without_any_route_have_no_length_to_show(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    points = np.array(((0, 0), (20, 0), (0, 300), (20, 300)), dtype=float)
    apart = RouteGraph(points, np.array(((0, 1), (2, 3))), [WayEdge("sidewalk", 2.0)] * 2)
    save_graph(apart, tmp_path / "apart_graph.geojson")
    with pytest.raises(SystemExit) as leaving:
        main(["map", "routes", str(tmp_path / "apart_graph.geojson"), "--missions", "3"])
    assert not leaving.value.code
    assert "with a route: 0.000" in capsys.readouterr().out


def test_the_axis_of_a_corridor_is_its_middle() -> None:
    corridor = shapely.box(0.0, 0.0, 30.0, 2.0)
    points, radii, pairs = medial_axis(corridor, 0.45)
    middle = (points[:, 0] > 1.5) & (points[:, 0] < 28.5)
    assert points[middle, 1] == pytest.approx(1.0, abs=0.01)
    assert radii[middle] == pytest.approx(1.0, abs=0.03)
    lengths = np.hypot(*(points[pairs[:, 0]] - points[pairs[:, 1]]).T)
    assert lengths.sum() > 27.0


def test_nothing_narrow_is_a_way() -> None:
    assert [len(each) for each in medial_axis(shapely.Polygon(), 0.45)] == [0, 0, 0]
    assert len(medial_axis(shapely.box(0.0, 0.0, 30.0, 0.8), 0.45)[2]) == 0


def test_chains_end_at_ends_and_junctions() -> None:
    loop_and_tail = np.array(((0, 1), (1, 2), (2, 3), (3, 1), (4, 5), (5, 6), (6, 4)))
    chains = chains_of(7, loop_and_tail)
    assert sorted(len(chain) for chain in chains) == [2, 4, 4]


def test_a_route_is_the_shortest_and_counts_crossings() -> None:
    graph = square(crossing=7)
    route = find_route(graph, 0, 2)
    assert route is not None
    assert route.length == pytest.approx(200.0)
    over = find_route(graph, 1, 2)
    assert over is not None
    assert (over.crossings, over.signals) == (1, 1)
    assert find_route(graph, 0, 4) is None


def test_missions_without_a_way_are_kept() -> None:
    graph, rng = square(), np.random.default_rng(0)
    drawn = [draw_mission(graph, 90.0, 1000.0, rng) for _ in range(40)]
    assert {mission.route is None for mission in drawn} == {True, False}
    with pytest.raises(InputError, match="the box is too small"):
        draw_mission(graph, 5000.0, 9000.0, rng)


def test_pairs_whose_ways_meet_beyond_the_box_are_drawn_anew() -> None:
    graph = dataclasses.replace(square(), box=Rect(-50.0, -50.0, 401.0, 150.0))
    assert graph.goes_on.tolist() == [False] * 4 + [True] * 2
    both = dataclasses.replace(square(), box=Rect(-1.0, -50.0, 401.0, 150.0))
    assert both.goes_on.all()
    for ways, is_routed in ((graph, {True, False}), (both, {True})):
        rng = np.random.default_rng(0)
        drawn = [draw_mission(ways, 90.0, 1000.0, rng) for _ in range(40)]
        assert {mission.route is not None for mission in drawn} == is_routed
        assert (sum(mission.beyond for mission in drawn) > 0) is (ways is both)


@pytest.mark.parametrize("bounds", [None, [0.0, 0.0, 1.0, 1.0], "the whole", [-1.0, -1.0, 500.0]])
def test_a_box_that_does_not_hold_the_ways_is_none(tmp_path: Path, bounds: Any) -> None:
    box = Rect(-1.0, -1.0, 500.0, 101.0)
    path = tmp_path / "graph.geojson"
    save_graph(dataclasses.replace(square(), box=box), path)
    assert load_graph(path).box == box
    content = json.loads(path.read_text())
    path.write_text(json.dumps({**content, "bbox": bounds}))
    assert load_graph(path).box is None


def test_a_place_far_from_all_ways_is_refused() -> None:
    assert nearest_point(square(), 98.0, 3.0) == 1
    with pytest.raises(InputError, match="nearest way is 71 m away"):
        nearest_point(square(), 50.0, 50.0)


def test_the_file_has_what_nav2s_loader_reads(tmp_path: Path) -> None:
    save_graph(square(crossing=7), tmp_path / "graph.geojson")
    features = json.loads((tmp_path / "graph.geojson").read_text())["features"]
    kinds = [feature["geometry"]["type"] for feature in features]
    assert (kinds.count("Point"), kinds.count("MultiLineString")) == (6, 10)
    numbers = [feature["properties"]["id"] for feature in features]
    assert len(set(numbers)) == len(numbers)
    edge = features[8]["properties"]
    assert (edge["startid"], edge["endid"], edge["cost"]) == (1, 2, 100.0)
    assert edge["metadata"] == {
        "class": "crossing",
        "width": 4.0,
        "crossing": 7,
        "signals": True,
    }
    again = load_graph(tmp_path / "graph.geojson")
    assert again.edges == square(crossing=7).edges
    assert again.points.tolist() == square().points.tolist()


@pytest.mark.parametrize("text", ["", "[]", '{"features":[]}', '{"features":[{"geometry":1}]}'])
def test_another_file_is_no_graph(tmp_path: Path, text: str) -> None:
    (tmp_path / "graph.geojson").write_text(text)
    with pytest.raises(MapError, match="graph.geojson"):
        load_graph(tmp_path / "graph.geojson")


@pytest.mark.parametrize("distance", ["0.1,inf", "0.1,101", "nan,1", "0,1", "1,0.1"])
def test_missions_on_a_graph_have_the_range_of_those_that_are_driven(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], distance: str
) -> None:
    save_graph(square(), tmp_path / "graph.geojson")
    with pytest.raises(SystemExit) as leaving:
        main(["map", "routes", str(tmp_path / "graph.geojson"), "--distance", distance, "--json"])
    assert leaving.value.code == 1
    assert (
        f"--distance {distance}: give 0 < least < most, at most 100 km" in capsys.readouterr().err
    )


def test_the_ways_of_a_town_keep_off_what_is_not_walkable(tmp_path: Path) -> None:
    extract = read_extract(
        small_town().write(tmp_path / "town.osm"), GeoBox(*map(float, BOX.split(",")))
    )
    district = build_district(extract, 0)
    graph = build_graph(district)
    stands = shapely.union_all([shapely.Polygon(p.polygon) for p in district.furniture.pieces])
    free = shapely.difference(district.ground.walkable, stands).buffer(-CLEARANCE + 0.06)
    assert shapely.covers(free, shapely.linestrings(graph.points[graph.pairs])).all()
    assert {"sidewalk", "crossing"} <= {edge.kind for edge in graph.edges}
    assert not any(edge.has_signals for edge in graph.edges)  # that crossing's kerbs are raised
    # from one corner of the junction to the one across both streets
    route = find_route(graph, nearest_point(graph, 90.0, 90.0), nearest_point(graph, 110.0, 110.0))
    assert route is not None
    assert route.crossings == 2


@pytest.mark.slow
@pytest.mark.skipif(not HELSINKI.exists(), reason="NAVSTACK_DATA has no osm/helsinki.osm.pbf")
def test_missions_in_helsinki_have_drivable_routes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    box = "24.9420,60.1650,24.9470,60.1680"
    district = build_district(read_extract(HELSINKI, GeoBox(*map(float, box.split(",")))), 0)
    save_graph(build_graph(district), tmp_path / "centre_graph.geojson")
    with pytest.raises(SystemExit) as leaving:
        main(
            ["map", "routes", str(tmp_path / "centre_graph.geojson"), "--missions", "100"]
            + ["--distance", "0.15,2.5", "--json"]
        )
    assert leaving.value.code in (None, 0)
    document = json.loads(capsys.readouterr().out)
    assert document["routed_share"]["value"] >= 0.9
    assert document["credit"] == CREDIT
    assert all(each["length_m"] is None or each["length_m"] >= 150 for each in document["missions"])
