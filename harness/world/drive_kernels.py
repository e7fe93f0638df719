"""The drive of a differential-drive robot: wheel forces that follow a velocity command within friction."""

import math

import numpy as np
from numba import njit

from harness.world.robot import RobotParams
from navstack.types import FloatArray

TRACTION_TILT = 0.5  # [rad] beyond which the driven wheels have left the ground


def drive_constants(robot: RobotParams, gravity: float, dt: float) -> FloatArray:
    """The constants (12,) of :func:`drive_wrench`, in its order, SI units."""
    return np.array(
        (
            dt,
            robot.mass,
            robot.inertia[2],
            -robot.center[0],
            robot.wheel_friction * robot.mass * gravity,
            robot.max_drive_force,
            0.5 * robot.track,
            robot.max_acceleration,
            robot.max_deceleration,
            robot.max_yaw_acceleration,
            max(robot.servo_time_constant, dt),
            robot.mass * gravity,
        )
    )


@njit(cache=True)
def step_towards(now, target, dt, time_constant, up, down):
    """The next value of a first-order servo, its rate limited by ``up`` away from zero and ``down`` towards zero."""
    change = (target - now) * dt / time_constant
    limit = dt * (up if change * now >= 0.0 else down)
    return now + min(max(change, -limit), limit)


@njit(cache=True)
def wheel_forces(along, sideways, couple, grip, max_force, half_track):
    """Forces [N] and couple [N m] that the two driven wheels can give of those asked for.

    Each wheel is limited by its motor, and by a friction circle of half the ``grip`` [N] that scales its force as a
    whole (Coulomb; textbook).
    """
    left = min(max(0.5 * along - 0.5 * couple / half_track, -0.5 * max_force), 0.5 * max_force)
    right = min(max(0.5 * along + 0.5 * couple / half_track, -0.5 * max_force), 0.5 * max_force)
    side = 0.5 * sideways
    norm_left, norm_right = math.hypot(left, side), math.hypot(right, side)
    scale_left = 0.5 * grip / norm_left if norm_left > 0.5 * grip else 1.0
    scale_right = 0.5 * grip / norm_right if norm_right > 0.5 * grip else 1.0
    left, right = left * scale_left, right * scale_right
    return left + right, side * (scale_left + scale_right), (right - left) * half_track


@njit(cache=True)
def drive_wrench(qx, qy, qz, qw, vx, vy, yaw_rate, height, speed_command, yaw_rate_command, constants):
    """Force [N] and torque [N m] about the centre of mass, map frame: drive and weight of the robot.

    The wheels follow the command as a first-order servo with limited acceleration and hold the axle sideways (no slip).
    The forces attack at the ground below the axle, so that braking pitches the body. Simplifications: the driven wheels
    carry the whole weight evenly whatever the tilt up to ``TRACTION_TILT``, and nothing beyond.

    Takes the orientation (quaternion), the velocity of the centre of mass [m/s] and the yaw rate [rad/s] in the map
    frame, the height [m] of the centre of mass above ground, the command (forward [m/s], yaw rate [rad/s]) and the
    constants (12,) of :func:`drive_constants`.
    """
    dt, mass, inertia, lever, grip, max_force, half_track = constants[:7]
    up, down, yaw_up, time_constant, weight = constants[7:]
    if 1.0 - 2.0 * (qx * qx + qy * qy) < math.cos(TRACTION_TILT):
        return 0.0, 0.0, -weight, 0.0, 0.0, 0.0
    yaw = math.atan2(2.0 * (qw * qz + qx * qy), 1.0 - 2.0 * (qy * qy + qz * qz))
    cos, sin = math.cos(yaw), math.sin(yaw)
    forward, left = cos * vx + sin * vy, -sin * vx + cos * vy  # [m/s] of the centre of mass, heading frame

    speed = step_towards(forward, speed_command, dt, time_constant, up, down)
    turn = step_towards(yaw_rate, yaw_rate_command, dt, time_constant, yaw_up, yaw_up)

    # The centre of mass lies `lever` behind the axle: its velocity next step, seen from the heading now.
    ahead, aside = math.cos(turn * dt), math.sin(turn * dt)
    along = mass * (speed * ahead + turn * lever * aside - forward) / dt
    sideways = mass * (speed * aside - turn * lever * ahead - left) / dt
    couple = inertia * (turn - yaw_rate) / dt - sideways * lever
    along, sideways, couple = wheel_forces(along, sideways, couple, grip, max_force, half_track)

    fx, fy = cos * along - sin * sideways, sin * along + cos * sideways
    return fx, fy, -weight, height * fy, -height * fx, couple + sideways * lever
