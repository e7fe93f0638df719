"""Scenes on disk: two map_server maps and the typed objects as GeoJSON.

``NAME.yaml`` + ``NAME.png``: the geometry, a map that Nav2's map_server reads.
``NAME_walkable.yaml`` + ``NAME_walkable.png``: where people and robot may be, in the same frame.
``NAME.geojson``: obstacles and zones, coordinates in metres in the map frame.
Only the first is needed: a user's own map becomes a scene with obstacles raised from its occupied cells.
"""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from harness import resources
from harness.world.extrude import extrude
from harness.world.scene import Obstacle, Scene, Zone
from navstack.costmap.map_io import load_map, save_map
from navstack.costmap.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from navstack.errors import MapError, UnknownNameError
from navstack.types import FloatArray, Pose2D

SOLID_FROM = 65  # [%] occupancy from which a cell of a user's map is an obstacle (map_server's occupied_thresh)
FREE_BELOW = 20  # [%] occupancy below which it is walkable (map_server's free_thresh)
_WALKABLE = "_walkable"


def map_names() -> list[str]:
    """The maps that come with the program."""
    return [name for name in resources.names(resources.shipped("maps")) if not name.endswith(_WALKABLE)]


def load_scene(name_or_path: str | Path) -> Scene:
    """Read a shipped map by its name, or any map_server YAML file by its path.

    Raises:
        UnknownNameError: no shipped map has this name.
        MapError: a file is missing or cannot be used.
    """
    path = _resolve(str(name_or_path))
    geometry = align(load_map(path))
    walkable_path = path.with_name(f"{path.stem}{_WALKABLE}.yaml")
    if walkable_path.is_file():
        walkable = align(load_map(walkable_path))
        if walkable.data.shape != geometry.data.shape or walkable.origin != geometry.origin:
            raise MapError(f"map {walkable_path}: its size or origin differs from {path.name}; both must be the same")
    else:
        is_free = (geometry.data >= FREE) & (geometry.data < FREE_BELOW)
        data = np.where(is_free, FREE, OCCUPIED).astype(np.int8)
        walkable = OccupancyGrid(data, geometry.resolution, geometry.origin)
    objects_path = path.with_suffix(".geojson")
    if objects_path.is_file():
        obstacles, zones = _load_objects(objects_path)
    else:
        obstacles, zones = extrude(geometry, geometry.data >= SOLID_FROM), ()
    return Scene(path.stem, obstacles, zones, geometry, walkable)


def save_scene(scene: Scene, folder: Path, name: str) -> None:
    """Write a scene's files into a folder.

    Raises:
        MapError: the folder cannot be written.
    """
    path = Path(folder) / f"{name}.yaml"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.with_suffix(".geojson").write_text(_objects_text(scene), encoding="utf-8")
    except OSError as error:
        raise MapError(f"map folder {folder}: cannot be written ({error.strerror})") from None
    save_map(scene.geometry, path, image_format="png")
    save_map(scene.walkable, path.with_name(f"{name}{_WALKABLE}.yaml"), image_format="png")


def align(grid: OccupancyGrid) -> OccupancyGrid:
    """The same map with its axes parallel to the frame's, by the nearest cell; what lies outside is unknown.

    (Nav2's costmaps ignore a yaw in a map's origin instead.)
    """
    yaw, r = grid.origin.yaw, grid.resolution
    if yaw == 0.0:
        return grid
    cos, sin = math.cos(yaw), math.sin(yaw)
    corners = np.array(((0, 0), (grid.width, 0), (grid.width, grid.height), (0, grid.height))) * r
    turned = corners @ np.array(((cos, sin), (-sin, cos)))
    low, high = turned.min(axis=0), turned.max(axis=0)
    width, height = (max(math.ceil(extent / r - 1e-9), 1) for extent in high - low)
    x = low[0] + (np.arange(width) + 0.5) * r
    y = (low[1] + (np.arange(height) + 0.5) * r)[:, None]
    columns = np.floor((cos * x + sin * y) / r).astype(np.int64)
    rows = np.floor((-sin * x + cos * y) / r).astype(np.int64)
    inside = (columns >= 0) & (columns < grid.width) & (rows >= 0) & (rows < grid.height)
    data = np.full((height, width), UNKNOWN, dtype=np.int8)
    data[inside] = grid.data[rows[inside], columns[inside]]
    return OccupancyGrid(data, r, Pose2D(grid.origin.x + float(low[0]), grid.origin.y + float(low[1]), 0.0))


def _resolve(name_or_path: str) -> Path:
    given = Path(name_or_path)
    if given.suffix in (".yaml", ".yml") or len(given.parts) > 1:
        return given
    if name_or_path not in map_names():
        raise UnknownNameError("map", name_or_path, map_names())
    return resources.shipped("maps") / f"{name_or_path}.yaml"


def _objects_text(scene: Scene) -> str:
    features = [_feature("zone", zone.kind, zone.polygon, {}) for zone in scene.zones]
    features += [
        _feature("obstacle", obstacle.kind, obstacle.polygon, {"height": obstacle.height})
        for obstacle in scene.obstacles
    ]
    lines = ",\n".join(json.dumps(feature, separators=(",", ":")) for feature in features)
    return f'{{"type":"FeatureCollection","coordinates":"metres in the map frame","features":[\n{lines}\n]}}\n'


def _feature(role: str, kind: str, polygon: FloatArray, more: dict[str, float]) -> dict[str, Any]:
    ring = [*polygon.tolist(), polygon[0].tolist()]
    geometry = {"type": "Polygon", "coordinates": [ring]}
    return {"type": "Feature", "properties": {"role": role, "kind": kind, **more}, "geometry": geometry}


def _load_objects(path: Path) -> tuple[tuple[Obstacle, ...], tuple[Zone, ...]]:
    try:
        features = json.loads(path.read_text(encoding="utf-8"))["features"]
        obstacles: list[Obstacle] = []
        zones: list[Zone] = []
        for number, feature in enumerate(features):
            properties = feature["properties"]
            where = f"{path}: feature {number}"
            if properties["role"] == "zone":
                zones.append(Zone(str(properties["kind"]), _ring(_polygon(feature, where))))
            else:
                obstacles += _obstacles(feature, where)
        return tuple(obstacles), tuple(zones)
    except OSError as error:
        raise MapError(f"{path}: cannot be read ({error.strerror})") from None
    except (KeyError, TypeError, ValueError) as error:
        raise MapError(f"{path}: is not a GeoJSON of obstacles and zones ({type(error).__name__}: {error})") from None


def _polygon(feature: dict[str, Any], where: str) -> shapely.Polygon:
    polygon = shapely.Polygon(feature["geometry"]["coordinates"][0])
    if feature["geometry"]["type"] != "Polygon" or not polygon.is_valid or not np.isfinite(polygon.area):
        raise MapError(f"{where}: is not a valid polygon of at least three points in metres")
    return polygon


def _obstacles(feature: dict[str, Any], where: str) -> list[Obstacle]:
    """The convex pieces of a polygon: itself, or its constrained Delaunay triangles."""
    kind, height = str(feature["properties"]["kind"]), float(feature["properties"]["height"])
    if not 0.0 < height < math.inf:
        raise MapError(f"{where}: height {height} m is not positive")
    polygon = _polygon(feature, where)
    is_convex = polygon.convex_hull.area - polygon.area <= 1e-6 * polygon.area
    pieces = [polygon] if is_convex else shapely.constrained_delaunay_triangles(polygon).geoms
    return [Obstacle(kind, _ring(piece), height) for piece in pieces]


def _ring(polygon: shapely.Polygon) -> FloatArray:
    """The corners (N, 2), counter-clockwise, the first not repeated."""
    ring = np.array(polygon.exterior.coords)[:-1, :2]
    return ring if polygon.exterior.is_ccw else ring[::-1].copy()
