"""One Gauss-Newton step of the tracking problem in CasADi.

Linearise, then solve the quadratic program with HPIPM.

The cost is a sum of squares of residuals, see docs/mpc.md; limits of jerks, accelerations and
velocities are bounds of the quadratic program, everything else is soft. The linearisation is
generated as C and compiled where a compiler exists (:mod:`~navstack.control.mpc.compiled`).
"""

from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np

from navstack.control.mpc import robot_model
from navstack.control.mpc import stage_layout as at
from navstack.control.mpc.compiled import compiled
from navstack.control.mpc.stage_layout import Horizon, Sizes
from navstack.control.mpc.stages import best_between
from navstack.types import FloatArray

_X = robot_model.STATES
_U = robot_model.INPUTS
_ROW = _U + _X  # variables of a step: its input, then the state at its end
# on the diagonal of every Hessian block, so that the program is strictly convex
_REGULARISATION = 1e-6
_ACCELERATION = _U + 5  # of a row
_TOLERANCE = 1e-4  # of bounds and model in a solution
# by which bounds of states are wider than the limits, for rounding; the output keeps the limits
_SLACK = 1e-4


class MpcProblem:
    """The problem of one size, made once; :meth:`step` improves a trajectory."""

    def __init__(self, sizes: Sizes, generated_code: bool) -> None:
        """Make the problem.

        Args:
            sizes: steps, circles and people.
            generated_code: use compiled C where there is a compiler.
        """
        function, self.is_compiled = _gauss_newton_step(sizes, generated_code)
        steps = sizes.steps
        self._states = np.zeros((steps, _X))
        self._ends = np.zeros((steps, _X))
        self._jerks = np.zeros((steps, _U))
        self._stages = np.zeros((steps, sizes.stage))
        self._shared = np.zeros(sizes.shared)
        self._times = np.zeros(steps)
        self._low = np.zeros((steps, _ROW))
        self._high = np.zeros((steps, _ROW))
        self._change = np.zeros((steps, _ROW))
        self._buffer, self._evaluate = function.buffer()
        buffer: Any = self._buffer
        inputs = (
            self._states,
            self._jerks,
            self._ends,
            self._stages,
            self._times,
            self._shared,
            self._low,
            self._high,
        )
        for i, array in enumerate(inputs):
            buffer.set_arg(i, array.reshape(-1).data)
        buffer.set_res(0, self._change.reshape(-1).data)

    def step(
        self, states: FloatArray, jerks: FloatArray, horizon: Horizon, limits: FloatArray
    ) -> FloatArray | None:
        """The jerks (N, 2) on the way to the minimum of the problem linearised about a trajectory.

        None: it failed.

        Args:
            states: the trajectory's (N + 1, 7), a rollout of ``jerks``.
            jerks: (N, 2).
            horizon: see :mod:`~navstack.control.mpc.stage_layout`.
            limits: lower and upper (2, 9) of the jerks and the states at the steps' ends.
        """
        self._states[:] = states[:-1]
        self._ends[:] = states[1:]
        self._jerks[:] = jerks
        self._stages[:], self._times[:], self._shared[:] = horizon
        for bounds, limit, slack in (
            (self._low, limits[0], -_SLACK),
            (self._high, limits[1], _SLACK),
        ):
            bounds[:, :_U] = limit[:_U] - jerks
            bounds[:, _U:] = limit[_U:] + slack - states[1:]
        is_sound = (
            np.isfinite(horizon.stages).all()
            and np.isfinite(states).all()
            and (self._low <= self._high).all()
        )
        self._change[:] = np.nan
        if is_sound:  # or CasADi prints the whole problem
            self._evaluate()
        if not self._is_solved():
            return None
        wanted = np.clip(jerks + self._change[:, :_U], limits[0, :_U], limits[1, :_U])
        improved: FloatArray = best_between(states[0], jerks, wanted, horizon)
        return improved

    def _is_solved(self) -> bool:
        """Whether what came back is a solution.

        HPIPM's own verdict does not get through to here.
        """
        change = self._change
        times = self._times
        # false for nan
        within = (change >= self._low - _TOLERANCE) & (change <= self._high + _TOLERANCE)
        # 0 if the model holds
        faster = np.diff(change[:, _ACCELERATION], prepend=0.0) - times * change[:, 0]
        return bool(within.all() and np.abs(faster).max() < _TOLERANCE)


def residuals(state: ca.SX, stage: ca.SX, shared: ca.SX, sizes: Sizes) -> list[ca.SX]:
    """Unweighted residuals of the state (7,) at a step's end, by the first 8 of the weights."""
    x, y, yaw, v, omega, _acceleration, alpha = ca.vertsplit(state)
    dx = x - stage[at.FOOT_X]
    dy = y - stage[at.FOOT_Y]
    along = stage[at.TANGENT_X]
    across = stage[at.TANGENT_Y]
    lateral = v * omega
    obstacles = []
    people = []
    for i in range(sizes.circles):
        offset = shared[at.CIRCLES + i]
        cx = x + offset * ca.cos(yaw)
        cy = y + offset * ca.sin(yaw)
        plane = at.BASE + 3 * i
        obstacles.append(ca.fmax(0.0, stage[plane + 2] - stage[plane] * cx - stage[plane + 1] * cy))
        for j in range(sizes.people):
            person = at.BASE + 3 * sizes.circles + 3 * j
            px = cx - stage[person]
            py = cy - stage[person + 1]
            distance = ca.sqrt(px * px + py * py + at.SOFTENED)
            people.append(ca.fmax(0.0, stage[person + 2] - distance))
    limit = shared[at.LATERAL_LIMIT]
    return [
        ca.sqrt(stage[at.CONTOUR]) * (along * dy - across * dx),
        along * dx + across * dy - stage[at.LEAD],
        yaw - stage[at.HEADING],
        v - stage[at.SPEED],
        alpha,
        ca.fmax(0.0, ca.fabs(lateral) - limit),
        ca.vertcat(*obstacles),
        ca.vertcat(*people),
    ]


def linearisation(sizes: Sizes) -> ca.Function:
    """Of one step: the model's Jacobians, the cost's gradients and Gauss-Newton Hessians."""
    state = ca.SX.sym("state", _X)
    end = ca.SX.sym("end", _X)
    jerk = ca.SX.sym("jerk", _U)
    stage = ca.SX.sym("stage", sizes.stage)
    shared = ca.SX.sym("shared", sizes.shared)
    dt = ca.SX.sym("dt")
    after = robot_model.step(state, jerk, dt)
    terms = residuals(end, stage, shared, sizes)
    weighted = ca.vertcat(*(ca.sqrt(dt * shared[i]) * term for i, term in enumerate(terms)))
    efforts = ca.vertcat(
        ca.sqrt(dt * shared[at.W_JERK]) * (jerk[0] - stage[at.JERK]),
        ca.sqrt(dt * shared[at.W_YAW_JERK]) * jerk[1],
    )
    slope = ca.jacobian(weighted, end)
    effort_slope = ca.jacobian(efforts, jerk)
    outputs = [
        ca.jacobian(after, state),
        ca.jacobian(after, jerk),
        slope.T @ weighted,
        slope.T @ slope + _REGULARISATION * ca.SX.eye(_X),
        effort_slope.T @ efforts,
        effort_slope.T @ effort_slope + _REGULARISATION * ca.SX.eye(_U),
    ]
    inputs = [state, jerk, end, stage, dt, shared]
    return ca.Function("linearisation", inputs, [ca.cse(ca.densify(output)) for output in outputs])


@lru_cache(maxsize=4)
def _gauss_newton_step(sizes: Sizes, generated_code: bool) -> tuple[ca.Function, bool]:
    """The whole step as one function, and whether its linearisation is compiled."""
    steps = sizes.steps
    mapped = linearisation(sizes).map("linearise", "serial", steps, [5], [])
    linearise = compiled(mapped) if generated_code else None
    shapes = (
        (_X, steps),
        (_U, steps),
        (_X, steps),
        (sizes.stage, steps),
        (1, steps),
        (sizes.shared, 1),
    )
    symbols = [ca.MX.sym(f"i{k}", *shape) for k, shape in enumerate(shapes)]
    low = ca.MX.sym("low", _ROW * steps)
    high = ca.MX.sym("high", _ROW * steps)
    by_state, by_jerk, slope, curvature, jerk_slope, jerk_curvature = (linearise or mapped)(
        *symbols
    )
    a_pattern, a_order = _dynamics_pattern(steps)
    h_pattern, h_order = _hessian_pattern(steps)
    dynamics = ca.MX(a_pattern, ca.vertcat(ca.vec(by_state), ca.vec(by_jerk), -1.0)[a_order])
    hessian = ca.MX(h_pattern, ca.vertcat(ca.vec(curvature), ca.vec(jerk_curvature))[h_order])
    structure = {
        "N": steps,
        "nx": [0] + [_X] * steps,
        "nu": [_U] * steps + [0],
        "ng": [0] * (steps + 1),
    }
    options: dict[str, Any] = {"hpipm": {"mode": "speed_abs"}, "error_on_fail": False, **structure}
    solver = ca.conic("program", "hpipm", {"h": h_pattern, "a": a_pattern}, options)
    zero = ca.DM.zeros(_X * steps)
    solved = solver(
        h=hessian,
        g=ca.vec(ca.vertcat(jerk_slope, slope)),
        a=dynamics,
        lba=zero,
        uba=zero,
        lbx=low,
        ubx=high,
    )
    # HPIPM's interface writes its multipliers and cost even where nobody asks, so all are outputs.
    outputs = [solved[name] for name in ("x", "cost", "lam_a", "lam_x")]
    function = ca.Function("gauss_newton_step", [*symbols, low, high], outputs)
    return function, linearise is not None


def _dynamics_pattern(steps: int) -> tuple[ca.Sparsity, list[int]]:
    """Sparsity of A z = 0, and where each entry stands in (by_state, by_jerk, -1).

    z = (u0, x1, u1, x2, ...).
    """
    states = _X * _X * steps
    jerks = _X * _U * steps
    by_state = ca.horzsplit(_numbers(0, _X, _X * steps), _X)
    by_jerk = ca.horzsplit(_numbers(states, _X, _U * steps), _U)
    minus_one = (states + jerks) * ca.DM.eye(_X)
    here = ca.diagcat(*(ca.horzcat(block, minus_one) for block in by_jerk))
    # of the first step: fixed
    before = ca.diagcat(*(ca.horzcat(ca.DM(_X, _U), block) for block in by_state[1:]))
    return _ordered(here + ca.diagcat(ca.DM(_X, 0), before, ca.DM(0, _ROW)))


def _hessian_pattern(steps: int) -> tuple[ca.Sparsity, list[int]]:
    """Sparsity of the Hessian, and where each entry stands in (curvature, jerk_curvature).

    The Hessian is block-diagonal.
    """
    by_state = ca.horzsplit(_numbers(0, _X, _X * steps), _X)
    by_jerk = ca.horzsplit(_numbers(_X * _X * steps, _U, _U * steps), _U)
    return _ordered(
        ca.diagcat(*(block for pair in zip(by_jerk, by_state, strict=True) for block in pair))
    )


def _numbers(first: int, rows: int, columns: int) -> ca.DM:
    """A matrix of the numbers from ``first`` on, column by column."""
    return ca.reshape(ca.DM(range(first, first + rows * columns)), rows, columns)


def _ordered(places: ca.DM) -> tuple[ca.Sparsity, list[int]]:
    """The sparsity of a matrix, and its entries in CasADi's order."""
    return places.sparsity(), [int(place) for place in places.nonzeros()]
