"""The fastest stop under limits of acceleration and jerk, and the jerks that still allow it.

One axis has a rate v and its derivative a; ``|jerk| <= jerk_limit``. The fastest way to (0, 0) is:
full jerk until the largest wanted deceleration, hold, full jerk back (the textbook double-S
profile, e.g. Biagiotti and Melchiorri, Trajectory Planning for Automatic Machines and Robots, 2008,
section 3.4). Its tail is the fastest stop from where it begins, so a stop once begun needs no
memory.
"""

import math
from typing import NamedTuple

from navstack.jit import njit

_CLOSE = 1e-8  # [m] by which a stop may end too early


class AxisMotion(NamedTuple):
    """How far an axis has come, its rate v and that rate's derivative a."""

    distance: float
    rate: float
    change: float


@njit()
def stop_phases(
    v: float, a: float, deceleration: float, jerk: float
) -> tuple[float, float, float, float]:
    """The fastest stop: sign s and durations t1, t2, t3 in [s] of jerk -s J, 0 and +s J."""
    sign = -1.0
    if v + a * abs(a) / (2.0 * jerk) >= 0.0:
        sign = 1.0
    v = sign * v
    a = sign * a
    peak = math.sqrt(max(0.0, jerk * v + 0.5 * a * a))  # largest deceleration if it is never held
    hold = 0.0
    if peak > deceleration:
        hold = (v + (a * a - 2.0 * deceleration * deceleration) / (2.0 * jerk)) / deceleration
        peak = deceleration
    return sign, max(0.0, (a + peak) / jerk), max(0.0, hold), peak / jerk


@njit()
def stop_time(v: float, a: float, deceleration: float, jerk: float) -> float:
    """How long the fastest stop takes, in [s]."""
    phases = stop_phases(v, a, deceleration, jerk)
    return phases[1] + phases[2] + phases[3]


@njit()
def stop_after(
    v: float,
    a: float,
    deceleration: float,
    jerk: float,
    time: float,
) -> AxisMotion:
    """The motion ``time`` [s] after the fastest stop began; at rest once it is over."""
    sign, t1, t2, t3 = stop_phases(v, a, deceleration, jerk)
    distance = 0.0
    for phase in range(3):
        if phase == 0:
            span = t1
            j = -sign * jerk
        elif phase == 1:
            span = t2
            j = 0.0
        else:
            span = t3
            j = sign * jerk
        t = min(span, time)
        distance += t * (v + t * (a / 2.0 + t * j / 6.0))
        v += t * (a + 0.5 * t * j)
        a += t * j
        time -= t
        if time <= 0.0 and t < span:
            return AxisMotion(distance, v, a)
    return AxisMotion(distance, 0.0, 0.0)


@njit()
def stop_distance(v: float, a: float, deceleration: float, jerk: float) -> float:
    """How far the fastest stop goes, in [m] resp. [rad]."""
    return stop_after(v, a, deceleration, jerk, math.inf).distance


@njit()
def highest_jerk(
    v: float,
    a: float,
    rate_limit: float,
    acceleration: float,
    jerk: float,
    dt: float,
) -> float:
    """The largest jerk for ``dt`` [s] after which ``v <= rate_limit`` can be kept for ever.

    The next derivative b obeys b <= acceleration and, where it is positive, v + dt (a + b) / 2 +
    b^2 / (2 J) <= rate_limit. At least -J is returned, so from outside the limits it leads back.
    """
    room = rate_limit - v - 0.5 * dt * a
    half = 0.5 * jerk * dt
    b = 2.0 * room / dt
    if room > 0.0:
        b = math.sqrt(half * half + 2.0 * jerk * room) - half
    return min(jerk, max(-jerk, (min(b, acceleration) - a) / dt))


@njit()
def lowest_jerk(
    v: float,
    a: float,
    rate_limit: float,
    deceleration: float,
    jerk: float,
    dt: float,
) -> float:
    """The smallest jerk for ``dt`` [s] after which ``v >= rate_limit`` can be kept for ever."""
    return -highest_jerk(-v, -a, -rate_limit, deceleration, jerk, dt)


@njit()
def progress_jerk(
    v: float,
    a: float,
    remaining: float,
    speed: float,
    acceleration: float,
    deceleration: float,
    jerk: float,
    dt: float,
) -> float:
    """The jerk [m/s3] that gains most way in ``dt`` [s] and can stop within ``remaining`` [m].

    Applied again and again it is the fastest way to stand ``remaining`` ahead without exceeding
    ``speed`` [m/s]; from above ``speed`` it comes down to it as fast as the limits allow.
    """
    lowest = lowest_jerk(v, a, 0.0, deceleration, jerk, dt)
    wanted = highest_jerk(v, a, speed, acceleration, jerk, dt)
    if v + a * abs(a) / (2.0 * jerk) > speed:
        wanted = max(wanted, lowest_jerk(v, a, speed, deceleration, jerk, dt))
    wanted = max(wanted, lowest)
    too_far = _overshoot(v, a, wanted, remaining, deceleration, jerk, dt)
    if too_far <= 0.0:
        return wanted
    too_near = _overshoot(v, a, lowest, remaining, deceleration, jerk, dt)
    last = 0
    for _ in range(30):  # the largest jerk after which the stop fits: regula falsi, Illinois
        if too_near > -_CLOSE:  # close enough, or too far even so
            break
        middle = lowest - too_near * (wanted - lowest) / (too_far - too_near)
        over = _overshoot(v, a, middle, remaining, deceleration, jerk, dt)
        if over <= 0.0:
            lowest = middle
            too_near = over
            if last == -1:
                too_far *= 0.5
            last = -1
        else:
            wanted = middle
            too_far = over
            if last == 1:
                too_near *= 0.5
            last = 1
    return lowest


@njit()
def _overshoot(
    v: float,
    a: float,
    j: float,
    remaining: float,
    deceleration: float,
    jerk: float,
    dt: float,
) -> float:
    """How far beyond ``remaining`` [m] the fastest stop ends after jerk ``j`` for ``dt`` [s]."""
    way = dt * (v + dt * (a / 2.0 + dt * j / 6.0))
    return (
        way + stop_distance(v + dt * (a + 0.5 * dt * j), a + dt * j, deceleration, jerk) - remaining
    )
