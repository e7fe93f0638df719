"""The picture of a map shows what stands where."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

from harness.report.map_picture import VIEWS, draw_map, draw_scene
from harness.world.map.scene import Obstacle, Scene, Zone
from harness.world.map.shapes import Rect, box
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.errors import InputError
from navstack.types import Pose2D


def scene(with_zones: bool) -> Scene:
    grid = OccupancyGrid(np.zeros((100, 200), dtype=np.int8), 0.1, Pose2D(0.0, 0.0))
    zones = (
        Zone("road", Rect(0, 0, 20, 10).polygon),
        Zone("crosswalk", Rect(8, 0, 11, 10).polygon),
    )
    obstacles = (
        Obstacle("building_glass", Rect(0, 6, 6, 10).polygon, 9.0),
        Obstacle("mailbox", box(15.0, 5.0, 0.0, 3.0, 3.0), 1.3),
        Obstacle("statue", box(3.0, 2.0, 0.0, 1.0, 1.0), 2.0),
    )
    return Scene("test", obstacles, zones if with_zones else (), grid, grid)


def colour_at(x: float, y: float, with_zones: bool, folder: Path) -> tuple[int, ...]:
    figure = Figure(figsize=(8, 4), dpi=50)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    draw_scene(axes, scene(with_zones))
    figure.savefig(folder / "axes.png")
    pixels = np.asarray(Image.open(folder / "axes.png").convert("RGB"))
    return tuple(int(value) for value in pixels[int((10 - y) * 20), int(x * 20)])


def test_things_are_where_they_belong(tmp_path: Path) -> None:
    assert colour_at(3.0, 8.0, True, tmp_path) == (0xAA, 0xB4, 0xC0)  # building
    assert colour_at(15.0, 5.0, True, tmp_path) == (0x1F, 0x5F, 0xA8)  # mailbox
    assert colour_at(18.0, 9.0, True, tmp_path) == (0xD3, 0xD5, 0xD8)  # road
    # walkable, when zones are not known
    assert colour_at(18.0, 9.0, False, tmp_path) == (0xF6, 0xF3, 0xEA)


def test_a_picture_is_written_as_wide_as_asked(tmp_path: Path) -> None:
    for with_zones in (True, False):
        draw_map(scene(with_zones), tmp_path / "map.png", width_px=800)
        assert Image.open(tmp_path / "map.png").size[0] == 800


def test_a_view_colours_its_cells_and_a_picture_needs_a_folder(tmp_path: Path) -> None:
    seen = {}
    for view in VIEWS:
        draw_map(scene(True), tmp_path / f"{view}.png", width_px=800, view=view)
        seen[view] = np.asarray(Image.open(tmp_path / f"{view}.png").convert("RGB")).astype(int)
    # Everything is walkable here: the mesh tints the ground, and there is nothing to keep out of.
    middle = np.s_[150:160, 300:310]
    assert seen["navmesh"][middle][..., 2].mean() > seen["navmesh"][middle][..., 0].mean() + 20
    assert np.array_equal(seen["keepout"][middle], seen["zones"][middle])
    for name, told in (
        ("nowhere/map.png", r"\(No such file or dir"),
        ("map.nonsense", "supported"),
    ):
        with pytest.raises(InputError, match=f"cannot be written.*{told}"):
            draw_map(scene(True), tmp_path / name)
