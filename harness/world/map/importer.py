"""A scene from two pictures of a place: its navigation mesh and what stands there."""

from dataclasses import dataclass

import numpy as np
import shapely
from scipy.ndimage import distance_transform_edt, label

from harness.world.map.extrude import extrude, merge_rectangles
from harness.world.map.geojson import MAX_OBJECTS
from harness.world.map.scene import Scene, Zone
from navstack.costmap.occupancy_grid import (
    FREE,
    OCCUPIED,
    SOLID_FROM,
    UNKNOWN,
    OccupancyGrid,
    align,
)
from navstack.errors import MapError
from navstack.types import BoolArray, FloatArray, IntArray

# [m2] of ground off the mesh that can be a road or a house; smaller gaps are furniture
_LEAST_AREA = 12.0
_OPEN = 0.8  # [-] share of it that the geometry must show free, for it to be a road
_SMOOTHING = 0.1  # [m] by which the outline of a road may leave its cells
_SLIVER = 1.0  # [m2] roads and islands smaller than this are left out


@dataclass(frozen=True, slots=True)
class ImportSettings:
    """What two pictures do not tell."""

    curb_height: float = 0.12  # [m] from the road up to the pavement; 0: the ground is level
    margin: float = 0.3  # [m] of pavement beyond the mesh, which is drawn within it

    def __post_init__(self) -> None:
        """Check what the types cannot.

        Raises:
            MapError: a value out of range.
        """
        if not 0.0 <= self.curb_height <= 1.0 or not 0.0 <= self.margin <= 10.0:
            raise MapError(
                f"map import: curb height {self.curb_height} m, margin {self.margin} m; allowed "
                "are 0 to 1, 0 to 10"
            )


def import_scene(
    name: str,
    mesh: OccupancyGrid,
    geometry: OccupancyGrid,
    settings: ImportSettings,
) -> Scene:
    """The scene that two maps of one place show, on the grid of the mesh.

    Ground off the mesh is a road if the geometry shows most of it free, else a house; small gaps
    are furniture. What is occupied in the geometry stands there as an obstacle of kind 'unknown',
    1.5 m high. What lies beyond the geometry's edge is unknown.

    Args:
        name: of the scene.
        mesh: free where people walk and missions are drawn.
        geometry: occupied where a lidar hits something; its own size, resolution and place in the
            same map frame.
        settings: what the maps do not tell.

    Raises:
        MapError: nothing is free in the mesh, the maps do not overlap, or there are too many
            obstacles.
    """
    mesh = align(mesh)
    geometry = align(geometry)
    seen = resampled(geometry, mesh)
    _mark_thin(seen, geometry)
    is_mesh = (mesh.data >= FREE) & (mesh.data < SOLID_FROM)
    if not is_mesh.any() or not (seen.data != UNKNOWN)[is_mesh].any():
        raise MapError(
            "map import: the mesh has no free cell, or lies outside of the geometry; check both "
            "origins"
        )
    road, house = _off_mesh(is_mesh, seen.data == FREE, mesh.resolution)
    beyond = distance_transform_edt(~is_mesh) * mesh.resolution > settings.margin + 1e-9
    road, house = road & beyond, house & beyond
    solid = seen.data >= SOLID_FROM
    is_walkable = (is_mesh | (seen.data == FREE)) & ~road & ~house & ~solid
    obstacles = extrude(seen, solid)
    zones: tuple[Zone, ...] = ()
    if settings.curb_height:
        zones = _zones(road, mesh, settings.curb_height)
    if len(obstacles) + len(zones) > MAX_OBJECTS:
        raise MapError(
            f"map import: {len(obstacles)} obstacles and {len(zones)} zones; at most "
            f"{MAX_OBJECTS}: use a coarser geometry, or one without speckles"
        )
    return Scene(name, obstacles, zones, seen, _drawn(is_walkable, mesh), _drawn(is_mesh, mesh))


def resampled(grid: OccupancyGrid, like: OccupancyGrid) -> OccupancyGrid:
    """An axis-aligned map on the cells of another one.

    Each is what lies at its centre, or unknown.
    """
    columns = _indices(like.origin.x - grid.origin.x, like.width, like.resolution, grid.resolution)
    rows = _indices(like.origin.y - grid.origin.y, like.height, like.resolution, grid.resolution)
    known_columns = np.flatnonzero((columns >= 0) & (columns < grid.width))
    known_rows = np.flatnonzero((rows >= 0) & (rows < grid.height))
    source = np.ix_(rows[known_rows], columns[known_columns])
    data = np.full((like.height, like.width), UNKNOWN, dtype=np.int8)
    data[np.ix_(known_rows, known_columns)] = grid.data[source]
    return OccupancyGrid(data, like.resolution, like.origin)


def _mark_thin(seen: OccupancyGrid, geometry: OccupancyGrid) -> None:
    """Occupy the cells in which a finer map has anything solid, which may lie beside the centre."""
    if geometry.resolution >= seen.resolution:
        return
    rows, columns = np.nonzero(geometry.data >= SOLID_FROM)
    size, origin = geometry.resolution, geometry.origin
    x = origin.x + (columns + 0.5) * size - seen.origin.x
    y = origin.y + (rows + 0.5) * size - seen.origin.y
    row, column = (np.floor(each / seen.resolution).astype(np.int64) for each in (y, x))
    inside = (row >= 0) & (row < seen.height) & (column >= 0) & (column < seen.width)
    seen.data[row[inside], column[inside]] = OCCUPIED


def _indices(offset: float, count: int, step: float, resolution: float) -> IntArray:
    """Cells in which ``count`` centres lie, ``step`` [m] apart from ``offset`` [m] on."""
    centres = offset + (np.arange(count) + 0.5) * step
    cells: IntArray = np.floor(centres / resolution).astype(np.int64)
    return cells


def _off_mesh(
    is_mesh: BoolArray,
    is_open: BoolArray,
    resolution: float,
) -> tuple[BoolArray, BoolArray]:
    """Which cells off the mesh (H, W) belong to roads, and which to houses."""
    parts, number = label(~is_mesh)
    sizes = np.bincount(parts.ravel(), minlength=number + 1)
    open_cells = np.bincount(parts.ravel(), weights=is_open.ravel(), minlength=number + 1)
    is_large = sizes * resolution**2 >= _LEAST_AREA
    is_road = is_large & (open_cells > _OPEN * sizes)
    is_road[0] = is_large[0] = False  # the mesh
    return is_road[parts], (is_large & ~is_road)[parts]


def _drawn(is_free: BoolArray, like: OccupancyGrid) -> OccupancyGrid:
    return OccupancyGrid(
        np.where(is_free, np.int8(FREE), np.int8(OCCUPIED)), like.resolution, like.origin
    )


def _zones(road: BoolArray, grid: OccupancyGrid, curb_height: float) -> tuple[Zone, ...]:
    """Roads below the pavement, and the islands in them.

    Larger ones first, as the later zone counts.
    """
    x0, y0, r = grid.origin.x, grid.origin.y, grid.resolution
    rows, columns, end_rows, end_columns = merge_rectangles(np.ascontiguousarray(road)).T
    cells = shapely.box(x0 + columns * r, y0 + rows * r, x0 + end_columns * r, y0 + end_rows * r)
    outline = shapely.simplify(shapely.union_all(cells), _SMOOTHING)
    rings: list[tuple[str, shapely.Polygon, float]] = []
    for part in shapely.get_parts(outline):
        rings.append(("road", shapely.Polygon(part.exterior), -curb_height))
        rings += [("sidewalk", shapely.Polygon(hole), 0.0) for hole in part.interiors]
    rings.sort(key=lambda ring: -ring[1].area)
    return tuple(
        Zone(kind, _corners(polygon), height)
        for kind, polygon, height in rings
        if polygon.area >= _SLIVER
    )


def _corners(polygon: shapely.Polygon) -> FloatArray:
    corners: FloatArray = shapely.get_coordinates(shapely.orient_polygons(polygon))[:-1].copy()
    return corners
