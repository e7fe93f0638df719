"""The numba twin of :mod:`~navstack.control.mpc.mpc_problem`: iLQR with clamped inputs, for large studies.

Same model, same cost. The bounds of the jerks are kept in the backward pass (control-limited differential dynamic
programming: Tassa, Mansard and Todorov, ICRA 2014, here with two inputs, so that clamping one leaves a scalar problem);
those of velocities and accelerations are quadratic penalties, as the command is projected onto them anyway.
"""

import math

import numpy as np

from navstack.control.mpc import stage_layout as at
from navstack.control.mpc.ilqr_model import BOUND_WEIGHT, COLUMNS, REGULARISATION, ROWS, add_stage, jacobians
from navstack.control.mpc.motion import advance
from navstack.control.mpc.stage_layout import Sizes
from navstack.control.mpc.stages import cost_terms
from navstack.jit import njit
from navstack.types import FloatArray

_ITERATIONS = 2  # backward and forward passes per step, at most
_ENOUGH = 1e-3  # share of the cost gained by a pass, below which no other is tried
_STEPS = (1.0, 0.5, 0.25, 0.1, 0.03)  # shares of the feedforward, of which the first that lowers the cost is taken


class IlqrSolver:
    """Improves a trajectory; the same interface as ``MpcProblem``."""

    def __init__(self, sizes: Sizes) -> None:
        self._people = sizes.people

    def step(
        self,
        states: FloatArray,
        jerks: FloatArray,
        stages: FloatArray,
        times: FloatArray,
        shared: FloatArray,
        limits: FloatArray,
    ) -> FloatArray | None:
        """The improved jerks (N, 2); None: they are not finite. See ``MpcProblem.step``."""
        improved: FloatArray = iterate(states, jerks, stages, times, shared, limits, self._people, _ITERATIONS)
        return improved if np.isfinite(improved).all() else None


@njit(cache=True)
def iterate(
    states: FloatArray,
    jerks: FloatArray,
    stages: FloatArray,
    times: FloatArray,
    shared: FloatArray,
    limits: FloatArray,
    people: int,
    iterations: int,
) -> FloatArray:
    """Jerks (N, 2) after a number of backward and forward passes; see :class:`IlqrSolver`."""
    states, jerks = states.copy(), jerks.copy()
    for k in range(len(jerks)):
        for i in range(2):
            jerks[k, i] = min(limits[1, i], max(limits[0, i], jerks[k, i]))
    cost = total_cost(states, jerks, stages, times, shared, limits, people)
    for _ in range(iterations):
        before = cost
        feedforward, gains = backward(states, jerks, stages, times, shared, limits, people)
        for step in _STEPS:
            new_states, new_jerks = forward(states, jerks, step * feedforward, gains, times, limits)
            new_cost = total_cost(new_states, new_jerks, stages, times, shared, limits, people)
            if new_cost < cost:
                states, jerks, cost = new_states, new_jerks, new_cost
                break
        if before - cost <= _ENOUGH * before:
            break
    return jerks


@njit(cache=True)
def total_cost(
    states: FloatArray,
    jerks: FloatArray,
    stages: FloatArray,
    times: FloatArray,
    shared: FloatArray,
    limits: FloatArray,
    people: int,
) -> float:
    """The cost of a trajectory with the penalties for exceeded bounds."""
    terms = cost_terms(states, jerks, stages, times, shared, people)
    total = 0.0
    for i in range(len(terms)):
        total += shared[i] * terms[i]
    for k in range(len(jerks)):
        for i in range(3, 7):
            out = max(states[k + 1, i] - limits[1, 2 + i], limits[0, 2 + i] - states[k + 1, i], 0.0)
            total += times[k] * BOUND_WEIGHT * out * out
    return total


@njit(cache=True)
def forward(
    states: FloatArray,
    jerks: FloatArray,
    feedforward: FloatArray,
    gains: FloatArray,
    times: FloatArray,
    limits: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """The trajectory under the policy that the backward pass found."""
    new_states, new_jerks = np.empty_like(states), np.empty_like(jerks)
    new_states[0] = states[0]
    for k in range(len(jerks)):
        for i in range(2):
            jerk = jerks[k, i] + feedforward[k, i]
            for c in range(7):
                jerk += gains[k, i, c] * (new_states[k, c] - states[k, c])
            new_jerks[k, i] = min(limits[1, i], max(limits[0, i], jerk))
        advance(new_states[k], new_jerks[k, 0], new_jerks[k, 1], times[k], new_states[k + 1])
    return new_states, new_jerks


@njit(cache=True)
def backward(
    states: FloatArray,
    jerks: FloatArray,
    stages: FloatArray,
    times: FloatArray,
    shared: FloatArray,
    limits: FloatArray,
    people: int,
) -> tuple[FloatArray, FloatArray]:
    """Feedforward (N, 2) and gains (N, 2, 7) of the policy that is best for the linearised problem."""
    count = len(jerks)
    feedforward, gains = np.zeros((count, 2)), np.zeros((count, 2, 7))
    slope, curvature = np.zeros(7), np.zeros((7, 7))  # of the cost to go, by the state
    by_state, by_jerk, through = np.zeros(len(ROWS)), np.zeros((7, 2)), np.empty((7, 7))
    jerk_slope, jerk_curvature, mixed = np.empty(2), np.empty((2, 2)), np.empty((2, 7))
    for k in range(count - 1, -1, -1):
        dt = times[k]
        add_stage(slope, curvature, states[k + 1], stages[k], shared, limits, people, dt)
        jacobians(states[k], jerks[k], dt, by_state, by_jerk)
        through[:] = 0.0  # curvature times the Jacobian by the state
        for e in range(len(ROWS)):
            for r in range(7):
                through[r, COLUMNS[e]] += curvature[r, ROWS[e]] * by_state[e]
        _see_through_jerks(slope, curvature, through, by_jerk, jerk_slope, jerk_curvature, mixed)
        for i, weight in ((0, dt * shared[at.W_JERK]), (1, dt * shared[at.W_YAW_JERK])):
            wanted = stages[k, at.JERK] if i == 0 else 0.0
            jerk_slope[i] += weight * (jerks[k, i] - wanted)
            jerk_curvature[i, i] += weight + REGULARISATION
        clamped_policy(jerks[k], limits, jerk_slope, jerk_curvature, mixed, feedforward[k], gains[k])
        _see_through_model(slope, curvature, through, by_state)
        _add_policy(slope, curvature, jerk_slope, jerk_curvature, mixed, feedforward[k], gains[k])
    return feedforward, gains


@njit(cache=True)
def _see_through_jerks(
    slope: FloatArray,
    curvature: FloatArray,
    through: FloatArray,
    by_jerk: FloatArray,
    jerk_slope: FloatArray,
    jerk_curvature: FloatArray,
    mixed: FloatArray,
) -> None:
    """Write the cost to go by the jerks: gradient (2,), Hessian (2, 2) and the mixed one with the state (2, 7)."""
    jerk_slope[:], jerk_curvature[:], mixed[:] = 0.0, 0.0, 0.0
    for i in range(2):
        for r in range(7):
            jerk_slope[i] += by_jerk[r, i] * slope[r]
            for c in range(7):
                mixed[i, c] += by_jerk[r, i] * through[r, c]
                for j in range(2):
                    jerk_curvature[i, j] += by_jerk[r, i] * curvature[r, c] * by_jerk[c, j]


@njit(cache=True)
def _see_through_model(slope: FloatArray, curvature: FloatArray, through: FloatArray, by_state: FloatArray) -> None:
    """Replace the cost to go by that of the state one step earlier, without a policy."""
    later = slope.copy()
    slope[:], curvature[:] = 0.0, 0.0
    for e in range(len(ROWS)):
        slope[COLUMNS[e]] += by_state[e] * later[ROWS[e]]
        for c in range(7):
            curvature[COLUMNS[e], c] += by_state[e] * through[ROWS[e], c]


@njit(cache=True)
def _add_policy(
    slope: FloatArray,
    curvature: FloatArray,
    jerk_slope: FloatArray,
    jerk_curvature: FloatArray,
    mixed: FloatArray,
    feedforward: FloatArray,
    gains: FloatArray,
) -> None:
    """Add to the cost to go what the policy of a step changes."""
    for i in range(2):
        changed = jerk_slope[i] + jerk_curvature[i, 0] * feedforward[0] + jerk_curvature[i, 1] * feedforward[1]
        for r in range(7):
            slope[r] += gains[i, r] * changed + mixed[i, r] * feedforward[i]
            for c in range(7):
                fed_back = jerk_curvature[i, 0] * gains[0, c] + jerk_curvature[i, 1] * gains[1, c]
                curvature[r, c] += gains[i, r] * (mixed[i, c] + fed_back) + mixed[i, r] * gains[i, c]


@njit(cache=True)
def clamped_policy(
    jerk: FloatArray,
    limits: FloatArray,
    slope: FloatArray,
    curvature: FloatArray,
    mixed: FloatArray,
    feedforward: FloatArray,
    gains: FloatArray,
) -> None:
    """Minimise the quadratic in two jerks within their bounds; write the step (2,) and the gains (2, 7)."""
    determinant = curvature[0, 0] * curvature[1, 1] - curvature[0, 1] * curvature[1, 0]
    feedforward[0] = (curvature[0, 1] * slope[1] - curvature[1, 1] * slope[0]) / determinant
    feedforward[1] = (curvature[1, 0] * slope[0] - curvature[0, 0] * slope[1]) / determinant
    is_free = True
    for i in range(2):
        low, high = limits[0, i] - jerk[i], limits[1, i] - jerk[i]
        is_free = is_free and low <= feedforward[i] <= high
    if is_free:
        for c in range(7):
            gains[0, c] = (curvature[0, 1] * mixed[1, c] - curvature[1, 1] * mixed[0, c]) / determinant
            gains[1, c] = (curvature[1, 0] * mixed[0, c] - curvature[0, 0] * mixed[1, c]) / determinant
        return
    # One jerk lies on a bound: of the four edges the best, each with the other jerk free between its own bounds.
    least, best_0, best_1, free = math.inf, 0.0, 0.0, -1
    for i in range(2):
        j = 1 - i
        for bound in range(2):
            fixed = limits[bound, i] - jerk[i]
            low, high = limits[0, j] - jerk[j], limits[1, j] - jerk[j]
            wanted = -(slope[j] + curvature[j, i] * fixed) / curvature[j, j]
            other = min(high, max(low, wanted))
            first, second = (fixed, other) if i == 0 else (other, fixed)
            cost = slope[0] * first + slope[1] * second + curvature[0, 1] * first * second
            cost += 0.5 * (curvature[0, 0] * first * first + curvature[1, 1] * second * second)
            if cost < least:
                least, best_0, best_1 = cost, first, second
                free = j if low < wanted < high else -1
    feedforward[0], feedforward[1] = best_0, best_1
    gains[:] = 0.0
    if free >= 0:
        for c in range(7):
            gains[free, c] = -mixed[free, c] / curvature[free, free]
