"""Rigid-body motion of points on the robot."""

import math

from navstack.jit import njit
from navstack.types import FloatVector

# Places in the array of :func:`is_shaken`.
PLACE, VELOCITY, RATE, GRAVITY, THRESHOLD, ACCELERATION = 0, 3, 6, 7, 8, 9

Vector = tuple[float, float, float]  # x, y, z
Quaternion = tuple[float, float, float, float]  # x, y, z, w


@njit()
def rotate(orientation: Quaternion, x: float, y: float, z: float) -> Vector:
    """A vector turned by a unit quaternion (textbook: v + 2 q x (q x v + w v))."""
    qx, qy, qz, qw = orientation
    cx, cy, cz = qy * z - qz * y + qw * x, qz * x - qx * z + qw * y, qx * y - qy * x + qw * z
    return (
        x + 2.0 * (qy * cz - qz * cy),
        y + 2.0 * (qz * cx - qx * cz),
        z + 2.0 * (qx * cy - qy * cx),
    )


@njit()
def heading(orientation: Quaternion) -> float:
    """The yaw [rad] of a unit quaternion (textbook)."""
    qx, qy, qz, qw = orientation
    return math.atan2(2.0 * (qw * qz + qx * qy), 1.0 - 2.0 * (qy * qy + qz * qz))


@njit(ahead=True)
def point_velocity(
    orientation: Quaternion, velocity: Vector, spin: Vector, x: float, y: float, z: float
) -> Vector:
    """Map-frame velocity [m/s] of a point (x, y, z) [m] of the body.

    The point is given in the body frame, from the centre of mass.
    """
    (vx, vy, vz), (wx, wy, wz) = velocity, spin
    rx, ry, rz = rotate(orientation, x, y, z)
    return vx + wy * rz - wz * ry, vy + wz * rx - wx * rz, vz + wx * ry - wy * rx


@njit(ahead=True)
def is_shaken(orientation: Quaternion, velocity: Vector, spin: Vector, bucket: FloatVector) -> bool:
    """Whether the bucket is shaken or tilted beyond what its pieces bear at rest.

    See :func:`lean_and_shake`.

    Takes the motion as :func:`base_state` does, and of the bucket (12,), changed in place: at
    ``PLACE`` its place (x, y, z) [m] in the body frame from the centre of mass; at ``VELOCITY`` its
    velocity [m/s] before the step, map frame, which becomes that after it; the rate of the steps
    [Hz], gravity [m/s2] and the threshold [m/s2]; at ``ACCELERATION`` its mean acceleration [m/s2]
    during the step, which is found here.
    """
    x, y, z = bucket[PLACE], bucket[PLACE + 1], bucket[PLACE + 2]
    ux, uy, uz = point_velocity(orientation, velocity, spin, x, y, z)
    rate = bucket[RATE]
    ax = (ux - bucket[VELOCITY]) * rate
    ay = (uy - bucket[VELOCITY + 1]) * rate
    az = (uz - bucket[VELOCITY + 2]) * rate
    bucket[VELOCITY], bucket[VELOCITY + 1], bucket[VELOCITY + 2] = ux, uy, uz
    bucket[ACCELERATION], bucket[ACCELERATION + 1], bucket[ACCELERATION + 2] = ax, ay, az
    shake = lean_and_shake(ax, ay, az, orientation[0], orientation[1], bucket[GRAVITY])
    return bool(shake > bucket[THRESHOLD])


@njit(ahead=True)
def lean_and_shake(ax: float, ay: float, az: float, qx: float, qy: float, gravity: float) -> float:
    """Acceleration [m/s2] of the bucket and, for small angles, that of gravity along its floor."""
    lean = 2.0 * gravity * math.sqrt(qx * qx + qy * qy)
    return math.sqrt(ax * ax + ay * ay + az * az) + lean


@njit(ahead=True)
def base_state(
    position: Vector,
    orientation: Quaternion,
    velocity: Vector,
    spin: Vector,
    offset: Vector,
    yaw_before: float,
    vx_before: float,
    vy_before: float,
    tick: float,
) -> tuple[float, float, float, float, float, float, float, float, float]:
    """The fields of a :class:`~harness.world.physics.body_state.BodyState`.

    Args:
        position: [m] of the centre of mass, map frame, and so the next three.
        orientation: of the body.
        velocity: [m/s].
        spin: [rad/s].
        offset: [m] of the base origin from the centre of mass, body frame.
        yaw_before: [rad] some time ago; the acceleration is the mean since then.
        vx_before: [m/s] at that time, forward.
        vy_before: [m/s] to the left.
        tick: [s] that time.
    """
    qx, qy, _, _ = orientation
    rx, ry, _ = rotate(orientation, offset[0], offset[1], offset[2])
    ux, uy, _ = point_velocity(orientation, velocity, spin, offset[0], offset[1], offset[2])
    yaw = heading(orientation)
    cos, sin = math.cos(yaw), math.sin(yaw)
    vx, vy = cos * ux + sin * uy, -sin * ux + cos * uy
    tilt = math.acos(min(max(1.0 - 2.0 * (qx * qx + qy * qy), -1.0), 1.0))
    turn = yaw - yaw_before
    cos, sin = math.cos(turn), math.sin(turn)
    ax = (vx - (cos * vx_before + sin * vy_before)) / tick
    ay = (vy - (-sin * vx_before + cos * vy_before)) / tick
    return position[0] + rx, position[1] + ry, yaw, vx, vy, spin[2], ax, ay, tilt
