"""Whether the robot's outline touches an obstacle, answered quickly.

The answer is that of :func:`navstack.control.footprint_cost.outline_cost`. Where the costmap is
inflated, a cost tells how far the nearest lethal cell is at least: mostly one look per circle
around a part of the body is enough.
"""

import math
from typing import NamedTuple

import numpy as np

from navstack.costmap.costmap import INSCRIBED_INFLATED_OBSTACLE
from navstack.costmap.inflation import HIGHEST_FALLING_COST, inflation_cost
from navstack.geometry import footprint_radii
from navstack.jit import njit
from navstack.params.costmap import InflationLayerParams
from navstack.params.local_costs import LocalCosts
from navstack.types import ByteArray, FloatArray, FloatMatrix, FloatVector

_CIRCLES = (4, 2)  # along and across the body
# [cells] between the body's edge and the outline's cells, and between a point and its cell's centre
_SLACK = 2.0
# [cells] twice between the body's edge and the outline's cells: at one pose and at a later one
OUTLINE_SLACK = 2.5
# of check_from
EVERYWHERE = 0.0  # free cells included
ANY_COST = 1.0


class CollisionBody(NamedTuple):
    """What the collision check needs of robot and costmap; lengths in cells."""

    footprint: FloatMatrix  # (V, 2) [m] base frame
    corners: FloatMatrix  # (V, 2) the same in cells
    circles: FloatMatrix  # (C, 2) centres of circles that cover the body
    free_radius: float  # that an obstacle has to be away from all these centres
    radius: float  # of the circle around the base that holds the body and all these centres
    reach: FloatVector  # (256,) to the nearest lethal cell at least, by the cost of a cell
    uses_outline: bool  # False: the centre alone counts
    check_from: float  # cost of the centre from which the outline is looked at
    tracks_unknown: bool  # unknown cells are no obstacles


def make_body(
    footprint: FloatArray,
    uses_outline: bool,
    costs: LocalCosts,
    layer: InflationLayerParams | None,
    resolution: float,
) -> CollisionBody:
    """The body of a padded ``footprint`` (V, 2) [m] on a local costmap of a ``resolution`` [m]."""
    inscribed, circumscribed = footprint_radii(footprint)
    centres, half = _cover(footprint)
    inflates_all = layer is not None and costs.ends_inflated and layer is costs.last_inflation
    bound = np.zeros(256)
    if layer is not None and inflates_all:
        bound = _least_distances(layer, inscribed)
    check_from = EVERYWHERE
    if layer is not None and layer.inflation_radius < circumscribed:
        check_from = ANY_COST
    elif layer is not None:
        check_from = float(inflation_cost(circumscribed, inscribed, layer.cost_scaling_factor))
    return CollisionBody(
        np.ascontiguousarray(footprint),
        np.ascontiguousarray(footprint / resolution),
        centres / resolution,
        half / resolution + _SLACK,
        max(circumscribed, float(np.hypot(*centres.T).max())) / resolution,
        bound / resolution,
        uses_outline,
        check_from,
        costs.tracks_unknown,
    )


def _cover(footprint: FloatArray) -> tuple[FloatArray, float]:
    """Centres (C, 2) of circles that cover the footprint's bounding box, and their radius [m]."""
    low = footprint.min(axis=0)
    high = footprint.max(axis=0)
    counts = _CIRCLES
    if high[0] - low[0] < high[1] - low[1]:
        counts = _CIRCLES[::-1]
    part = (high - low) / counts
    along, across = (low[i] + part[i] * (np.arange(counts[i]) + 0.5) for i in range(2))
    centres = np.column_stack((np.repeat(along, len(across)), np.tile(across, len(along))))
    return centres, 0.5 * math.hypot(*part)


def _least_distances(layer: InflationLayerParams, inscribed_radius: float) -> FloatArray:
    """The least distance (256,) in [m] of the nearest lethal cell, by the cost of a cell."""
    costs = np.arange(256.0)
    bound = np.full(256, layer.inflation_radius)
    if layer.cost_scaling_factor > 0.0:
        falling = (
            inscribed_radius
            - np.log((costs + 1.0) / HIGHEST_FALLING_COST) / layer.cost_scaling_factor
        )
        bound = np.minimum(bound, falling)
    else:
        bound[1:] = min(inscribed_radius, layer.inflation_radius)
    bound[INSCRIBED_INFLATED_OBSTACLE:] = 0.0
    least: FloatArray = np.maximum(bound, 0.0)
    return least


@njit()
def clearance(
    costs: ByteArray,
    cx: float,
    cy: float,
    cosine: float,
    sine: float,
    circles: FloatArray,
    free_radius: float,
    radius: float,
    reach: FloatArray,
) -> float:
    """How far in cells a body at (cx, cy) may move at least before its outline touches anything.

    Negative: unknown.

    Lengths in cells; see :class:`CollisionBody`.
    """
    height, width = costs.shape
    edge: float = min(min(cx, width - cx), min(cy, height - cy)) - radius  # of the map
    if not edge >= 0.0:  # nan, too
        return -1.0
    worst = 0
    for i in range(len(circles)):
        mx = int(cx + circles[i, 0] * cosine - circles[i, 1] * sine)
        my = int(cy + circles[i, 0] * sine + circles[i, 1] * cosine)
        worst = max(worst, int(costs[my, mx]))
    return min(edge, float(reach[worst]) - free_radius)
