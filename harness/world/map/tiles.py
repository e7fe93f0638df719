"""A part of a district that is kept in tiles: maps of one resolution side by side in one frame."""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pyarrow as pa
from scipy import ndimage

from harness.execution.process_cache import kept
from harness.world.map.scene import Obstacle, Scene, Zone
from harness.world.map.scene_io import load_scene, made_of
from harness.world.map.shapes import Rect
from harness.world.map.sidewalk import largest_part, without_slivers
from navstack.costmap.map_image import MAX_PIXELS, image_size
from navstack.costmap.map_io import load_metadata
from navstack.costmap.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from navstack.errors import MapError
from navstack.types import BoolArray, FloatArray, Pose2D

Cells = npt.NDArray[np.int8]
_CODEC = "lz4"  # unpacks much faster than an image is read


class _PackedGrid:
    """A grid whose cells are compressed."""

    def __init__(self, grid: OccupancyGrid) -> None:
        """Pack its cells."""
        self.resolution, self.origin = grid.resolution, grid.origin
        self._shape = grid.data.shape
        self._cells: bytes = pa.compress(grid.data.tobytes(), codec=_CODEC, asbytes=True)

    def unpack(self) -> OccupancyGrid:
        """The grid as it was; its cells cannot be written to."""
        cells = pa.decompress(self._cells, math.prod(self._shape), codec=_CODEC)
        data = np.frombuffer(cells, dtype=np.int8).reshape(self._shape)
        return OccupancyGrid(data, self.resolution, self.origin)


@dataclass(frozen=True, slots=True, eq=False)
class _Tile:
    """A tile's scene, small enough for those of a whole district to be kept."""

    obstacles: tuple[Obstacle, ...]
    zones: tuple[Zone, ...]
    geometry: _PackedGrid
    walkable: _PackedGrid
    credit: str
    is_ground_given: bool


def load_part(folder: Path, name: str, window: Rect, at: tuple[float, float]) -> Scene:
    """The part of a district in a window.

    Args:
        folder: of the tiles.
        name: of the district: its map is NAME.yaml, or its tiles are NAME_column_row.yaml.
        window: [m] map frame; it is widened to whole cells.
        at: x, y [m] of a place whose connected ground is the navigation mesh.

    Raises:
        MapError: no tile is there, or the window is larger than a map may be.
    """
    tiles = _tiles_of(folder, name)
    near = [_tile(path) for path, box in tiles if window.overlaps(box)]
    if not near:
        raise MapError(
            f"{folder}: no map of {name} is at ({at[0]:.0f}, {at[1]:.0f}) m, where its "
            "graph leads; make the folder again with navbench map osm"
        )
    r = near[0].geometry.resolution
    column, row = math.floor(window.x0 / r), math.floor(window.y0 / r)
    width, height = math.ceil(window.x1 / r) - column, math.ceil(window.y1 / r) - row
    if width * height > MAX_PIXELS:
        raise MapError(
            f"{folder}: a part of {width} x {height} cells is needed at once; at most {MAX_PIXELS}"
        )
    is_ground_given = all(tile.is_ground_given for tile in near)
    # where no tile is; without a given ground nothing else keeps the robot out of there
    beyond = FREE if is_ground_given else OCCUPIED
    solid = np.full((height, width), beyond, dtype=np.int8)
    closed = np.full((height, width), OCCUPIED, dtype=np.int8)
    for tile in near:
        _paste(solid, tile.geometry.unpack(), column, row)
        _paste(closed, tile.walkable.unpack(), column, row)
    mesh = _part_at(
        without_slivers(closed == FREE, r),
        math.floor(at[1] / r) - row,
        math.floor(at[0] / r) - column,
    )
    corner = Pose2D(column * r, row * r, 0.0)
    obstacles = {
        (each.kind, each.polygon.tobytes()): each
        for tile in near
        for each in tile.obstacles
        if window.overlaps(_box_of(each.polygon))
    }
    zones = [zone for tile in near for zone in tile.zones]
    return Scene(
        name,
        tuple(obstacles.values()),
        tuple(zone for zone in zones if window.overlaps(_box_of(zone.polygon))),
        OccupancyGrid(solid, r, corner),
        OccupancyGrid(closed, r, corner),
        OccupancyGrid(np.where(mesh, np.int8(FREE), np.int8(OCCUPIED)), r, corner),
        near[0].credit,
        is_ground_given,
    )


@kept(200)
def _tile(path: Path) -> _Tile:
    """A tile: the next leg needs most of those that this one needs; later missions come back."""
    scene = load_scene(path, with_mesh=False)
    return _Tile(
        scene.obstacles,
        scene.zones,
        _PackedGrid(scene.geometry),
        _PackedGrid(scene.walkable),
        scene.credit,
        scene.is_ground_given,
    )


@kept(2)
def _tiles_of(folder: Path, name: str) -> list[tuple[Path, Rect]]:
    """The tiles of a district, and where they lie [m]."""
    parts, found = made_of("")[1:], []
    for path in sorted([*folder.glob(f"{name}.yaml"), *folder.glob(f"{name}_*_*.yaml")]):
        if path.stem.endswith(parts):
            continue
        about = load_metadata(path)
        width, height = image_size(about.image)
        x, y, r = about.origin.x, about.origin.y, about.resolution
        found.append((path, Rect(x, y, x + width * r, y + height * r)))
    return found


def _box_of(polygon: FloatArray) -> Rect:
    """The box [m] around a polygon (N, 2)."""
    low, high = polygon.min(axis=0).tolist(), polygon.max(axis=0).tolist()
    return Rect(*low, *high)


def _paste(target: Cells, grid: OccupancyGrid, column: int, row: int) -> None:
    """Copy what of a grid lies in a target whose first cell is ``(row, column)`` of the frame."""
    left = round(grid.origin.x / grid.resolution) - column
    bottom = round(grid.origin.y / grid.resolution) - row
    height, width = target.shape
    x0, x1 = max(left, 0), min(left + grid.width, width)
    y0, y1 = max(bottom, 0), min(bottom + grid.height, height)
    target[y0:y1, x0:x1] = grid.data[y0 - bottom : y1 - bottom, x0 - left : x1 - left]


def _part_at(mask: BoolArray, row: int, column: int) -> BoolArray:
    """The connected part of a mask at a cell; where that is not set, the largest one."""
    labels, _ = ndimage.label(mask)
    number = int(labels[row, column])
    if number == 0:
        return largest_part(mask)
    part: BoolArray = labels == number
    return part
