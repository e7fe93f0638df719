"""How high the ground of a scene is, and where it makes a step."""

import math
from functools import lru_cache

import numpy as np
import shapely

from harness.world.map.scene import Scene, Zone
from navstack.types import FloatArray

_POLYGON = 3  # shapely's number of this kind of geometry
_SLIVER = 1e-4  # [m2] pieces of ground smaller than this are left out


class Elevation:
    """Level regions that meet in vertical steps; ground without a zone lies at height 0."""

    def __init__(self, zones: tuple[Zone, ...]) -> None:
        # height [m] -> polygons; without height 0, which is all the rest
        self._regions = _regions(zones)
        self._edges = shapely.union_all([region.boundary for region in self._regions.values()])
        self._covered = shapely.union_all(list(self._regions.values()))
        for region in self._regions.values():
            shapely.prepare(region)

    @property
    def is_flat(self) -> bool:
        """Whether all ground lies at height 0."""
        return not self._regions

    def level(self, x: float, y: float) -> float:
        """Height of the ground at a point, in [m]."""
        for height, region in self._regions.items():
            if shapely.intersects_xy(region, x, y):
                return height
        return 0.0

    def clearance(self, x: float, y: float) -> float:
        """Distance from a point to the nearest step, in [m]; inf if there is none."""
        if self.is_flat:
            return math.inf
        return float(shapely.distance(self._edges, shapely.Point(x, y)))

    def around(self, x: float, y: float, half: float) -> dict[float, list[FloatArray]]:
        """Convex counter-clockwise polygons (N, 2) of the ground around a point, by height [m].

        Args:
            x: [m] of the centre.
            y: [m] of the centre.
            half: [m] half the square's side.
        """
        window = shapely.box(x - half, y - half, x + half, y + half)
        regions = {
            height: shapely.intersection(region, window) for height, region in self._regions.items()
        }
        regions[0.0] = shapely.difference(window, self._covered)
        pieces = {height: _convex_pieces(region) for height, region in regions.items()}
        return {height: polygons for height, polygons in sorted(pieces.items()) if polygons}


@lru_cache(maxsize=4)
def elevation_of(scene: Scene) -> Elevation:
    """The ground of a scene, worked out once per process."""
    return Elevation(scene.zones)


def _regions(zones: tuple[Zone, ...]) -> dict[float, shapely.Geometry]:
    """The ground that lies at each height other than 0.

    Where zones overlap, the later one counts.
    """
    if all(zone.elevation == 0.0 for zone in zones):
        return {}
    regions: dict[float, shapely.Geometry] = {}
    for zone in zones:
        polygon = shapely.Polygon(zone.polygon)
        regions = {height: region.difference(polygon) for height, region in regions.items()}
        regions[zone.elevation] = shapely.union(
            regions.get(zone.elevation, shapely.Polygon()), polygon
        )
    return {
        height: region
        for height, region in regions.items()
        if height != 0.0 and region.area > _SLIVER
    }


def _convex_pieces(region: shapely.Geometry) -> list[FloatArray]:
    polygons = shapely.get_parts(region)
    polygons = polygons[
        (shapely.get_type_id(polygons) == _POLYGON) & (shapely.area(polygons) >= _SLIVER)
    ]
    polygons = shapely.simplify(polygons, 0.0)
    are_convex = shapely.area(shapely.convex_hull(polygons)) - shapely.area(polygons) < _SLIVER
    pieces: list[shapely.Geometry] = []
    for polygon, is_convex in zip(polygons, are_convex.tolist(), strict=True):
        if is_convex:
            pieces.append(polygon)
        else:
            pieces += shapely.constrained_delaunay_triangles(polygon).geoms
    found = np.array(pieces, dtype=object)
    # GEOS's normal form goes clockwise and ends where it began.
    return [
        shapely.get_coordinates(piece)[-2::-1].copy()
        for piece in shapely.normalize(found[shapely.area(found) > _SLIVER])
    ]
