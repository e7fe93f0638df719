"""The drive of a differential-drive robot.

Wheel forces that follow a velocity command within friction.
"""

import math

import numpy as np

from harness.world.physics.motion_kernels import Quaternion, Vector, heading, rotate
from harness.world.physics.robot import RobotParams
from navstack.jit import njit
from navstack.types import FloatArray, FloatVector

# [N] wheel load that says: standing on level ground, the driven wheels grip with the whole weight
LEVEL = -1.0


# Places in the array of constants; an array is quicker to hand over than a named tuple.
DT = 0  # [s] of a step
MASS = 1  # [kg]
INERTIA = 2  # [kg m2] about the vertical axis
LEVER = 3  # [m] from the centre of mass forward to the axle
HEIGHT = 4  # [m] of the centre of mass
WEIGHT = 5  # [N]
HALF_TRACK = 6  # [m]
FRICTION = 7  # [-] of the wheels
MOTOR_LIMIT = 8  # [N] of one motor at its wheel
ROLLING_RESISTANCE = 9  # [-] of the weight
ACCELERATION = 10  # [m/s2] at most
DECELERATION = 11  # [m/s2] at most
YAW_ACCELERATION = 12  # [rad/s2] at most
TIME_CONSTANT = 13  # [s] of the servo
ROLLING_MASS = 14  # [kg] that a sideways force at the ground moves where the robot may roll


def drive_constants(robot: RobotParams, gravity: float, dt: float) -> FloatArray:
    """The constants (15,) of :func:`drive_forces`, SI units."""
    rolling = robot.mass * robot.center_of_mass_height**2 / robot.inertia[0]
    constants = np.empty(15)
    constants[DT] = dt
    constants[MASS] = robot.mass
    constants[INERTIA] = robot.inertia[2]
    constants[LEVER] = -robot.center_of_mass_x
    constants[HEIGHT] = robot.center_of_mass_height
    constants[WEIGHT] = robot.mass * gravity
    constants[HALF_TRACK] = 0.5 * robot.track
    constants[FRICTION] = robot.wheel_friction
    constants[MOTOR_LIMIT] = 0.5 * robot.max_drive_force
    constants[ROLLING_RESISTANCE] = robot.rolling_resistance
    constants[ACCELERATION] = robot.max_acceleration
    constants[DECELERATION] = robot.max_deceleration
    constants[YAW_ACCELERATION] = robot.max_yaw_acceleration
    constants[TIME_CONSTANT] = max(robot.servo_time_constant, dt)
    constants[ROLLING_MASS] = robot.mass / (1.0 + rolling)
    return constants


@njit()
def step_towards(
    now: float, target: float, dt: float, time_constant: float, up: float, down: float
) -> float:
    """The next value of a first-order servo.

    Its rate is limited by ``up`` away from zero and by ``down`` towards zero.
    """
    change = (target - now) * dt / time_constant
    limit = dt * (up if change * now >= 0.0 else down)
    return now + min(max(change, -limit), limit)


@njit()
def within_friction(
    left: float, right: float, sideways: float, left_load: float, right_load: float, friction: float
) -> tuple[float, float, float, float]:
    """What friction lets through of the asked forces [N].

    Left forward, left sideways, right forward, right sideways.

    The axle's force sideways divides as the loads do; each wheel's force is scaled as a whole into
    the circle ``friction * load`` (Coulomb; textbook).
    """
    load = left_load + right_load
    if load <= 0.0:
        return 0.0, 0.0, 0.0, 0.0
    left_side, right_side = sideways * left_load / load, sideways * right_load / load
    norm_left, norm_right = math.hypot(left, left_side), math.hypot(right, right_side)
    scale_left = min(1.0, friction * left_load / norm_left) if norm_left > 0.0 else 1.0
    scale_right = min(1.0, friction * right_load / norm_right) if norm_right > 0.0 else 1.0
    return scale_left * left, scale_left * left_side, scale_right * right, scale_right * right_side


@njit()
def motor_forces(
    along: float, couple: float, half_track: float, limit: float
) -> tuple[float, float]:
    """Forces [N] of the left and the right motor for a force [N] and a couple [N m].

    Each gives at most ``limit``.
    """
    left, right = 0.5 * along - 0.5 * couple / half_track, 0.5 * along + 0.5 * couple / half_track
    return min(max(left, -limit), limit), min(max(right, -limit), limit)


@njit()
def grip(
    left: float,
    right: float,
    sideways: float,
    left_load: float,
    right_load: float,
    constants: FloatArray,
) -> tuple[float, float, float, float]:
    """The forces of :func:`within_friction`, with loads [N] that may be ``LEVEL``.

    Half the weight each.
    """
    if left_load == LEVEL:
        left_load = right_load = 0.5 * constants[WEIGHT]
    return within_friction(left, right, sideways, left_load, right_load, constants[FRICTION])


@njit()
def mechanical_power(
    left: float, right: float, forward: float, turn: float, along: float, constants: FloatArray
) -> float:
    """Power [W] that the motors deliver to two wheels pushing with ``left`` and ``right`` [N].

    Each wheel works against its force and half the rolling resistance of the whole weight; braking
    gives nothing back. ``forward`` [m/s] and ``turn`` [rad/s] are the robot's motion before the
    step, ``along`` [N] the force that changes it.
    """
    resistance = 0.5 * constants[ROLLING_RESISTANCE] * constants[WEIGHT]
    # in the middle of the step
    speed = forward + 0.5 * constants[DT] * along / constants[MASS]
    left_speed = speed - turn * constants[HALF_TRACK]
    right_speed = speed + turn * constants[HALF_TRACK]
    left_power = max(left * left_speed + resistance * abs(left_speed), 0.0)
    return float(left_power + max(right * right_speed + resistance * abs(right_speed), 0.0))


@njit()
def tread_velocity(
    yaw: float, velocity: Vector, spin: Vector, height: float, is_level: bool
) -> tuple[float, float]:
    """Velocity [m/s] of the treads below the centre of mass, forward and to the left.

    Args:
        yaw: [rad] of the body.
        velocity: [m/s] of the centre of mass, map frame.
        spin: [rad/s], map frame.
        height: [m] of the centre of mass.
        is_level: whether pitching and rolling, which move the treads as well, do not count.
    """
    cos, sin = math.cos(yaw), math.sin(yaw)
    forward = cos * velocity[0] + sin * velocity[1]
    left = -sin * velocity[0] + cos * velocity[1]
    if not is_level:
        forward -= (cos * spin[1] - sin * spin[0]) * height
        left += (cos * spin[0] + sin * spin[1]) * height
    return forward, left


@njit()
def asked_forces(
    forward: float,
    left: float,
    yaw_rate: float,
    speed: float,
    turn: float,
    held: float,
    constants: FloatArray,
) -> tuple[float, float, float]:
    """Forces [N] of the left and the right motor, and sideways at the axle, for the next step.

    Args:
        forward: [m/s] of the centre of mass.
        left: [m/s].
        yaw_rate: [rad/s].
        speed: [m/s] forward that is wanted.
        turn: [rad/s] that is wanted.
        held: [kg] that holding the axle sideways must stop.
        constants: (15,) of :func:`drive_constants`.
    """
    dt, mass, inertia = constants[DT], constants[MASS], constants[INERTIA]
    lever, half_track, limit = constants[LEVER], constants[HALF_TRACK], constants[MOTOR_LIMIT]
    # The centre of mass lies `lever` behind the axle: its velocity next step, seen from the heading
    # now.
    ahead, aside = math.cos(turn * dt), math.sin(turn * dt)
    along = mass * (speed * ahead + turn * lever * aside - forward) / dt
    sideways = held * (speed * aside - turn * lever * ahead - left) / dt
    couple = inertia * (turn - yaw_rate) / dt - sideways * lever
    left_motor, right_motor = motor_forces(along, couple, half_track, limit)
    if max(abs(left_motor), abs(right_motor)) >= limit:
        # Motors at their limit turn it otherwise; the ground still holds the axle sideways.
        couple = (right_motor - left_motor) * half_track
        ahead, aside = math.cos(yaw_rate * dt), math.sin(yaw_rate * dt)
        speed = forward + dt * (left_motor + right_motor) / mass
        turn = (couple * dt + inertia * yaw_rate + lever * held * (speed * aside - left)) / (
            inertia + held * lever * lever * ahead
        )
        sideways = held * (speed * aside - turn * lever * ahead - left) / dt
    return left_motor, right_motor, sideways


@njit(ahead=True)
def drive_forces(
    orientation: Quaternion,
    velocity: Vector,
    spin: Vector,
    left_load: float,
    right_load: float,
    speed_command: float,
    yaw_rate_command: float,
    constants: FloatVector,
) -> tuple[Vector, Vector, float]:
    """Force [N], torque [N m] about the centre of mass and motors' power [W] of drive and weight.

    The wheels follow the command as a first-order servo with limited acceleration and hold the axle
    sideways (no slip). Their forces attack where they stand, so that braking pitches the body.
    Simplification: on level ground, touched by nothing, the driven wheels grip with the whole
    weight, as if the casters held sideways what they carry.

    Args:
        orientation: of the body; all in the map frame, as force and torque are.
        velocity: [m/s] of the centre of mass.
        spin: [rad/s].
        left_load: [N] of the left wheel, or ``LEVEL``.
        right_load: [N] of the right wheel.
        speed_command: [m/s] forward.
        yaw_rate_command: [rad/s].
        constants: (15,) of :func:`drive_constants`.
    """
    dt, time_constant = constants[DT], constants[TIME_CONSTANT]
    up, down, yaw_up = constants[ACCELERATION], constants[DECELERATION], constants[YAW_ACCELERATION]
    lever, height, half_track = constants[LEVER], constants[HEIGHT], constants[HALF_TRACK]
    is_level = left_load == LEVEL
    yaw = heading(orientation)
    yaw_rate = spin[2]
    forward, left = tread_velocity(yaw, velocity, spin, height, is_level)
    speed = step_towards(forward, speed_command, dt, time_constant, up, down)
    turn = step_towards(yaw_rate, yaw_rate_command, dt, time_constant, yaw_up, yaw_up)

    held = constants[MASS] if is_level else constants[ROLLING_MASS]
    left_motor, right_motor, sideways = asked_forces(
        forward, left, yaw_rate, speed, turn, held, constants
    )
    left_along, left_side, right_along, right_side = grip(
        left_motor, right_motor, sideways, left_load, right_load, constants
    )
    power = mechanical_power(
        left_along, right_along, forward, yaw_rate, left_along + right_along, constants
    )

    # the wheels' treads from the centre of mass
    cos, sin = math.cos(yaw), math.sin(yaw)
    lx, ly, lz = rotate(orientation, lever, half_track, -height)
    rx, ry, rz = rotate(orientation, lever, -half_track, -height)
    lfx, lfy = cos * left_along - sin * left_side, sin * left_along + cos * left_side
    rfx, rfy = cos * right_along - sin * right_side, sin * right_along + cos * right_side
    tx, ty = -lz * lfy - rz * rfy, lz * lfx + rz * rfx
    tz = lx * lfy - ly * lfx + rx * rfy - ry * rfx
    return (lfx + rfx, lfy + rfy, -constants[WEIGHT]), (tx, ty, tz), power
