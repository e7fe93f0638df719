"""Derivatives of model and cost for the numba twin, written out."""

import math

import numpy as np

from navstack.control.mpc import stage_layout as at
from navstack.control.mpc.stages import is_far
from navstack.jit import njit
from navstack.types import FloatArray, IntArray

BOUND_WEIGHT = 100.0  # of squared excess over the bounds of velocities and accelerations
REGULARISATION = 1e-6  # on the diagonal of every Hessian block, as in the other solver

# Where the model's Jacobian by the state has entries, column by column.
COLUMNS: IntArray = np.array((0, 1, 2, 2, 2, 3, 3, 3, 4, 4, 4, 4, 5, 5, 5, 5, 6, 6, 6, 6, 6))
ROWS: IntArray = np.array((0, 1, 0, 1, 2, 0, 1, 3, 0, 1, 2, 4, 0, 1, 3, 5, 0, 1, 2, 4, 6))


@njit(cache=True)
def jacobians(state: FloatArray, jerk: FloatArray, dt: float, by_state: FloatArray, by_jerk: FloatArray) -> None:
    """Write the entries of the model's Jacobian by the state (``ROWS``, ``COLUMNS``) and that by the jerks (7, 2)."""
    yaw, v, omega, a, alpha = state[2], state[3], state[4], state[5], state[6]
    half = 0.5 * dt
    v_mid, v_end = v + half * (a + 0.5 * half * jerk[0]), v + dt * (a + half * jerk[0])
    yaw_mid = yaw + half * (omega + half * (alpha / 2.0 + half * jerk[1] / 6.0))
    yaw_end = yaw + dt * (omega + dt * (alpha / 2.0 + dt * jerk[1] / 6.0))
    w = dt / 6.0
    c0, s0 = w * math.cos(yaw), w * math.sin(yaw)
    cm, sm = 4.0 * w * math.cos(yaw_mid), 4.0 * w * math.sin(yaw_mid)
    c1, s1 = w * math.cos(yaw_end), w * math.sin(yaw_end)
    ym, y1 = (-v_mid * sm, v_mid * cm), (-v_end * s1, v_end * c1)  # of the position by the middle's and the end's yaw
    start = (-v * s0, v * c0)
    for r in range(2):
        m, e = (cm, c1) if r == 0 else (sm, s1)
        by_state[2 + r] = start[r] + ym[r] + y1[r]
        by_state[5 + r] = (c0 if r == 0 else s0) + m + e
        by_state[8 + r] = half * ym[r] + dt * y1[r]
        by_state[12 + r] = half * m + dt * e
        by_state[16 + r] = 0.5 * half * half * ym[r] + half * dt * y1[r]
        by_jerk[r, 0] = 0.5 * half * half * m + half * dt * e
        by_jerk[r, 1] = half * half * half / 6.0 * ym[r] + dt * dt * dt / 6.0 * y1[r]
    by_state[0] = by_state[1] = by_state[4] = by_state[7] = by_state[11] = by_state[15] = by_state[20] = 1.0
    by_state[10] = by_state[14] = by_state[19] = dt  # yaw by omega, v by a, omega by alpha
    by_state[18] = half * dt  # yaw by alpha
    by_jerk[2, 0] = by_jerk[4, 0] = by_jerk[6, 0] = by_jerk[3, 1] = by_jerk[5, 1] = 0.0
    by_jerk[2, 1] = dt * dt * dt / 6.0
    by_jerk[3, 0] = by_jerk[4, 1] = half * dt
    by_jerk[5, 0] = by_jerk[6, 1] = dt


@njit(cache=True)
def add_stage(
    slope: FloatArray,
    curvature: FloatArray,
    state: FloatArray,
    stage: FloatArray,
    shared: FloatArray,
    limits: FloatArray,
    people: int,
    dt: float,
) -> None:
    """Add gradient (7,) and Gauss-Newton Hessian (7, 7) of a step's cost, halved, at the state (7,) at its end."""
    dx, dy = state[0] - stage[at.FOOT_X], state[1] - stage[at.FOOT_Y]
    tx, ty = stage[at.TANGENT_X], stage[at.TANGENT_Y]
    _add_square(slope, curvature, dt * shared[at.W_CONTOUR] * stage[at.CONTOUR], tx * dy - ty * dx, -ty, tx, 0.0)
    _add_square(slope, curvature, dt * shared[at.W_LAG], tx * dx + ty * dy - stage[at.LEAD], tx, ty, 0.0)
    _add_square(slope, curvature, dt * shared[at.W_HEADING], state[2] - stage[at.HEADING], 0.0, 0.0, 1.0)
    weight = dt * shared[at.W_SPEED]
    slope[3] += weight * (state[3] - stage[at.SPEED])
    curvature[3, 3] += weight
    weight = dt * shared[at.W_YAW_ACCELERATION]
    slope[6] += weight * state[6]
    curvature[6, 6] += weight
    lateral = state[3] * state[4]
    excess = abs(lateral) - shared[at.LATERAL_LIMIT]
    if excess > 0.0:
        weight = dt * shared[at.W_LATERAL]
        sign = 1.0 if lateral > 0.0 else -1.0
        slope[3] += weight * excess * sign * state[4]
        slope[4] += weight * excess * sign * state[3]
        curvature[3, 3] += weight * state[4] ** 2
        curvature[4, 4] += weight * state[3] ** 2
        curvature[3, 4] += weight * lateral
        curvature[4, 3] += weight * lateral
    for i in range(3, 7):
        low, high = limits[0, 2 + i], limits[1, 2 + i]
        out = state[i] - high if state[i] > high else min(0.0, state[i] - low)
        if out != 0.0:
            slope[i] += dt * BOUND_WEIGHT * out
            curvature[i, i] += dt * BOUND_WEIGHT
    for i in range(7):
        curvature[i, i] += REGULARISATION
    _add_obstacles(slope, curvature, state, stage, shared, people, dt)


@njit(cache=True)
def _add_obstacles(
    slope: FloatArray,
    curvature: FloatArray,
    state: FloatArray,
    stage: FloatArray,
    shared: FloatArray,
    people: int,
    dt: float,
) -> None:
    """The part of :func:`add_stage` that the footprint's circles feel."""
    cosine, sine = math.cos(state[2]), math.sin(state[2])
    circles = len(shared) - at.CIRCLES
    for i in range(circles):
        offset = shared[at.CIRCLES + i]
        cx, cy = state[0] + offset * cosine, state[1] + offset * sine
        plane = at.BASE + 3 * i
        gx, gy = stage[plane], stage[plane + 1]
        inside = stage[plane + 2] - gx * cx - gy * cy
        if inside > 0.0:
            turn = offset * (gx * sine - gy * cosine)
            _add_square(slope, curvature, dt * shared[at.W_OBSTACLE], inside, -gx, -gy, turn)
    for j in range(people):
        place = at.BASE + 3 * circles + 3 * j
        if is_far(state, stage, place, shared):
            continue
        for i in range(circles):
            offset = shared[at.CIRCLES + i]
            px, py = state[0] + offset * cosine - stage[place], state[1] + offset * sine - stage[place + 1]
            distance = math.sqrt(px * px + py * py + 1e-6)
            inside = stage[place + 2] - distance
            if inside > 0.0:
                gx, gy = px / distance, py / distance
                turn = offset * (gx * sine - gy * cosine)
                _add_square(slope, curvature, dt * shared[at.W_PERSON], inside, -gx, -gy, turn)


@njit(cache=True)
def _add_square(
    slope: FloatArray, curvature: FloatArray, weight: float, residual: float, x: float, y: float, yaw: float
) -> None:
    """Add half the weighted square of a residual whose derivatives by the pose are (x, y, yaw)."""
    slope[0] += weight * residual * x
    slope[1] += weight * residual * y
    slope[2] += weight * residual * yaw
    curvature[0, 0] += weight * x * x
    curvature[1, 1] += weight * y * y
    curvature[2, 2] += weight * yaw * yaw
    curvature[0, 1] += weight * x * y
    curvature[1, 0] += weight * x * y
    curvature[0, 2] += weight * x * yaw
    curvature[2, 0] += weight * x * yaw
    curvature[1, 2] += weight * y * yaw
    curvature[2, 1] += weight * y * yaw
