"""The stacks with AMCL: what they are made of, and one drives."""

import dataclasses

import numpy as np
import pytest

from harness.episode.brains import navigator_on
from harness.episode.episode import run_episode
from harness.episode.factory import Parts
from harness.storage.shipped import shipped
from harness.task.stack import load_stack
from harness.task.study import make_study
from harness.world.map.scene import Scene
from navstack.costmap.map_io import save_map
from navstack.costmap.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from navstack.errors import ParameterError, UnknownNameError
from navstack.params.amcl import AmclParams
from navstack.params.nav2_file.file import load_nav2
from navstack.types import Pose2D

NAV2 = shipped("params") / "nav2"
PUBLISHED = {
    **{
        "laser_model_type": "likelihood_field",
        "max_beams": 360,
        "min_particles": 500,
        "max_particles": 2000,
    },
    **{
        "sigma_hit": 0.2,
        "z_hit": 0.5,
        "z_rand": 0.5,
        "z_max": 0.05,
        "z_short": 0.05,
        "lambda_short": 0.1,
    },
    **{
        "laser_likelihood_max_dist": 2.0,
        "laser_max_range": 100.0,
        "update_min_d": 0.25,
        "update_min_a": 0.2,
    },
    **{
        "resample_interval": 3,
        "pf_err": 0.05,
        "pf_z": 0.99,
        "recovery_alpha_slow": 0.0,
        "recovery_alpha_fast": 0.0,
    },
}


@pytest.mark.parametrize(
    ("name", "alphas"), [("stock", (0.2, 0.2, 0.2)), ("tuned", (0.03, 0.03, 0.05))]
)
def test_the_published_values_of_amcl(name, alphas):
    params = load_nav2(NAV2 / f"{name}.yaml", False).read(AmclParams, "amcl")
    assert {key: getattr(params, key) for key in PUBLISHED} == PUBLISHED
    assert (params.alpha1, params.alpha2, params.alpha3) == alphas
    assert params.alpha4 == params.alpha5 == alphas[2]


# node -> what the tuned file has as published, and the files of our own stacks as is better
AS_PUBLISHED = {
    ("local_costmap", "local_costmap"): ("obstacle_layer.scan.inf_is_valid",),
    ("global_costmap", "global_costmap"): ("obstacle_layer.scan.inf_is_valid",),
    ("bt_navigator",): ("default_server_timeout",),
    ("controller_server",): ("min_y_velocity_threshold",),
    ("planner_server",): ("expected_planner_frequency",),
    ("behavior_server",): ("cycle_frequency", "local_frame", "global_frame"),
}


def remove(file, nodes, name):
    """Leave a parameter out, if it is there."""
    *sections, last = name.split(".")
    for each in (*nodes, "ros__parameters", *sections):
        file = file[each]
    file.pop(last, None)


def test_the_calibrated_file_is_the_tuned_one_but_for_what_localizers_know_of_the_robot():
    tuned, calibrated, fused = (
        load_nav2(NAV2 / f"{name}.yaml", False).merged() for name in ("tuned", "amcl", "gps_ekf")
    )
    assert calibrated.pop("gps_ekf") == fused.pop("gps_ekf") != tuned.pop("gps_ekf")
    different = [f"alpha{i}" for i in range(1, 6)] + [
        f"recovery_{it}" for it in ("alpha_slow", "alpha_fast", "candidates")
    ]
    for file in (tuned, calibrated):
        for name in different:
            del file["amcl"]["ros__parameters"][name]
        for nodes, names in AS_PUBLISHED.items():
            for name in names:
                remove(file, nodes, name)
    assert tuned == calibrated


def test_amcl_may_localize_on_another_map_than_the_planners(tmp_path):
    published = load_stack("paper-amcl")
    assert (published.localizer, published.planning_map, published.localization_map) == (
        "amcl",
        "navigation_mesh",
        "",
    )
    text = (shipped("params") / "stacks" / "nav2-amcl.yaml").read_text(encoding="utf-8")
    file = tmp_path / "mixed.yaml"
    file.write_text(text + "localization_map: navigation_mesh\n", encoding="utf-8")
    assert load_stack(str(file)).localization_map == "navigation_mesh"
    file.write_text(text + "localization_map: navigation_mash\n", encoding="utf-8")
    with pytest.raises(UnknownNameError, match="did you mean 'navigation_mesh'"):
        load_stack(str(file))


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("geometry", "mapped_geometry"),
        ("navigation_mesh", "navigation_mesh"),
        ("outlined_mesh", "outlined_mesh"),
    ],
)
def test_the_localizer_gets_the_map_that_was_asked_for(monkeypatch, name, expected):
    given = []
    monkeypatch.setattr(
        "harness.episode.brains.build_localizer",
        lambda kind, nav2, static_map: given.append(static_map),
    )
    monkeypatch.setattr("harness.episode.brains.build_navigator", lambda *parts: None)
    stack = dataclasses.replace(load_stack("nav2-amcl"), localization_map=name)
    cells = np.full((9, 12), FREE, dtype=np.int8)
    cells[2:7, 3:9] = OCCUPIED
    walls, mesh = (
        OccupancyGrid(each, 0.05, Pose2D()) for each in (cells, cells[::-1, ::-1].copy())
    )
    scene = Scene("block", (), (), walls, mesh)
    navigator_on(scene, None, stack, load_nav2(NAV2 / "amcl.yaml", False))
    np.testing.assert_array_equal(given[0].data, getattr(scene, expected).data)


def test_planner_and_localizer_take_any_map_file(tmp_path, monkeypatch):
    """Each as it is drawn, in its own frame and resolution.

    A map file brings no mask of where not to go.
    """
    drawn = OccupancyGrid(np.full((6, 8), FREE, dtype=np.int8), 0.1, Pose2D(-1.0, 2.0))
    drawn.data[2:4, 3:5] = OCCUPIED
    save_map(drawn, tmp_path / "drawn.yaml")
    text = (NAV2.parent / "stacks" / "nav2-amcl.yaml").read_text(encoding="utf-8")
    file = tmp_path / "mine.yaml"
    file.write_text(
        text.replace("planning_map: geometry", "planning_map: drawn.yaml"), encoding="utf-8"
    )
    stack = load_stack(str(file))
    assert stack.planning_map == str(tmp_path / "drawn.yaml") and stack.localization_map == ""
    given, planned = [], []
    monkeypatch.setattr(
        "harness.episode.brains.build_localizer", lambda kind, nav2, grid: given.append(grid)
    )
    monkeypatch.setattr(
        "harness.episode.brains.build_navigator", lambda nav2, how, *parts: planned.append(parts)
    )
    empty = OccupancyGrid(np.full((9, 12), FREE, dtype=np.int8), 0.05, Pose2D())
    scene = Scene("empty", (), (), empty, empty)
    navigator_on(scene, None, stack, load_nav2(NAV2 / "amcl.yaml", False))
    outlined = dataclasses.replace(
        stack, planning_map="geometry", localization_map=str(tmp_path / "drawn.yaml")
    )
    navigator_on(scene, None, outlined, load_nav2(NAV2 / "amcl.yaml", False))
    for grid in (*given, planned[0][0]):
        assert (grid.resolution, grid.origin) == (0.1, Pose2D(-1.0, 2.0))
        np.testing.assert_array_equal(grid.data, drawn.data)
    assert planned[0][1] is None and planned[1][1] is not None
    file.write_text(text + "localization_map: gone.yaml\n", encoding="utf-8")
    with pytest.raises(
        ParameterError, match=r"gone.yaml is not there; give a map_server YAML file, or one"
    ):
        load_stack(str(file))


def test_a_lidar_maps_surfaces_only(tmp_path, monkeypatch):
    monkeypatch.setenv("NAVSTACK_CACHE", str(tmp_path))
    cells = np.full((9, 12), FREE, dtype=np.int8)
    cells[2:7, 3:9] = OCCUPIED
    cells[0, 0] = OCCUPIED
    grid = OccupancyGrid(cells, 0.05, Pose2D())
    mapped = Scene("block", (), (), grid, grid).mapped_geometry
    expected = cells.copy()
    expected[3:6, 4:8] = UNKNOWN
    np.testing.assert_array_equal(mapped.data, expected)
    assert mapped.resolution == grid.resolution
    scene = Scene("road", (), (), OccupancyGrid(np.full_like(cells, FREE), 0.05, Pose2D()), grid)
    np.testing.assert_array_equal(scene.outlined_mesh.data, expected)


@pytest.mark.slow
@pytest.mark.parametrize("stack", ["nav2-amcl", "nav2-amcl-gps"])
def test_a_delivery_with_amcl(stack):
    tasks = make_study(stacks=[stack], episodes=100, pedestrians=0).tasks()
    task = next(
        task
        for task in tasks
        if Parts(task).mission(task.generators()["mission"]).shortest_path < 30.0
    )
    row = run_episode(task).row
    assert row["reason"] == "arrived"
    assert row["localization_error_median_m"] < 0.15
    assert 0.0 < row["localization_error_max_m"] < 0.6
    assert run_episode(task).row == row
