"""The navigation mesh of the sidewalk world: the walkable ground as somebody drew it, not as it is.

The paper's planner and its AMCL use such a drawing. Where a wall or a piece of furniture stands, its edge runs in front
of it: mostly 0.15 to 0.6 m, median 0.2 m, 95th percentile 0.9 m. Towards roads and lawns it runs along the curb, where
a lidar sees nothing.
"""

import numpy as np
from scipy import ndimage

from harness.world.scene import Obstacle
from harness.world.shapes import bounds, grow
from navstack.types import BoolArray, FloatArray

LEAST_WIDTH = 0.3  # [m] narrower slivers are not drawn
# [m] between a solid face and the drawn edge, equally often over the faces of each kind
MARGINS = (0.15, 0.15, 0.2, 0.2, 0.2, 0.2, 0.3, 0.4, 0.6, 0.9)


def drawn_outlines(obstacles: tuple[Obstacle, ...], rng: np.random.Generator) -> tuple[Obstacle, ...]:
    """The obstacles as the mesh leaves them out: buildings with a margin per side, furniture with one all round."""
    buildings = [o for o in obstacles if o.kind.startswith("building")]
    furniture = [o for o in obstacles if not o.kind.startswith("building")]
    sides = _shuffled(rng, 4 * len(buildings)).reshape(-1, 4)
    drawn = [
        Obstacle(o.kind, bounds(o.polygon).inset(*margins).polygon, o.height)
        for o, margins in zip(buildings, (-sides).tolist(), strict=True)
    ]
    drawn += [
        Obstacle(o.kind, grow(o.polygon, margin), o.height)
        for o, margin in zip(furniture, _shuffled(rng, len(furniture)).tolist(), strict=True)
    ]
    return tuple(drawn)


def without_slivers(mesh: BoolArray, resolution: float) -> BoolArray:
    """What of a mesh (H, W) an axis-parallel square of ``LEAST_WIDTH`` can cover without leaving it: its opening."""
    size = round(LEAST_WIDTH / resolution)
    cells = np.pad(mesh.astype(np.uint8), size)
    for axis in (0, 1):
        cells = ndimage.minimum_filter1d(cells, size, axis=axis)
    for axis in (0, 1):
        cells = ndimage.maximum_filter1d(cells, size, axis=axis, origin=-1 if size % 2 == 0 else 0)
    return cells[size:-size, size:-size].astype(bool)


def _shuffled(rng: np.random.Generator, count: int) -> FloatArray:
    return rng.permutation(np.resize(MARGINS, count))
