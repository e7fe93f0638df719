"""The robot as the optimiser sees it: a unicycle driven by linear and angular jerk (symbolic).

State: x [m], y [m], yaw [rad], v [m/s], omega [rad/s], a [m/s2], alpha [rad/s2]; input: linear jerk
[m/s3], angular jerk [rad/s3], both constant over a step. Speed and yaw are polynomials of time
within a step and are exact; the position is Simpson's rule over the step.
:mod:`~navstack.control.mpc.motion` is the same model in numba.
"""

import casadi as ca

STATES = 7
INPUTS = 2


def step(state: ca.SX, jerk: ca.SX, dt: ca.SX) -> ca.SX:
    """The state (7,) after ``dt`` [s] under ``jerk`` (2,)."""
    x, y, yaw, v, omega, a, alpha = ca.vertsplit(state)
    j, ja = ca.vertsplit(jerk)
    half = 0.5 * dt
    v_mid = v + half * (a + 0.5 * half * j)
    yaw_mid = yaw + half * (omega + half * (alpha / 2.0 + half * ja / 6.0))
    v_end = v + dt * (a + half * j)
    yaw_end = yaw + dt * (omega + dt * (alpha / 2.0 + dt * ja / 6.0))
    along_x = v * ca.cos(yaw) + 4.0 * v_mid * ca.cos(yaw_mid) + v_end * ca.cos(yaw_end)
    along_y = v * ca.sin(yaw) + 4.0 * v_mid * ca.sin(yaw_mid) + v_end * ca.sin(yaw_end)
    omega_end = omega + dt * (alpha + half * ja)
    return ca.vertcat(
        x + dt / 6.0 * along_x,
        y + dt / 6.0 * along_y,
        yaw_end,
        v_end,
        omega_end,
        a + dt * j,
        alpha + dt * ja,
    )
