"""Scenes on disk, users' maps as scenes, and bodies raised from occupied cells."""

import json
from pathlib import Path

import numpy as np
import pytest
import shapely

from harness.world.map.extrude import WALL_HEIGHT, extrude, merge_rectangles
from harness.world.map.scene import Obstacle, Scene, Zone
from harness.world.map.scene_io import load_scene, map_names, save_scene
from harness.world.map.shapes import Rect, box, octagon, polygon_area
from navstack.costmap.map_io import save_map
from navstack.costmap.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid, align
from navstack.errors import MapError, UnknownNameError
from navstack.types import Pose2D


def small_scene() -> Scene:
    geometry = np.zeros((30, 40), dtype=np.int8)
    geometry[3:9, 5:12] = OCCUPIED
    walkable = geometry.copy()
    walkable[20:] = OCCUPIED
    mesh = walkable.copy()
    mesh[:, :3] = OCCUPIED
    origin = Pose2D(-1.25, 2.5, 0.0)
    return Scene(
        "small",
        (
            Obstacle("mailbox", box(-0.8, 2.8, 0.3, 0.4, 0.3), 1.3),
            Obstacle("bollard", octagon(1.0, 3.0, 0.15), 0.9),
        ),
        (
            Zone("road", Rect(-1.0, 2.5, 1.0, 3.5).polygon, -0.12),
            Zone("sidewalk", Rect(-1.0, 2.5, 1.0, 3.5).polygon),
        ),
        OccupancyGrid(geometry, 0.05, origin),
        OccupancyGrid(walkable, 0.05, origin),
        OccupancyGrid(mesh, 0.05, origin),
    )


def assert_same(a: Scene, b: Scene) -> None:
    for one, other in (
        (a.geometry, b.geometry),
        (a.walkable, b.walkable),
        (a.navigation_mesh, b.navigation_mesh),
    ):
        assert np.array_equal(one.data, other.data)
        assert (one.resolution, one.origin) == (other.resolution, other.origin)
    assert [(o.kind, o.height, o.polygon.tolist()) for o in a.obstacles] == [
        (o.kind, o.height, o.polygon.tolist()) for o in b.obstacles
    ]
    assert [(z.kind, z.elevation, z.polygon.tolist()) for z in a.zones] == [
        (z.kind, z.elevation, z.polygon.tolist()) for z in b.zones
    ]


def test_a_saved_scene_is_read_back_unchanged(tmp_path: Path) -> None:
    scene = small_scene()
    save_scene(scene, tmp_path / "new", "small")
    again = load_scene(tmp_path / "new" / "small.yaml")
    assert again.name == "small"
    assert_same(scene, again)


def test_cells_come_from_the_cache_until_the_map_changes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NAVSTACK_CACHE", str(tmp_path / "cache"))
    cells = np.zeros((4, 4), dtype=np.int8)
    for value in (FREE, OCCUPIED, OCCUPIED):
        cells[1, 2] = value
        save_map(OccupancyGrid(cells, 0.5, Pose2D()), tmp_path / "m.yaml")
        assert load_scene(tmp_path / "m.yaml").geometry.data.tolist() == cells.tolist()
    assert len(list((tmp_path / "cache").iterdir())) == 2


def test_ground_is_level_where_a_zone_says_nothing(tmp_path: Path) -> None:
    save_map(OccupancyGrid(np.zeros((4, 4), dtype=np.int8), 0.5, Pose2D()), tmp_path / "m.yaml")
    ring = [[0, 0], [1, 0], [1, 1], [0, 0]]
    features = [
        {
            "properties": {"role": "zone", "kind": kind, **more},
            "geometry": {"type": "Polygon", "coordinates": [ring]},
        }
        for kind, more in (("plaza", {}), ("road", {"elevation": -0.15}))
    ]
    (tmp_path / "m.geojson").write_text(json.dumps({"features": features}))
    assert [zone.elevation for zone in load_scene(tmp_path / "m.yaml").zones] == [0.0, -0.15]


@pytest.mark.parametrize(
    ("elevation", "is_allowed"),
    [(1000.0, True), (-1000.0, True), (1001.0, False), (-1001.0, False)],
)
def test_ground_lies_within_a_kilometre(tmp_path: Path, elevation: float, is_allowed: bool) -> None:
    save_map(OccupancyGrid(np.zeros((4, 4), dtype=np.int8), 0.5, Pose2D()), tmp_path / "m.yaml")
    geometry = {"type": "Polygon", "coordinates": [[[0, 0], [1, 0], [1, 1], [0, 0]]]}
    feature = {
        "properties": {"role": "zone", "kind": "road", "elevation": elevation},
        "geometry": geometry,
    }
    (tmp_path / "m.geojson").write_text(json.dumps({"features": [feature]}))
    if is_allowed:
        assert load_scene(tmp_path / "m.yaml").zones[0].elevation == elevation
    else:
        with pytest.raises(MapError, match="is not a number within 1000 m"):
            load_scene(tmp_path / "m.yaml")


@pytest.mark.parametrize("corner", [[1e9, 0.0], [0.0, -1e9], [float("nan"), 0.0]])
def test_no_corner_may_lie_beyond_the_farthest_place(tmp_path: Path, corner: list[float]) -> None:
    save_map(OccupancyGrid(np.zeros((4, 4), dtype=np.int8), 0.5, Pose2D()), tmp_path / "m.yaml")
    geometry = {"type": "Polygon", "coordinates": [[[0, 0], corner, [1, 1], [0, 0]]]}
    feature = {"properties": {"role": "zone", "kind": "road"}, "geometry": geometry}
    (tmp_path / "m.geojson").write_text(json.dumps({"features": [feature]}))
    with pytest.raises(MapError, match="a polygon has 4 to 10000 points"):
        load_scene(tmp_path / "m.yaml")


@pytest.mark.parametrize(
    ("features", "said"),
    [
        ([{}] * 20_001, "20001 features; at most 20000 are read"),
        ([{}] * 20_000, "is not a GeoJSON of obstacles and zones"),
        (
            [{"properties": {"role": "tree"}}],
            "feature 0: role 'tree'; allowed are zone and obstacle",
        ),
    ],
)
def test_a_file_holds_at_most_20_000_zones_and_obstacles(
    tmp_path: Path,
    features: list[object],
    said: str,
) -> None:
    save_map(OccupancyGrid(np.zeros((4, 4), dtype=np.int8), 0.5, Pose2D()), tmp_path / "m.yaml")
    (tmp_path / "m.geojson").write_text(json.dumps({"features": features}))
    with pytest.raises(MapError, match=said):
        load_scene(tmp_path / "m.yaml")


@pytest.mark.parametrize("name", ["m.yaml", "m.yml", "./m.yaml"])
def test_a_map_may_lie_in_the_folder_where_one_is(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    name: str,
) -> None:
    save_map(OccupancyGrid(np.zeros((4, 5), dtype=np.int8), 0.5, Pose2D()), tmp_path / "m.yaml")
    (tmp_path / "m.yml").write_bytes((tmp_path / "m.yaml").read_bytes())
    monkeypatch.chdir(tmp_path)
    assert load_scene(name).geometry.data.shape == (4, 5)
    Path("m.png").write_bytes(b"")
    with pytest.raises(MapError, match="map 'm.png' has no suffix .yaml; give the map_server file"):
        load_scene("m.png")
    with pytest.raises(MapError, match="maps/sidewalk: cannot be read"):
        load_scene("maps/sidewalk")  # a path, not the name of a map


def test_shipped_maps_are_found_by_name_and_others_are_not() -> None:
    assert map_names() == ["sidewalk", "sidewalk_1", "sidewalk_2"]
    with pytest.raises(UnknownNameError, match="did you mean 'sidewalk'"):
        load_scene("sidewolk")
    with pytest.raises(MapError, match=r"nowhere/my\.yaml: cannot be read"):
        load_scene("nowhere/my.yaml")


def test_a_users_map_becomes_walls_and_walkable_ground(tmp_path: Path) -> None:
    cells = np.array([[0, 0, 100], [0, -1, 100], [100, 0, 0]], dtype=np.int8)
    save_map(OccupancyGrid(cells, 0.5, Pose2D(1.0, 2.0)), tmp_path / "m.yaml")
    scene = load_scene(tmp_path / "m.yaml")
    assert scene.walkable.data.tolist() == [[0, 0, 100], [0, 100, 100], [100, 0, 0]]
    assert scene.navigation_mesh is scene.walkable
    assert {o.kind for o in scene.obstacles} == {"unknown"}
    assert sorted(
        (*o.polygon.min(axis=0), *o.polygon.max(axis=0), o.height) for o in scene.obstacles
    ) == [
        (1.0, 3.0, 1.5, 3.5, WALL_HEIGHT),
        (2.0, 2.0, 2.5, 3.0, WALL_HEIGHT),
    ]


@pytest.mark.parametrize("part", ["walkable", "navmesh"])
def test_a_part_of_another_size_is_refused(tmp_path: Path, part: str) -> None:
    save_map(OccupancyGrid(np.zeros((4, 4), dtype=np.int8), 0.5, Pose2D()), tmp_path / "m.yaml")
    save_map(
        OccupancyGrid(np.zeros((4, 5), dtype=np.int8), 0.5, Pose2D()), tmp_path / f"m_{part}.yaml"
    )
    with pytest.raises(MapError, match="size, resolution or origin differs"):
        load_scene(tmp_path / "m.yaml")


@pytest.mark.parametrize(
    "text",
    [
        "{",
        "[]",
        '{"features": [{}]}',
        '{"features": [{"properties": {"role": "obstacle", "kind": "x", "height": "high"}}]}',
        '{"features": [{"properties": {"role": "obstacle", "kind": "x", "height": -1}}]}',
        '{"features": [{"properties": {"role": "zone", "kind": "x", "elevation": Infinity}}]}',
        '{"features": [{"properties": {"role": "zone", "kind": "x"}, "geometry": {"type": '
        '"Polygon", '
        '"coordinates": [[[0,0],[1,1],[1,0],[0,1],[0,0]]]}}]}',
    ],
)
def test_a_bad_geojson_is_one_clear_line(tmp_path: Path, text: str) -> None:
    save_map(OccupancyGrid(np.zeros((4, 4), dtype=np.int8), 0.5, Pose2D()), tmp_path / "m.yaml")
    (tmp_path / "m.geojson").write_text(text)
    with pytest.raises(MapError) as error:
        load_scene(tmp_path / "m.yaml")
    assert "m.geojson" in str(error.value)
    assert "\n" not in str(error.value)


def test_a_clockwise_l_shape_is_cut_into_convex_pieces(tmp_path: Path) -> None:
    ring = [[0, 0], [0, 3], [1, 3], [1, 1], [3, 1], [3, 0], [0, 0]]
    feature = {
        "properties": {"role": "obstacle", "kind": "fence", "height": 1.0},
        "geometry": {"type": "Polygon", "coordinates": [ring]},
    }
    save_map(OccupancyGrid(np.zeros((4, 4), dtype=np.int8), 0.5, Pose2D()), tmp_path / "m.yaml")
    (tmp_path / "m.geojson").write_text(json.dumps({"features": [feature]}))
    pieces = load_scene(tmp_path / "m.yaml").obstacles
    areas = [polygon_area(piece.polygon) for piece in pieces]
    assert len(pieces) > 1
    assert min(areas) > 0
    assert sum(areas) == pytest.approx(5.0)


def hollow(role: str, **more: object) -> dict[str, object]:
    """A square of 10 m with a court of 6 m."""
    rings = [
        [[2, 2], [12, 2], [12, 12], [2, 12], [2, 2]],
        [[4, 4], [4, 10], [10, 10], [10, 4], [4, 4]],
    ]
    geometry = {"type": "Polygon", "coordinates": rings}
    return {"properties": {"role": role, **more}, "geometry": geometry}


def test_a_court_of_a_building_is_free(tmp_path: Path) -> None:
    feature = hollow("obstacle", kind="building", height=9.0)
    save_map(OccupancyGrid(np.zeros((40, 40), dtype=np.int8), 0.5, Pose2D()), tmp_path / "m.yaml")
    (tmp_path / "m.geojson").write_text(json.dumps({"features": [feature]}))
    pieces = [shapely.Polygon(each.polygon) for each in load_scene(tmp_path / "m.yaml").obstacles]
    assert sum(piece.area for piece in pieces) == pytest.approx(64.0)
    assert not any(piece.contains(shapely.Point(7.0, 7.0)) for piece in pieces)
    for bad in ([[4, 4], [5, 5]], [[4, 4], [4, float("nan")], [5, 5], [4, 4]], [[4, 4]] * 10_000):
        feature["geometry"]["coordinates"][1] = bad  # type: ignore[index]
        (tmp_path / "m.geojson").write_text(json.dumps({"features": [feature]}))
        with pytest.raises(MapError, match="feature 0: a polygon has 4 to"):
            load_scene(tmp_path / "m.yaml")
    zone = hollow("zone", kind="road")
    (tmp_path / "m.geojson").write_text(json.dumps({"features": [zone]}))
    with pytest.raises(MapError, match="a zone has no holes; cut it in two"):
        load_scene(tmp_path / "m.yaml")


@pytest.mark.parametrize("yaw", [0.4, -2.0, np.pi / 2])
def test_a_turned_map_is_laid_along_the_axes(yaw: float) -> None:
    cells = np.random.default_rng(1).choice([FREE, OCCUPIED, UNKNOWN], (12, 20)).astype(np.int8)
    turned = OccupancyGrid(cells, 0.1, Pose2D(5.0, -3.0, yaw))
    straight = align(turned)
    assert straight.origin.yaw == 0.0
    for row, column in np.ndindex(straight.data.shape):
        x = straight.origin.x + (column + 0.5) * 0.1 - 5.0
        y = straight.origin.y + (row + 0.5) * 0.1 + 3.0
        u, v = np.cos(yaw) * x + np.sin(yaw) * y, -np.sin(yaw) * x + np.cos(yaw) * y
        inside = 0 <= u < 2.0 and 0 <= v < 1.2
        expected = cells[int(v / 0.1), int(u / 0.1)] if inside else UNKNOWN
        if min(abs(value / 0.1 - round(value / 0.1)) for value in (u, v)) > 1e-6:
            assert straight.data[row, column] == expected
    assert (straight.data != UNKNOWN).sum() == pytest.approx((cells != UNKNOWN).sum(), rel=0.1)


def test_an_untouched_map_stays_the_same_object() -> None:
    grid = OccupancyGrid(np.zeros((4, 4), dtype=np.int8), 0.5, Pose2D(1.0, 1.0))
    assert align(grid) is grid


@pytest.mark.parametrize("seed", range(4))
def test_rectangles_cover_the_solid_cells_once_and_nothing_else(seed: int) -> None:
    solid = np.random.default_rng(seed).random((37, 53)) < 0.2 + 0.2 * seed
    count = np.zeros(solid.shape, dtype=int)
    for r0, c0, r1, c1 in merge_rectangles(solid):
        count[r0:r1, c0:c1] += 1
    assert np.array_equal(count, solid.astype(int))


def test_few_rectangles_are_enough() -> None:
    solid = np.zeros((50, 60), dtype=bool)
    solid[0], solid[-1], solid[:, 0], solid[:, -1] = True, True, True, True
    solid[10:20, 30:31] = True
    assert len(merge_rectangles(solid)) == 5
    grid = OccupancyGrid(np.where(solid, 100, 0).astype(np.int8), 0.1, Pose2D(-1.0, 1.0))
    area = sum(polygon_area(obstacle.polygon) for obstacle in extrude(grid, solid))
    assert area == pytest.approx(solid.sum() * 0.01)
    assert len(merge_rectangles(np.zeros((3, 3), dtype=bool))) == 0
