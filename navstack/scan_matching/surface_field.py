"""Signed distances to the surfaces of a map."""

from typing import NamedTuple
from weakref import WeakValueDictionary

import numpy as np
import numpy.typing as npt

from navstack.costmap.distances import squared_distances
from navstack.costmap.field_cache import SHARED_FROM, cached_array, content_key
from navstack.costmap.occupancy_grid import FREE, OCCUPIED, OccupancyGrid, enclosed
from navstack.jit import njit
from navstack.types import BoolArray, BoolMatrix, FixedInt8Matrix

CODE = 0.01  # [m] of a code
MOST = 127  # codes beyond which a surface is far

Int8Array = npt.NDArray[np.int8]
# fields by their surfaces, as long as somebody has them: localizer and tracker take the same
_in_use: WeakValueDictionary[str, Int8Array] = WeakValueDictionary()


class SurfaceField(NamedTuple):
    """Distances to the nearest surface of a map, negative inside, as kernels take them."""

    codes: FixedInt8Matrix  # (H, W) of CODE, at most MOST either way
    origin_x: float  # [m] of the map's lower left corner
    origin_y: float
    resolution: float  # [m/cell]


def surface_field(static_map: OccupancyGrid) -> SurfaceField:
    """The field of a map; what lies behind a surface may be occupied or unknown.

    Raises:
        MapError: the map is rotated.
    """
    static_map.require_unrotated("map")
    data, cell = static_map.data, static_map.resolution
    occupied, free = data >= OCCUPIED, data == FREE
    surfaces = occupied & ~enclosed(occupied)
    key = content_key(
        "surface codes 2", np.packbits(surfaces), np.packbits(free), *data.shape, cell
    )
    codes = _in_use.get(key)
    if codes is None:
        codes = _in_use[key] = _codes_of(surfaces, free, cell, key)
    return SurfaceField(codes, static_map.origin.x, static_map.origin.y, cell)


def _codes_of(surfaces: BoolArray, free: BoolArray, cell: float, key: str) -> Int8Array:
    """The codes of a map's cells, kept on disk under ``key`` where the map is large."""

    def compute() -> Int8Array:
        return surface_codes(surfaces, free, cell)

    codes: Int8Array = compute() if free.size < SHARED_FROM else cached_array(key, compute)
    codes.flags.writeable = False
    return codes


@njit(ahead=True)
def surface_codes(surfaces: BoolMatrix, free: BoolMatrix, cell: float) -> Int8Array:
    """Signed distances (H, W) in CODE from cells' middles to the edge of the nearest surface.

    No cell enclosed by surfaces is the nearest to one that is free.
    """
    height, width = free.shape
    codes = np.empty((height, width), dtype=np.int8)
    reach = int(np.ceil(MOST * CODE / cell)) + 1
    for sign in (1.0, -1.0):
        squared = squared_distances(surfaces if sign > 0.0 else free, reach * reach)
        for row in range(height):
            for column in range(width):
                if free[row, column] == (sign > 0.0):
                    metres = sign * cell * (np.sqrt(squared[row, column]) - 0.5)
                    rounded = np.rint(metres / CODE)
                    codes[row, column] = np.int8(min(max(rounded, -MOST), MOST))
    return codes
