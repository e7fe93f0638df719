"""Rectangles and convex polygons in the plane, and their cells."""

import math
from dataclasses import dataclass

import numpy as np

from navstack.geometry import rotation
from navstack.types import BoolArray, FloatArray


@dataclass(frozen=True, slots=True)
class Rect:
    """A rectangle parallel to the axes, map frame."""

    x0: float  # [m]
    y0: float  # [m]
    x1: float  # [m]
    y1: float  # [m]

    @property
    def width(self) -> float:
        """Along x, in [m]."""
        return self.x1 - self.x0

    @property
    def depth(self) -> float:
        """Along y, in [m]."""
        return self.y1 - self.y0

    @property
    def polygon(self) -> FloatArray:
        """The corners (4, 2), counter-clockwise."""
        return np.array(
            ((self.x0, self.y0), (self.x1, self.y0), (self.x1, self.y1), (self.x0, self.y1))
        )

    def inset(self, left: float, bottom: float, right: float, top: float) -> "Rect":
        """The rectangle with each side moved inwards, in [m]; negative values move it outwards."""
        return Rect(self.x0 + left, self.y0 + bottom, self.x1 - right, self.y1 - top)

    def grown(self, margin: float) -> "Rect":
        """The rectangle with all sides moved outwards by ``margin`` [m]."""
        return self.inset(-margin, -margin, -margin, -margin)

    def overlaps(self, other: "Rect") -> bool:
        """Whether the two share an inner point."""
        is_beside = self.x1 <= other.x0 or other.x1 <= self.x0
        return not (is_beside or self.y1 <= other.y0 or other.y1 <= self.y0)

    def side_length(self, side: int) -> float:
        """Length [m] of the left, bottom, right or top side."""
        return self.depth if side % 2 == 0 else self.width

    def beside(self, side: int, along: float, inwards: float = 0.0) -> tuple[float, float]:
        """The point ``along`` [m] from a side's lower or left end, ``inwards`` [m] from it."""
        return (
            (self.x0 + inwards, self.y0 + along),
            (self.x0 + along, self.y0 + inwards),
            (self.x1 - inwards, self.y0 + along),
            (self.x0 + along, self.y1 - inwards),
        )[side]


def box(x: float, y: float, yaw: float, length: float, width: float) -> FloatArray:
    """A rectangle (4, 2) centred at (x, y), ``length`` along ``yaw``; counter-clockwise."""
    local = 0.5 * np.array(((-length, -width), (length, -width), (length, width), (-length, width)))
    corners: FloatArray = local @ rotation(-yaw) + (x, y)
    return corners


def octagon(x: float, y: float, radius: float) -> FloatArray:
    """A regular octagon (8, 2) of circumscribed ``radius`` [m]: the cross-section of a post.

    Counter-clockwise.
    """
    angles = np.pi / 8.0 + np.arange(8) * np.pi / 4.0
    return np.stack((x + radius * np.cos(angles), y + radius * np.sin(angles)), axis=1)


def bounds(polygon: FloatArray) -> Rect:
    """The bounding rectangle of a polygon (N, 2)."""
    (x0, y0), (x1, y1) = polygon.min(axis=0), polygon.max(axis=0)
    return Rect(float(x0), float(y0), float(x1), float(y1))


def grow(polygon: FloatArray, margin: float) -> FloatArray:
    """A convex counter-clockwise polygon (N, 2) with each edge moved outwards by ``margin`` [m]."""
    along = np.roll(polygon, -1, axis=0) - polygon
    outwards = np.stack((along[:, 1], -along[:, 0]), axis=1) / np.hypot(*along.T)[:, None]
    before = np.roll(outwards, 1, axis=0)
    # A corner moves along the bisector of its edges' normals: the mitre.
    cosines = (before * outwards).sum(axis=1)
    moved: FloatArray = polygon + margin * (before + outwards) / (1.0 + cosines)[:, None]
    return moved


def polygon_area(polygon: FloatArray) -> float:
    """Signed area in [m2], positive when counter-clockwise (shoelace formula)."""
    x, y = polygon.T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def fill_convex(
    mask: BoolArray, polygon: FloatArray, value: bool, resolution: float, x0: float, y0: float
) -> None:
    """Set the cells of a mask (H, W) whose centres lie in a convex counter-clockwise polygon.

    Args:
        mask: row 0 = lowest y.
        polygon: corners (N, 2) in [m].
        value: what to set.
        resolution: [m/cell].
        x0: [m] of the mask's left edge.
        y0: [m] of the mask's lower edge.
    """
    area = bounds(polygon)
    columns = _cells(area.x0 - x0, area.x1 - x0, resolution, mask.shape[1])
    rows = _cells(area.y0 - y0, area.y1 - y0, resolution, mask.shape[0])
    x = x0 + (columns + 0.5) * resolution
    y = (y0 + (rows + 0.5) * resolution)[:, None]
    inside = np.ones((len(rows), len(columns)), dtype=bool)
    for (ax, ay), (bx, by) in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        inside &= (bx - ax) * (y - ay) - (by - ay) * (x - ax) >= -1e-9
    if inside.any():
        mask[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1][inside] = value


def window_of(
    polygon: FloatArray, shape: tuple[int, int], resolution: float, x0: float, y0: float
) -> tuple[tuple[slice, slice], BoolArray]:
    """The part of a grid around a convex counter-clockwise polygon, and which cells lie in it.

    A cell does if its centre does.

    Args:
        polygon: (N, 2) corners in [m].
        shape: of the grid; row 0 = lowest y.
        resolution: [m/cell].
        x0: [m] of the grid's left edge.
        y0: [m] of the grid's lower edge.
    """
    area = bounds(polygon)
    columns = _span(area.x0 - x0, area.x1 - x0, resolution, shape[1])
    rows = _span(area.y0 - y0, area.y1 - y0, resolution, shape[0])
    mask = np.zeros((rows.stop - rows.start, columns.stop - columns.start), dtype=bool)
    fill_convex(
        mask,
        polygon,
        True,
        resolution,
        x0 + columns.start * resolution,
        y0 + rows.start * resolution,
    )
    return (rows, columns), mask


def _span(low: float, high: float, resolution: float, count: int) -> slice:
    first = min(max(math.floor(low / resolution), 0), count)
    return slice(first, max(min(math.ceil(high / resolution), count), first))


def _cells(low: float, high: float, resolution: float, count: int) -> FloatArray:
    span = _span(low, high, resolution, count)
    return np.arange(span.start, span.stop)
