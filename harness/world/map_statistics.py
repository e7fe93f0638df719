"""What a world measures: walkable area, widths of its ways, sizes and spacing of its furniture."""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from harness.world.scene import Scene
from harness.world.shapes import polygon_area
from navstack.costmap.occupancy_grid import FREE
from navstack.types import BoolArray, FloatArray

WIDTH_PERCENTILES = (5, 10, 25, 50, 75, 90, 95)
SPACING_PERCENTILES = (10, 50, 90)
_PIECE_AREA = (0.05, 10.0)  # [m2] what counts as a piece of furniture


@dataclass(frozen=True, slots=True)
class MapStatistics:
    """Measures of a scene."""

    walkable_area: float  # [m2]
    connected_parts: int  # of the walkable area, 4-connected
    widths: tuple[float, ...]  # [m] at WIDTH_PERCENTILES over the medial axis of the walkable area
    pieces: int  # of furniture between 0.05 and 10 m2
    medium_share: float  # of those between 0.3 and 1 m2
    spacings: tuple[float, ...]  # [m] at SPACING_PERCENTILES of the distance between nearest pieces' centres


def measure(scene: Scene) -> MapStatistics:
    """Measure a scene; furniture is what is neither a building nor of unknown kind."""
    free = scene.walkable.data == FREE
    furniture = [o for o in scene.obstacles if not o.kind.startswith("building") and o.kind != "unknown"]
    sizes = np.array([polygon_area(obstacle.polygon) for obstacle in furniture])
    counted = (sizes >= _PIECE_AREA[0]) & (sizes <= _PIECE_AREA[1])
    centres = np.array([o.polygon.mean(axis=0) for o, is_counted in zip(furniture, counted, strict=True) if is_counted])
    nearest = cKDTree(centres).query(centres, k=2)[0][:, 1] if len(centres) > 1 else np.empty(0)
    widths = medial_widths(free) * scene.walkable.resolution
    return MapStatistics(
        walkable_area=float(free.sum()) * scene.walkable.resolution**2,
        connected_parts=int(ndimage.label(free)[1]),
        widths=_percentiles(widths, WIDTH_PERCENTILES),
        pieces=int(counted.sum()),
        medium_share=float(((sizes >= 0.3) & (sizes <= 1.0))[counted].mean()) if counted.any() else 0.0,
        spacings=_percentiles(nearest, SPACING_PERCENTILES),
    )


def medial_widths(free: BoolArray) -> FloatArray:
    """Twice the distance to the nearest blocked cell, in cells, at every cell of the integer medial axis.

    The axis is where neighbouring cells have blocked cells apart from each other as their nearest, taken on the side
    of the bisector (Hesselink & Roerdink 2008, "Euclidean skeletons ... by the integer medial axis").
    """
    distance, (near_y, near_x) = ndimage.distance_transform_edt(free, return_indices=True)
    axis = np.zeros(free.shape, dtype=bool)
    for dy, dx in ((0, 1), (1, 0)):
        here = np.s_[: free.shape[0] - dy, : free.shape[1] - dx]
        there = np.s_[dy:, dx:]
        apart_y, apart_x = near_y[there] - near_y[here], near_x[there] - near_x[here]
        candidates = np.argwhere(free[here] & free[there] & (apart_y**2 + apart_x**2 > 2))
        y, x = candidates.T
        middle_y = 2 * y + dy - near_y[here][y, x] - near_y[there][y, x]
        middle_x = 2 * x + dx - near_x[here][y, x] - near_x[there][y, x]
        side = apart_y[y, x] * middle_y + apart_x[y, x] * middle_x
        axis[y[side >= 0], x[side >= 0]] = True
        axis[y[side <= 0] + dy, x[side <= 0] + dx] = True
    return 2.0 * distance[axis]


def _percentiles(values: FloatArray, at: tuple[int, ...]) -> tuple[float, ...]:
    return tuple(float(value) for value in np.percentile(values, at)) if len(values) else ()
