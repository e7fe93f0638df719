"""The sidewalk world: a seeded city of 200 m x 200 m in the likeness of the paper's.

The paper's own world is not free; what is known of it (area, widths of the ways, sizes and spacing of the furniture)
is what this generator aims at. Curbs are no obstacles; every obstacle is a prism.
"""

from pathlib import Path

import numpy as np
from scipy import ndimage

from harness.world.scene import Obstacle, Scene, Zone
from harness.world.scene_io import save_scene
from harness.world.shapes import fill_convex
from harness.world.sidewalk_blocks import HALF_SIZE, lay_out
from harness.world.sidewalk_furniture import Furnisher
from navstack.costmap.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from navstack.types import BoolArray, Pose2D

RESOLUTION = 0.05  # [m/cell]
LIDAR_LOWER_EDGE = 0.7  # [m] above the ground; the scan has nothing from below it (paper's lidar)
WALKABLE_KINDS = ("sidewalk", "crosswalk", "plaza")


def generate(seed: int = 0) -> Scene:
    """Build a world; the same seed gives the same world, bit for bit."""
    rng = np.random.default_rng(seed)
    streets = lay_out(rng)
    furniture = Furnisher(streets, rng).furnish()
    obstacles = (*streets.buildings, *furniture)
    zones = streets.zones()
    solid = rasterise(obstacles)
    walkable = _largest_part(_walkable_ground(zones) & ~solid)
    visible = rasterise(tuple(obstacle for obstacle in obstacles if obstacle.height >= LIDAR_LOWER_EDGE))
    return Scene("sidewalk", obstacles, zones, _grid(visible), _grid(~walkable))


def write(seed: int, folder: Path, name: str = "sidewalk") -> Scene:
    """Generate a world and save it as a map; see :func:`harness.world.scene_io.save_scene` for the files."""
    scene = generate(seed)
    save_scene(scene, folder, name)
    return scene


def rasterise(obstacles: tuple[Obstacle, ...]) -> BoolArray:
    """The cells of the world (H, W) whose centres lie in an obstacle; row 0 = lowest y."""
    mask = _empty()
    for obstacle in obstacles:
        fill_convex(mask, obstacle.polygon, True, RESOLUTION, -HALF_SIZE, -HALF_SIZE)
    return mask


def _walkable_ground(zones: tuple[Zone, ...]) -> BoolArray:
    mask = _empty()
    for zone in zones:
        fill_convex(mask, zone.polygon, zone.kind in WALKABLE_KINDS, RESOLUTION, -HALF_SIZE, -HALF_SIZE)
    return mask


def _largest_part(mask: BoolArray) -> BoolArray:
    """Its largest 4-connected part: corners of the map that nobody can walk to are not walkable."""
    labels, _ = ndimage.label(mask)
    return labels == 1 + int(np.argmax(np.bincount(labels.ravel())[1:]))


def _empty() -> BoolArray:
    cells = round(2.0 * HALF_SIZE / RESOLUTION)
    return np.zeros((cells, cells), dtype=bool)


def _grid(occupied: BoolArray) -> OccupancyGrid:
    data = np.where(occupied, OCCUPIED, FREE).astype(np.int8)
    return OccupancyGrid(data, RESOLUTION, Pose2D(-HALF_SIZE, -HALF_SIZE, 0.0))
