"""Two pictures of a place become a scene.

Roads, curbs, pavement and obstacles where they were drawn.
"""

import os
from pathlib import Path

import numpy as np
import pytest
import shapely

from harness.episode.factory import Parts
from harness.task.mission import MissionSampler
from harness.task.study import make_study
from harness.world.map.importer import ImportSettings, _zones, import_scene, resampled
from harness.world.map.scene_io import load_scene
from harness.world.map.shapes import polygon_area
from harness.world.physics.elevation import Elevation
from navstack.costmap.map_io import save_map
from navstack.costmap.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from navstack.errors import MapError
from navstack.types import Pose2D
from tests import command

DATA = os.environ.get("NAVSTACK_DATA")
ORIGIN = Pose2D(-10.0, 5.0)
R = 0.1  # [m] of the mesh


def status(*arguments):
    return command.status("map", "import", *arguments)


def place():
    """Mesh and geometry of 40 m x 40 m.

    Pavements, a road of 8 m with a crossing, a house of 10 m x 10 m, a bin.
    """
    mesh = np.full((400, 400), OCCUPIED, dtype=np.int8)
    mesh[2:160] = mesh[240:398] = FREE  # pavements south and north; the road runs between them
    mesh[160:240, 180:220] = FREE  # the crossing
    mesh[48:152, 48:152] = OCCUPIED  # the house, with the distance that a mesh keeps
    mesh[298:308, 298:308] = OCCUPIED  # the bin with its distance
    mesh[:, :2] = mesh[:, 398:] = OCCUPIED
    geometry = np.full((380, 380), FREE, dtype=np.int8)  # begins 1 m further in
    geometry[40:140, 40:140] = UNKNOWN  # inside the house
    geometry[40:42, 40:140] = geometry[138:140, 40:140] = OCCUPIED
    geometry[40:140, 40:42] = geometry[40:140, 138:140] = OCCUPIED
    geometry[290:296, 290:296] = OCCUPIED
    return (
        OccupancyGrid(mesh, R, ORIGIN),
        OccupancyGrid(geometry, R, Pose2D(ORIGIN.x + 1.0, ORIGIN.y + 1.0)),
    )


@pytest.fixture(scope="module")
def scene():
    return import_scene("place", *place(), ImportSettings())


def at(grid, x, y):
    """The cell of a point [m] counted from the mesh's corner."""
    return grid.data[int(y / R), int(x / R)]


def test_the_geometry_lies_in_the_frame_of_the_mesh(scene):
    assert scene.geometry.origin == ORIGIN and scene.geometry.data.shape == (400, 400)
    assert at(scene.geometry, 5.05, 7.0) == OCCUPIED and at(scene.geometry, 4.95, 7.0) == FREE
    assert at(scene.geometry, 30.05, 30.05) == OCCUPIED and at(scene.geometry, 30.65, 30.05) == FREE
    assert at(scene.geometry, 0.5, 20.0) == UNKNOWN  # beyond its edge
    assert at(scene.geometry, 10.0, 10.0) == UNKNOWN


def test_a_thin_wall_of_a_finer_geometry_stands():
    mesh = OccupancyGrid(np.full((50, 50), FREE, dtype=np.int8), 0.2, ORIGIN)
    fine = np.full((200, 200), FREE, dtype=np.int8)
    fine[40:160, 80] = OCCUPIED  # beside the centres of the mesh's cells
    scene = import_scene("thin", mesh, OccupancyGrid(fine, 0.05, ORIGIN), ImportSettings())
    assert (scene.geometry.data[10:40, 20] == OCCUPIED).all()
    assert (scene.geometry.data == OCCUPIED).sum() == 30


def test_resampling_takes_what_lies_at_the_centre():
    fine = OccupancyGrid(np.array([[0, 100, 50, -1]] * 3, dtype=np.int8), 0.1, Pose2D(0.3, 0.0))
    for corner, expected in (
        (0.05, [UNKNOWN, 0, 50, UNKNOWN, UNKNOWN]),
        (0.15, [UNKNOWN, 100, -1, UNKNOWN, UNKNOWN]),
    ):
        like = OccupancyGrid(np.zeros((1, 5), dtype=np.int8), 0.2, Pose2D(corner, 0.0))
        assert resampled(fine, like).data.tolist() == [expected]


def test_roads_lie_a_curb_lower_and_keep_the_margin_to_the_mesh(scene):
    ground = Elevation(scene.zones)
    level = lambda x, y: ground.level(ORIGIN.x + x, ORIGIN.y + y)  # noqa: E731
    assert level(10.0, 20.0) == level(30.0, 20.0) == -0.12
    assert level(20.0, 20.0) == 0.0  # the crossing
    # 0.3 m of pavement beyond the mesh
    assert level(10.0, 16.0 + 0.25) == 0.0 and level(10.0, 16.0 + 0.35) == -0.12
    assert level(10.0, 10.0) == level(30.3, 30.3) == 0.0  # house and bin
    assert {zone.kind for zone in scene.zones} <= {"road", "sidewalk"}


def test_walkable_is_the_pavement_up_to_curb_and_wall(scene):
    walkable, mesh = scene.walkable, scene.drawn_mesh
    assert mesh is not None and (walkable.data[mesh.data == FREE] == FREE).all()
    assert at(walkable, 10.0, 16.25) == FREE and at(walkable, 10.0, 16.35) == OCCUPIED  # curb
    # the house's wall
    assert at(walkable, 4.95, 10.0) == FREE and at(walkable, 5.05, 10.0) == OCCUPIED
    assert at(walkable, 10.0, 10.0) == OCCUPIED  # inside it
    # round the bin
    assert at(walkable, 29.9, 30.3) == FREE and at(walkable, 30.3, 30.3) == OCCUPIED


def test_what_is_occupied_stands_there(scene):
    solid = (scene.geometry.data == OCCUPIED).sum() * R * R
    assert sum(polygon_area(obstacle.polygon) for obstacle in scene.obstacles) == pytest.approx(
        solid
    )
    assert {(obstacle.kind, obstacle.height) for obstacle in scene.obstacles} == {("unknown", 1.5)}


def test_without_curbs_the_ground_is_level():
    assert import_scene("flat", *place(), ImportSettings(curb_height=0.0)).zones == ()


def test_an_island_in_a_road_is_pavement():
    mesh = OccupancyGrid(np.full((300, 300), OCCUPIED, dtype=np.int8), R, Pose2D())
    mesh.data[100:200, 100:200] = FREE
    scene = import_scene(
        "island", mesh, OccupancyGrid(np.zeros_like(mesh.data), R, Pose2D()), ImportSettings()
    )
    ground = Elevation(scene.zones)
    assert ground.level(15.0, 15.0) == ground.level(9.75, 15.0) == 0.0
    assert ground.level(9.6, 15.0) == ground.level(2.0, 2.0) == -0.12
    road = shapely.Polygon(scene.zones[0].polygon)
    assert scene.zones[0].kind == "road" and road.area == pytest.approx(900.0)


def test_the_command_makes_a_map_that_can_be_driven_on(tmp_path, capsys):
    mesh, geometry = place()
    save_map(mesh, tmp_path / "mesh.yaml")
    save_map(geometry, tmp_path / "geometry.yaml")
    command = ["--mesh", f"{tmp_path}/mesh.yaml", "--geometry", f"{tmp_path}/geometry.yaml"]
    command += ["--name", "town", "--out", str(tmp_path / "maps")]
    assert status(*command) == 0
    assert capsys.readouterr().out.strip() == str(tmp_path / "maps" / "town.yaml")
    made, loaded = (
        import_scene("town", mesh, geometry, ImportSettings()),
        load_scene(tmp_path / "maps" / "town.yaml"),
    )
    for grid in ("geometry", "walkable", "drawn_mesh"):
        assert np.array_equal(getattr(made, grid).data, getattr(loaded, grid).data)
    assert [zone.elevation for zone in loaded.zones] == [zone.elevation for zone in made.zones]
    assert len(loaded.obstacles) == len(made.obstacles)
    task = next(
        make_study(
            stacks=["parked"],
            episodes=1,
            map_name=f"{tmp_path}/maps/town.yaml",
            workers=1,
        ).tasks()
    )
    parts, generators = Parts(task), task.generators()
    observation = parts.world().reset(parts.mission(generators["mission"]), generators)
    assert observation.scan is not None
    assert status(*command) == 1 and "exists already" in capsys.readouterr().err


def test_a_mesh_within_solid_things_is_told(tmp_path, capsys):
    mesh, geometry = place()
    solid = geometry.data.copy()
    solid[60:100, 200:240] = OCCUPIED  # a kiosk of 16 m2 on the southern pavement
    save_map(mesh, tmp_path / "mesh.yaml")
    save_map(OccupancyGrid(solid, R, geometry.origin), tmp_path / "geometry.yaml")
    command = ["--mesh", f"{tmp_path}/mesh.yaml", "--geometry", f"{tmp_path}/geometry.yaml"]
    assert status(*command, "--name", "town", "--out", str(tmp_path / "maps")) == 0
    assert "note: 16.0 m2 of the mesh are solid in the geometry" in capsys.readouterr().err


def test_maps_that_do_not_belong_together_are_refused():
    mesh, geometry = place()
    far = OccupancyGrid(geometry.data, R, Pose2D(1000.0, 0.0))
    full = OccupancyGrid(np.full((40, 40), OCCUPIED, dtype=np.int8), R, ORIGIN)
    for pair in ((mesh, far), (full, geometry)):
        with pytest.raises(MapError, match="check both origins"):
            import_scene("wrong", *pair, ImportSettings())
    with pytest.raises(MapError, match="allowed are 0 to 1"):
        ImportSettings(curb_height=-0.1)


@pytest.mark.slow
@pytest.mark.skipif(not DATA, reason="NAVSTACK_DATA is not set: the published map is not there")
def test_the_published_map_has_its_blocks_and_roads(tmp_path):
    folder = Path(DATA or "") / "costnav"
    text = (
        "image: IMAGE\nresolution: 0.05\norigin: [AT, AT, 0.0]\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.2\n"
    )
    grids = []
    for image, corner in (("sidewalk_navmesh", -100.875), ("sidewalk", -100.775)):
        file = tmp_path / f"{image}.yaml"
        file.write_text(
            text.replace("IMAGE", f"{folder}/{image}.png").replace("AT", str(corner)),
            encoding="utf-8",
        )
        grids.append(file)
    out = ["--name", "costnav", "--out", str(tmp_path)]
    assert status("--mesh", str(grids[0]), "--geometry", str(grids[1]), *out) == 0
    scene = load_scene(tmp_path / "costnav.yaml")
    is_mesh = scene.navigation_mesh.data == FREE
    # [m2] as known of the published mesh
    assert is_mesh.sum() * 0.05**2 == pytest.approx(12620, abs=1.0)
    assert (scene.walkable.data[is_mesh] == FREE).mean() > 0.998
    ground = Elevation(scene.zones)
    rows, columns = np.nonzero(is_mesh)
    some = np.random.default_rng(0).integers(len(rows), size=2000)
    x, y = (
        scene.geometry.origin.x + (columns[some] + 0.5) * 0.05,
        scene.geometry.origin.y + (rows[some] + 0.5) * 0.05,
    )
    assert {ground.level(float(a), float(b)) for a, b in zip(x, y, strict=True)} == {0.0}
    road = -sum(area.area for height, area in ground._regions.items() if height < 0.0)
    assert road < -5000.0
    mission = MissionSampler(scene.navigation_mesh, "published", scene.walkable).sample(
        np.random.default_rng(1)
    )
    assert mission.shortest_path > 18.0


@pytest.mark.parametrize(("cells", "kinds"), [((2, 2), ["road"]), ((1, 3), [])])
def test_roads_of_less_than_a_square_metre_are_left_out(
    cells: tuple[int, int], kinds: list[str]
) -> None:
    road = np.zeros((8, 8), dtype=np.bool_)
    road[2 : 2 + cells[0], 3 : 3 + cells[1]] = True
    zones = _zones(road, OccupancyGrid(np.zeros((8, 8), dtype=np.int8), 0.5, Pose2D()), 0.12)
    assert [zone.kind for zone in zones] == kinds
    assert all(zone.elevation == -0.12 for zone in zones)
