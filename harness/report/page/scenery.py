"""A map as a page draws it: polygons in centimetres, or else a small picture."""

import base64
import io
from collections.abc import Sequence
from typing import Any

import numpy as np

from harness.report.page.entries import PageEntry
from harness.report.page.origin import Place
from harness.study.manifest import map_digest
from harness.study.stored_run import StoredRun
from harness.world.map.scene import Scene
from harness.world.map.scene_io import load_scene
from navstack.costmap.occupancy_grid import FREE, SOLID_FROM
from navstack.errors import InputError, NavstackError
from navstack.types import FloatArray

Json = dict[str, Any]

MOST_OBSTACLES = 5000  # drawn as polygons; beyond that as cells
LARGEST_PICTURE = 1500  # [pixel] along a side
GROUND, WALKABLE, SOLID = 0, 1, 2  # what a pixel shows


def sceneries(entries: Sequence[PageEntry]) -> tuple[Json, list[str]]:
    """Every map of a page once, by its label; whose data they are, and why others are not drawn."""
    drawn: Json = {}
    troubles: list[tuple[str, str]] = []
    credits: list[str] = []
    for entry in {entry.run.folder: entry for entry in entries}.values():
        if entry.map_label in drawn:
            continue
        try:
            scene = scene_of_run(entry.run)
            drawn[entry.map_label] = draw(scene, entry.origin)
            if scene.credit:
                credits.append(f"map {scene.name}: {scene.credit}")
        except NavstackError as error:
            note = f"the map of {entry.run.folder.resolve().name} is not drawn: {error}"
            troubles.append((entry.map_label, note))
    return drawn, [*credits, *(note for label, note in troubles if label not in drawn)]


def scene_of_run(run: StoredRun) -> Scene:
    """The map on which a run was driven.

    Raises:
        NavstackError: it cannot be read, or has changed since.
    """
    scene = load_scene(str(run.about["map_name"]))
    if map_digest(scene) != run.about.get("map_sha256"):
        raise InputError(
            f"map '{run.map_name}' has changed since the run; restore it, or make the run again"
        )
    return scene


def known_scene(run: StoredRun) -> Scene | None:
    """The map on which a run was driven; None: it is gone or has changed since."""
    try:
        return scene_of_run(run)
    except NavstackError:
        return None


def draw(scene: Scene, origin: Place) -> Json:
    """What a page that counts from an origin needs to draw a scene."""
    grid = scene.geometry
    x0, y0 = grid.origin.x - origin[0], grid.origin.y - origin[1]
    bounds = [x0, y0, x0 + grid.width * grid.resolution, y0 + grid.height * grid.resolution]
    obstacles: list[list[Any]] = []
    has_polygons = len(scene.obstacles) <= MOST_OBSTACLES
    if has_polygons:
        obstacles = [[each.kind, _corners(each.polygon, origin)] for each in scene.obstacles]
    picture = None
    if not scene.zones or not has_polygons:
        picture = _picture(scene, origin, with_obstacles=not has_polygons)
    return {
        "bounds": [round(edge, 3) for edge in bounds],
        "zones": [[zone.kind, _corners(zone.polygon, origin)] for zone in scene.zones],
        "obstacles": obstacles,
        "picture": picture,
    }


def _corners(polygon: FloatArray, origin: Place) -> list[int]:
    """Coordinates in turn [cm]: x, y, x, y, ..."""
    corners: list[int] = np.rint(100.0 * (polygon - origin)).astype(np.int64).ravel().tolist()
    return corners


def _picture(scene: Scene, origin: Place, with_obstacles: bool) -> Json:
    """Walkable and solid cells as a PNG, north up."""
    from PIL import Image

    cells = np.where(scene.walkable.data == FREE, WALKABLE, GROUND).astype(np.uint8)
    if with_obstacles:
        cells[scene.geometry.data >= SOLID_FROM] = SOLID
    step = max(1, -(-max(cells.shape) // LARGEST_PICTURE))
    height, width = (side // step * step for side in cells.shape)
    blocks = cells[:height, :width].reshape(height // step, step, width // step, step)
    image = Image.fromarray(blocks.max(axis=(1, 3))[::-1].copy(), mode="P")
    image.putpalette((211, 213, 216, 246, 243, 234, 143, 154, 168))
    stream = io.BytesIO()
    image.save(stream, "PNG", optimize=True)
    grid = scene.geometry
    x0, y0 = grid.origin.x - origin[0], grid.origin.y - origin[1]
    size = (width * grid.resolution, height * grid.resolution)
    return {
        "png": base64.b64encode(stream.getvalue()).decode(),
        "bounds": [x0, y0, x0 + size[0], y0 + size[1]],
    }
