"""The drive of a skid-steered robot: four driven wheels that slide sideways whenever it turns."""

import math

import numpy as np

from harness.world.physics.drive_kernels import LEVEL, step_towards, tread_velocity
from harness.world.physics.motion_kernels import Quaternion, Vector, heading, rotate
from harness.world.physics.robot import RobotParams
from navstack.jit import njit
from navstack.types import FloatArray, FloatVector

# Places in the array of constants; the last two hold what the wheels turn at, changed in place.
DT = 0  # [s] of a step
WEIGHT = 1  # [N]
FRONT = 2  # [m] from the centre of mass forward to the front wheels
REAR = 3  # [m] likewise to the rear wheels, negative
HEIGHT = 4  # [m] of the centre of mass
HALF_TRACK = 5  # [m]
FRICTION = 6  # [-] of the wheels
MOTOR_LIMIT = 7  # [N] of one side's motor at its wheels
ROLLING_RESISTANCE = 8  # [-] of the weight
ACCELERATION = 9  # [m/s2] at most
DECELERATION = 10  # [m/s2] at most
YAW_ACCELERATION = 11  # [rad/s2] at most
TIME_CONSTANT = 12  # [s] of the servo
STICK = 13  # [N s/m] of one wheel: force over slip, below which it does not slide
ARM = 14  # [m] of the tread's speed over a yaw rate: half the track that the controller counts on
SPEED, TURN = 15, 16  # [m/s] and [rad/s] of the wheels, as if they did not slide


def skid_constants(robot: RobotParams, gravity: float, dt: float) -> FloatArray:
    """The constants (17,) of :func:`skid_forces`, SI units; the wheels stand."""
    constants = np.zeros(17)
    constants[DT] = dt
    constants[WEIGHT] = robot.mass * gravity
    constants[FRONT] = 0.5 * robot.wheelbase - robot.center_of_mass_x
    constants[REAR] = -0.5 * robot.wheelbase - robot.center_of_mass_x
    constants[HEIGHT] = robot.center_of_mass_height
    constants[HALF_TRACK] = 0.5 * robot.track
    constants[FRICTION] = robot.wheel_friction
    constants[MOTOR_LIMIT] = 0.5 * robot.max_drive_force
    constants[ROLLING_RESISTANCE] = robot.rolling_resistance
    constants[ACCELERATION] = robot.max_acceleration
    constants[DECELERATION] = robot.max_deceleration
    constants[YAW_ACCELERATION] = robot.max_yaw_acceleration
    constants[TIME_CONSTANT] = max(robot.servo_time_constant, dt)
    # four wheels together stop any slip within a step, and none turns round
    farthest = max(constants[FRONT], -constants[REAR])
    reach = farthest**2 + constants[HALF_TRACK] ** 2
    constants[STICK] = 1.0 / (4.0 * dt * (1.0 / robot.mass + reach / robot.inertia[2]))
    constants[ARM] = 0.5 * robot.track * robot.track_multiplier
    return constants


@njit()
def sliding_force(
    along: float, aside: float, load: float, stick: float, friction: float
) -> tuple[float, float]:
    """Force [N] of a tread that slides by ``along`` and ``aside`` [m/s] over the ground.

    Against the slip: ``friction * load`` (Coulomb), or less where that would turn the slip round.
    """
    slip = math.hypot(along, aside)
    if slip == 0.0:
        return 0.0, 0.0
    force = min(stick * slip, friction * load)
    return force * along / slip, force * aside / slip


@njit(ahead=True)
def skid_forces(
    orientation: Quaternion,
    velocity: Vector,
    spin: Vector,
    left_load: float,
    right_load: float,
    speed_command: float,
    yaw_rate_command: float,
    constants: FloatVector,
) -> tuple[Vector, Vector, float]:
    """As :func:`drive_forces`, with four driven wheels.

    The wheels of a side turn alike and follow the command as a first-order servo. Each tread slides
    by the difference of its own motion and the ground's; friction acts against that slip. Turning
    on the spot at a steady rate, the forces' moments along and aside balance at a yaw rate of the
    treads' difference over ``track * (1 + (wheelbase / track)**2)`` (from Coulomb's law, with equal
    loads): the wider track that a controller's multiplier stands for.
    """
    dt, height, half_track = constants[DT], constants[HEIGHT], constants[HALF_TRACK]
    is_level = left_load == LEVEL
    if is_level:
        left_load = right_load = 0.5 * constants[WEIGHT]
    yaw = heading(orientation)
    yaw_rate = spin[2]
    cos, sin = math.cos(yaw), math.sin(yaw)
    forward, left = tread_velocity(yaw, velocity, spin, height, is_level)

    up, down, constant = constants[ACCELERATION], constants[DECELERATION], constants[TIME_CONSTANT]
    yaw_up = constants[YAW_ACCELERATION]
    speed = step_towards(constants[SPEED], speed_command, dt, constant, up, down)
    turn = step_towards(constants[TURN], yaw_rate_command, dt, constant, yaw_up, yaw_up)
    constants[SPEED], constants[TURN] = speed, turn

    fx = fy = tx = ty = tz = power = 0.0
    resistance = 0.5 * constants[ROLLING_RESISTANCE] * constants[WEIGHT]
    for side in (1.0, -1.0):
        y = side * half_track
        load = left_load if side > 0.0 else right_load
        tread = speed - side * turn * constants[ARM]
        pulled = 0.0  # [N] of the side's motor
        for x in (constants[FRONT], constants[REAR]):
            along, aside = sliding_force(
                tread - (forward - yaw_rate * y),
                -(left + yaw_rate * x),
                0.5 * load,
                constants[STICK],
                constants[FRICTION],
            )
            most = 0.5 * constants[MOTOR_LIMIT]
            along = min(max(along, -most), most)
            pulled += along
            force_x, force_y = cos * along - sin * aside, sin * along + cos * aside
            rx, ry, rz = rotate(orientation, x, y, -height)
            fx, fy = fx + force_x, fy + force_y
            tx, ty = tx - rz * force_y, ty + rz * force_x
            tz += rx * force_y - ry * force_x
        power += max(pulled * tread + resistance * abs(tread), 0.0)
    return (fx, fy, -constants[WEIGHT]), (tx, ty, tz), power
