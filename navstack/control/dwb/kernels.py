"""Inner loops of DWB: trajectories, distances to cells, and totals."""

import math

import numpy as np
import numpy.typing as npt

from navstack.control.dwb.velocity_samples import project_velocity
from navstack.jit import njit
from navstack.types import Float32Array, FloatArray, IntArray

CellArray = npt.NDArray[np.int32]
SMALL_TURN = 0.05  # [rad] up to which the series below are exact to the last bits


@njit()
def step_counts(commands: FloatArray, sim_time: float, linear: float, angular: float) -> IntArray:
    """Numbers of steps (K,) of the commands' (K, 3) trajectories.

    A step is at most ``linear`` [m] and ``angular`` [rad] long at the commanded velocity
    (``StandardTrajectoryGenerator::getTimeSteps``).
    """
    steps = np.empty(len(commands), dtype=np.int64)
    distance = 0.0
    for k in range(len(commands)):
        if k == 0 or commands[k, 0] != commands[k - 1, 0] or commands[k, 1] != commands[k - 1, 1]:
            distance = math.hypot(commands[k, 0], commands[k, 1]) * sim_time
        turn = abs(commands[k, 2]) * sim_time
        steps[k] = max(1, int(math.ceil(max(distance / linear, turn / angular))))
    return steps


@njit()
def sine_cosine(angle: float) -> tuple[float, float]:
    """Sine and cosine of the turn of one step."""
    if abs(angle) > SMALL_TURN:
        return math.sin(angle), math.cos(angle)
    return small_sine_cosine(angle)


@njit(inline="always")
def small_sine_cosine(angle: float) -> tuple[float, float]:
    """Sine and cosine up to SMALL_TURN: Taylor series to the ninth and eighth power."""
    s = angle * angle
    sine = angle * (
        1.0
        - s * (1.0 / 6.0) * (1.0 - s * 0.05 * (1.0 - s * (1.0 / 42.0) * (1.0 - s * (1.0 / 72.0))))
    )
    cosine = 1.0 - s * 0.5 * (
        1.0 - s * (1.0 / 12.0) * (1.0 - s * (1.0 / 30.0) * (1.0 - s * (1.0 / 56.0)))
    )
    return sine, cosine


@njit()
def roll_out(
    start: FloatArray,
    velocity: FloatArray,
    commands: FloatArray,
    limits: FloatArray,
    steps: IntArray,
    sim_time: float,
    x: FloatArray,
    y: FloatArray,
    yaw: FloatArray,
    first: FloatArray,
) -> None:
    """Drive commands (K, 3) from ``start`` (3,) at ``velocity`` (3,); poses go to x, y, yaw (K, T).

    A trajectory has its start and ``steps[k]`` poses; the rest of its row repeats the last.
    ``limits`` (3, 2): acceleration and (negative) deceleration per axis. ``first`` (K, 3) receives
    the velocity of the first step. Each step is a straight line along the heading it begins with
    (``computeNewPosition``); the heading's cosine and sine follow by rotation.
    """
    start_sine = math.sin(start[2])
    start_cosine = math.cos(start[2])
    length = x.shape[1]
    for k in range(len(commands)):
        dt = sim_time / steps[k]
        px = start[0]
        py = start[1]
        angle = start[2]
        sine = start_sine
        cosine = start_cosine
        vx = velocity[0]
        vy = velocity[1]
        w = velocity[2]
        x[k, 0] = px
        y[k, 0] = py
        yaw[k, 0] = angle
        turn_sine = 0.0
        turn_cosine = 1.0
        turned_at = 0.0
        for t in range(1, steps[k] + 1):
            vx = project_velocity(vx, limits[0, 0], limits[0, 1], dt, commands[k, 0])
            vy = project_velocity(vy, limits[1, 0], limits[1, 1], dt, commands[k, 1])
            w = project_velocity(w, limits[2, 0], limits[2, 1], dt, commands[k, 2])
            if t == 1:
                first[k, 0] = vx
                first[k, 1] = vy
                first[k, 2] = w
            px += (vx * cosine - vy * sine) * dt
            py += (vx * sine + vy * cosine) * dt
            angle += w * dt
            x[k, t] = px
            y[k, t] = py
            yaw[k, t] = angle
            if w != turned_at:
                turn_sine, turn_cosine = sine_cosine(w * dt)
                turned_at = w
            sine, cosine = (
                sine * turn_cosine + cosine * turn_sine,
                cosine * turn_cosine - sine * turn_sine,
            )
        for t in range(steps[k] + 1, length):
            x[k, t] = px
            y[k, t] = py
            yaw[k, t] = angle


@njit()
def add_weighted(raw: FloatArray, scales: Float32Array) -> Float32Array:
    """Totals (K,) of raw scores (C, K), accumulated in float32 as ``TrajectoryScore`` does."""
    totals = np.zeros(raw.shape[1], dtype=np.float32)
    for c in range(len(raw)):
        scale = np.float64(scales[c])
        if scale != 0.0:
            for k in range(raw.shape[1]):
                totals[k] = np.float32(np.float64(totals[k]) + raw[c, k] * scale)
    return totals
