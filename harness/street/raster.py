"""Polygons as cells of a map."""

import numpy as np
import shapely

from harness.world.map.shapes import Rect
from navstack.types import BoolArray


def cells_of(shape: shapely.Geometry, window: Rect, resolution: float) -> BoolArray:
    """Which cells (H, W) of a window have their centre in a polygon or multipolygon.

    By the even-odd rule, row by row (Foley et al., Computer Graphics, section 3.6).

    Args:
        shape: valid; [m].
        window: [m] whose lower left corner is that of cell (0, 0).
        resolution: [m/cell].
    """
    width, height = round(window.width / resolution), round(window.depth / resolution)
    toggles = np.zeros((height, width + 1), dtype=np.uint8)
    for ring in shapely.get_rings(shapely.get_parts(shape)):
        corners = (shapely.get_coordinates(ring) - (window.x0, window.y0)) / resolution - 0.5
        for (x0, y0), (x1, y1) in zip(corners[:-1], corners[1:], strict=True):
            low, high = sorted((y0, y1))
            rows = np.arange(max(int(np.ceil(low)), 0), min(int(np.ceil(high)), height))
            if not len(rows):
                continue
            crossed = x0 + (rows - y0) * ((x1 - x0) / (y1 - y0))
            columns = np.clip(np.ceil(crossed), 0, width).astype(np.int64)
            toggles[rows, columns] ^= 1
    inside: BoolArray = np.bitwise_xor.accumulate(toggles, axis=1)[:, :-1].astype(bool)
    return inside
