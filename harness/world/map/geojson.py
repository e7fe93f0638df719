"""Obstacles and zones as GeoJSON: coordinates in metres in the map frame."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from harness.world.map.scene import Obstacle, Scene, Zone
from navstack.errors import MapError
from navstack.files import check_regular
from navstack.types import FloatArray

MAX_OBJECTS_BYTES = 20_000_000  # of a GeoJSON file; the shipped ones have 0.1 MB
MAX_OBJECTS, MAX_CORNERS = 20_000, 10_000  # in a file, of a polygon
HIGHEST, FARTHEST = 1000.0, 1e8  # [m] of heights and elevations, of coordinates


def objects_text(scene: Scene) -> str:
    """The obstacles and zones of a scene as GeoJSON."""
    features = [
        _feature("zone", zone.kind, zone.polygon, {"elevation": zone.elevation})
        for zone in scene.zones
    ]
    features += [
        _feature("obstacle", obstacle.kind, obstacle.polygon, {"height": obstacle.height})
        for obstacle in scene.obstacles
    ]
    lines = ",\n".join(json.dumps(feature, separators=(",", ":")) for feature in features)
    about = '"type":"FeatureCollection","coordinates":"metres in the map frame"'
    if scene.credit:
        about += f',"attribution":{json.dumps(scene.credit)}'
    return f'{{{about},"features":[\n{lines}\n]}}\n'


def _feature(role: str, kind: str, polygon: FloatArray, more: dict[str, float]) -> dict[str, Any]:
    ring = [*polygon.tolist(), polygon[0].tolist()]
    geometry = {"type": "Polygon", "coordinates": [ring]}
    return {
        "type": "Feature",
        "properties": {"role": role, "kind": kind, **more},
        "geometry": geometry,
    }


def load_objects(path: Path) -> tuple[tuple[Obstacle, ...], tuple[Zone, ...], str]:
    """The obstacles and zones of a file, and the credit that its data ask for.

    Raises:
        MapError: it cannot be read, or holds something else.
    """
    try:
        check_regular(path, MAX_OBJECTS_BYTES)
        content = json.loads(path.read_text(encoding="utf-8"))
        features = content["features"]
        if len(features) > MAX_OBJECTS:
            raise MapError(f"{path}: {len(features)} features; at most {MAX_OBJECTS} are read")
        obstacles: list[Obstacle] = []
        zones: list[Zone] = []
        for number, feature in enumerate(features):
            properties = feature["properties"]
            where = f"{path}: feature {number}"
            if properties["role"] not in ("zone", "obstacle"):
                raise MapError(
                    f"{where}: role {properties['role']!r}; allowed are zone and obstacle"
                )
            if properties["role"] == "zone":
                zones.append(_zone(feature, where))
            else:
                obstacles += _obstacles(feature, where)
        return tuple(obstacles), tuple(zones), str(content.get("attribution", ""))
    except OSError as error:
        raise MapError(f"{path}: cannot be read ({error.strerror})") from None
    except RecursionError:
        raise MapError(
            f"{path}: is nested too deeply for a GeoJSON of obstacles and zones"
        ) from None
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        raise MapError(
            f"{path}: is not a GeoJSON of obstacles and zones ({type(error).__name__}: {error})"
        ) from None


def _polygon(feature: dict[str, Any], where: str) -> shapely.Polygon:
    rings = [np.array(ring, dtype=float) for ring in feature["geometry"]["coordinates"]]
    if not all(map(_is_ring, rings)) or sum(map(len, rings)) > MAX_CORNERS:
        raise MapError(
            f"{where}: a polygon has 4 to {MAX_CORNERS} points (the first again at the end) in "
            "metres"
        )
    polygon = shapely.Polygon(rings[0], rings[1:])
    if feature["geometry"]["type"] != "Polygon" or not polygon.is_valid:
        raise MapError(f"{where}: is not a valid polygon of at least three points in metres")
    return polygon


def _is_ring(corners: FloatArray) -> bool:
    is_one = corners.ndim == 2 and len(corners) >= 4
    return is_one and bool((np.abs(corners) <= FARTHEST).all())


def _zone(feature: dict[str, Any], where: str) -> Zone:
    properties = feature["properties"]
    elevation = float(properties.get("elevation", 0.0))
    if not abs(elevation) <= HIGHEST:
        raise MapError(f"{where}: elevation {elevation} m is not a number within {HIGHEST:g} m")
    polygon = _polygon(feature, where)
    if polygon.interiors:
        raise MapError(f"{where}: a zone has no holes; cut it in two beside them")
    return Zone(str(properties["kind"]), _ring(polygon), elevation)


def _obstacles(feature: dict[str, Any], where: str) -> list[Obstacle]:
    """The convex pieces of a polygon: itself, or its constrained Delaunay triangles."""
    kind, height = str(feature["properties"]["kind"]), float(feature["properties"]["height"])
    if not 0.0 < height <= HIGHEST:
        raise MapError(f"{where}: height {height} m is not positive and at most {HIGHEST:g} m")
    polygon = _polygon(feature, where)
    pieces = [polygon]
    if polygon.convex_hull.area - polygon.area > 1e-6 * polygon.area:
        pieces = shapely.constrained_delaunay_triangles(polygon).geoms
    return [Obstacle(kind, _ring(piece), height) for piece in pieces]


def _ring(polygon: shapely.Polygon) -> FloatArray:
    """The corners (N, 2), counter-clockwise, the first not repeated."""
    ring = np.array(polygon.exterior.coords)[:-1, :2]
    if polygon.exterior.is_ccw:
        return ring
    return ring[::-1].copy()
