"""The steps of scan alignment: returns, search, refinement."""

import math

import numpy as np

from navstack.jit import njit
from navstack.scan_matching.surface_field import CODE, MOST, SurfaceField
from navstack.types import BoolVector, FloatArray, FloatMatrix, FloatVector

RETURN_STD = 0.2  # [m] of a return from the mapped surface, as sigma_hit of nav2_amcl
REACH = 0.3  # [m] from a surface beyond which a return comes from something else
COARSE = 0.12  # [m] between the places that are searched
COARSE_YAW = 0.04  # [rad]
MOST_TURNS = 3  # headings that are searched to each side
THINNED = 4  # one return in so many is looked at in the search
ITERATIONS = 12
SMALL = 1e-4  # [m], [rad] of a step after which the refinement ends
WINDOW_STDS = 3.0  # standard deviations of the belief that are searched
MOST_WINDOW = (1.5, 1.5, 0.12)  # [m, m, rad]
LEVER = 5.0  # [m] at which a turn counts as the shift that it makes there
METRES = np.array((1.0, 1.0, LEVER))
_PER_METRES = np.outer(METRES, METRES)


@njit(ahead=True)
def returns_of(
    ranges: FloatVector,
    angle_min: float,
    increment: float,
    range_min: float,
    range_max: float,
    sensor: FloatVector,
    points: FloatMatrix,
) -> None:
    """Where beams end, in the base frame.

    Args:
        ranges: (n,) [m].
        angle_min: [rad] of beam 0 in the sensor frame.
        increment: [rad].
        range_min: [m].
        range_max: [m].
        sensor: (3,) x, y [m], yaw [rad] of the sensor in the base frame.
        points: (n, 2) output [m]; NaN: no return.
    """
    for i in range(len(ranges)):
        r = ranges[i]
        points[i] = math.nan
        if range_min <= r <= range_max:
            angle = sensor[2] + angle_min + i * increment
            points[i, 0] = sensor[0] + r * math.cos(angle)
            points[i, 1] = sensor[1] + r * math.sin(angle)


@njit(inline="always")
def distance_near(field: SurfaceField, x: float, y: float) -> float:
    """The signed distance [m] of a point of the map frame, to a cell; NaN: off the map."""
    column = math.floor((x - field.origin_x) / field.resolution)
    row = math.floor((y - field.origin_y) / field.resolution)
    height, width = field.codes.shape
    if not (0 <= column < width and 0 <= row < height):
        return math.nan
    return float(CODE * field.codes[row, column])


@njit(inline="always")
def distance_and_slope(field: SurfaceField, x: float, y: float) -> tuple[float, float, float]:
    """Signed distance [m] by bilinear interpolation, and its gradient; NaN: off the map.

    Far from every surface the gradient is 0.
    """
    column = (x - field.origin_x) / field.resolution - 0.5
    row = (y - field.origin_y) / field.resolution - 0.5
    left = math.floor(column)
    low = math.floor(row)
    height, width = field.codes.shape
    if not (0 <= left < width - 1 and 0 <= low < height - 1):
        return math.nan, 0.0, 0.0
    u = column - left
    v = row - low
    a = CODE * field.codes[low, left]
    b = CODE * field.codes[low, left + 1]
    c = CODE * field.codes[low + 1, left]
    d = CODE * field.codes[low + 1, left + 1]
    lower = a + u * (b - a)
    upper = c + u * (d - c)
    slope_x = ((1.0 - v) * (b - a) + v * (d - c)) / field.resolution
    return lower + v * (upper - lower), slope_x, (upper - lower) / field.resolution


@njit()
def misfit(
    points: FloatArray, x: float, y: float, yaw: float, bound: float, field: SurfaceField
) -> float:
    """Half the sum of squares of thinned returns' distances; given up above ``bound``."""
    cos = math.cos(yaw)
    sin = math.sin(yaw)
    total = 0.0
    for i in range(0, len(points), THINNED):
        if math.isnan(points[i, 0]):
            continue
        there_x = x + cos * points[i, 0] - sin * points[i, 1]
        there_y = y + sin * points[i, 0] + cos * points[i, 1]
        off = abs(distance_near(field, there_x, there_y))
        if not off < REACH:
            off = REACH
        total += 0.5 * (off / RETURN_STD) ** 2
        if total > bound:
            break
    return total


@njit(inline="always")
def strangeness(off: FloatArray, information: FloatArray) -> float:
    """Half the squared Mahalanobis distance of (3,)."""
    total = 0.0
    for i in range(3):
        for j in range(3):
            total += 0.5 * off[i] * information[i, j] * off[j]
    return total


@njit()
def search(
    points: FloatArray,
    pose: FloatArray,
    information: FloatArray,
    window: FloatArray,
    field: SurfaceField,
) -> FloatArray:
    """The pose (3,) within a window about ``pose`` of least misfit and strangeness.

    Correlative scan matching (Olson 2009, ICRA) at one resolution, with the belief as a prior.
    """
    best_off = np.zeros(3)
    best = misfit(points, pose[0], pose[1], pose[2], math.inf, field)
    off = np.empty(3)
    reach_x = int(window[0] / COARSE)
    reach_y = int(window[1] / COARSE)
    turns = min(int(window[2] / COARSE_YAW), MOST_TURNS)
    for k in range(-turns, turns + 1):
        off[2] = k * COARSE_YAW
        for i in range(-reach_x, reach_x + 1):
            off[0] = i * COARSE
            for j in range(-reach_y, reach_y + 1):
                off[1] = j * COARSE
                strange = strangeness(off, information)
                if strange >= best:
                    continue
                x, y, yaw = pose[0] + off[0], pose[1] + off[1], pose[2] + off[2]
                total = strange + misfit(points, x, y, yaw, best - strange, field)
                if total < best:
                    best = total
                    best_off[:] = off
    return pose + best_off


@njit()
def linearize(
    points: FloatArray,
    pose: FloatArray,
    field: SurfaceField,
    hessian: FloatArray,
    slope: FloatArray,
) -> tuple[int, int]:
    """Normal equations of the returns' distances about a pose, with Tukey's weights.

    Args:
        points: (n, 2) [m].
        pose: (3,).
        field: of the map.
        hessian: (3, 3) output, information of x, y [1/m2] and yaw [1/rad2].
        slope: (3,) output, derivative of half the sum of squares.

    Returns:
        How many returns come from a surface, and how many might.
    """
    hessian[:] = 0.0
    slope[:] = 0.0
    cos = math.cos(pose[2])
    sin = math.sin(pose[2])
    row = np.empty(3)
    near = 0
    count = 0
    for i in range(len(points)):
        if math.isnan(points[i, 0]):
            continue
        along = cos * points[i, 0] - sin * points[i, 1]
        across = sin * points[i, 0] + cos * points[i, 1]
        off, row[0], row[1] = distance_and_slope(field, pose[0] + along, pose[1] + across)
        if not off > -MOST * CODE:  # off the map, or through glass
            continue
        count += 1
        if abs(off) >= REACH:
            continue
        near += 1
        row[2] = row[1] * along - row[0] * across
        weight = (1.0 - (off / REACH) ** 2) ** 2 / RETURN_STD**2
        for j in range(3):
            slope[j] += weight * row[j] * off
            for k in range(3):
                hessian[j, k] += weight * row[j] * row[k]
    return near, count


@njit()
def search_window(covariance: FloatArray) -> FloatArray:
    """How far (3,) [m], [m], [rad] to each side a belief's pose is searched for."""
    window = np.empty(3)
    for i in range(3):
        window[i] = min(WINDOW_STDS * math.sqrt(covariance[i, i]), MOST_WINDOW[i])
    return window


@njit(ahead=True)
def align(
    points: FloatMatrix,
    pose: FloatVector,
    covariance: FloatMatrix,
    information: FloatMatrix,
    field: SurfaceField,
    aligned: FloatVector,
    slope: FloatVector,
    values: FloatVector,
    vectors: FloatMatrix,
) -> tuple[int, int]:
    """The likeliest pose, given a belief and a scan: search, then Gauss-Newton.

    The refinement is the iterated Kalman update of point-to-surface distances (Bell & Cathey 1993;
    with scans: Xu & Zhang 2021, FAST-LIO): along a corridor the belief holds.

    Args:
        points: (n, 2) of :func:`returns_of`.
        pose: (3,) believed.
        covariance: (3, 3) of it.
        information: (3, 3) its inverse.
        field: of the map.
        aligned: (3,) output, the pose.
        slope: (3,) output, see :func:`linearize`.
        values: (3,) output, ascending [1/m2]: eigenvalues of what the scan alone says about the
            pose, its yaw in [m] at ``LEVER``.
        vectors: (3, 3) output, their eigenvectors as columns.

    Returns:
        How many returns come from a surface, and how many might.
    """
    hessian = np.empty((3, 3))
    aligned[:] = search(points, pose, information, search_window(covariance), field)
    for _ in range(ITERATIONS):
        linearize(points, aligned, field, hessian, slope)
        pull = information @ (aligned - pose)
        step = np.linalg.solve(hessian + information, -(slope + pull))
        aligned += step
        if np.abs(step).max() < SMALL:
            break
    near, count = linearize(points, aligned, field, hessian, slope)
    values[:], vectors[:] = np.linalg.eigh(hessian / _PER_METRES)
    return near, count


@njit(ahead=True)
def mark_unmapped(
    points: FloatMatrix,
    pose: FloatVector,
    covariance: FloatMatrix,
    max_range: float,
    margin: float,
    deviations: float,
    field: SurfaceField,
    foreground: BoolVector,
) -> None:
    """Which returns come from something that the map does not show.

    Args:
        points: (n, 2) of :func:`returns_of`.
        pose: (3,) of the base, map frame.
        covariance: (3, 3) of it.
        max_range: [m] from the base beyond which nothing is marked.
        margin: [m] of a surface within which a return is of it.
        deviations: of the place along the surface's normal that are added to the margin.
        field: of the map; off it nothing is marked.
        foreground: (n,) output.
    """
    cos = math.cos(pose[2])
    sin = math.sin(pose[2])
    row = np.empty(3)
    for i in range(len(points)):
        foreground[i] = False
        if not math.hypot(points[i, 0], points[i, 1]) <= max_range:  # nan too
            continue
        along = cos * points[i, 0] - sin * points[i, 1]
        across = sin * points[i, 0] + cos * points[i, 1]
        off, row[0], row[1] = distance_and_slope(field, pose[0] + along, pose[1] + across)
        if not off > margin:  # nan too
            continue
        row[2] = row[1] * along - row[0] * across
        variance = 2.0 * strangeness(row, covariance)
        foreground[i] = off > margin + deviations * math.sqrt(max(variance, 0.0))
