"""The robot that a user's Nav2 file describes: its outline, its limits and its lidar.

What a Nav2 file does not say follows from the outline. The factors are those of the robots in
``params/robots``, and of Husky and TurtleBot 4 by their data sheets.
"""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from harness.task.lidar_place import box_about, carry, is_preset, yaml_text
from harness.task.made_files import made_file
from navstack.errors import ParameterError
from navstack.geometry import holds_origin, pad_footprint
from navstack.params.costmap import CostmapParams, robot_footprint
from navstack.params.lint.costmaps import LARGEST, SMALLEST
from navstack.params.lint.subject import BEHAVIORS, CONTROLLER, SMOOTHER, Subject
from navstack.params.nav2_file.file import Nav2File
from navstack.params.nav2_file.views import read_costmap
from navstack.params.strict import load_yaml
from navstack.types import FloatArray

SHRUNK = 0.005  # [m] of a side that is told
SAME = 0.05  # [m] of every side within which a file's robot is the one that is there
FASTER = 1.01  # times the robot's top speed: more than rounding
MASS = 100.0  # [kg/m2] of outline: Husky 75, Jackal 94, Nova Carter 129, Segway E1 134
MASS_CENTER = 0.25  # height of the centre of mass over the square root of the outline's area
HEIGHT = 0.6  # the same of the body
FORCE = 10.0  # [N/kg] of the drive: Segway E1 8, Jackal 12
GRAVITY = 9.81  # [m/s2]
STEADY = 0.9  # share of the acceleration at which it would tip over
SPEED, YAW_RATE = 0.5, 1.0  # [m/s], [rad/s] where the file says nothing
# of another robot
KEPT = ("wheel_friction", "rolling_resistance", "servo_time_constant", "body_friction")
BEHIND = 0.3  # share of its length behind the axle from which on casters have room there
SIDEWAYS = 0.5  # [m/s] of an Omni motion model: the default of vy_max


@dataclass(frozen=True, slots=True)
class Limits:
    """What a file asks of the drive, at the most of all its parts."""

    speed: float  # [m/s]
    yaw_rate: float  # [rad/s]
    acceleration: float  # [m/s2]
    deceleration: float  # [m/s2]
    yaw_acceleration: float  # [rad/s2]
    sideways: float  # [m/s]


@dataclass(frozen=True, slots=True)
class OwnBody:
    """The files of a robot that a Nav2 file describes."""

    robot: str
    sensors: str  # that file as it was, if the user wrote it
    note: str  # what a user has to know of it


def own_body(nav2: Nav2File, robot: Path, sensors: Path, title: str) -> OwnBody | None:
    """The body of a file's robot; None: it is the given one, or the file cannot be read.

    Args:
        nav2: the file.
        robot: file of the robot that would drive else.
        sensors: file of its sensors; the body carries the lidar of a preset in its middle.
        title: of the Nav2 file, for names and messages.

    Raises:
        ParameterError: the outline is that of no robot.
    """
    try:
        costmap = read_costmap(nav2, "local_costmap")
        outline = robot_footprint(costmap)
    except ParameterError:
        return None  # refused with its reason where it is to drive
    known: dict[str, Any] = load_yaml(robot)
    limits = _limits(Subject(nav2))
    off = np.abs(box_about(outline) - box_about(np.array(known["footprint"]))).max()
    if off < SAME and limits.speed <= FASTER * known["max_speed"]:
        return None
    box = _box(outline)
    _require_robot(nav2, costmap, outline, box)
    body = body_of(box, limits, known)
    if is_preset(sensors):
        content = _carried(load_yaml(sensors), box, nav2)
        sensors = made_file(f"{title}-sensors.yaml", yaml_text(content))
    made = made_file(f"{title}-robot.yaml", yaml_text(body))
    return OwnBody(str(made), str(sensors), _note(costmap, outline, box, body, limits))


def _require_robot(
    nav2: Nav2File, costmap: CostmapParams, outline: FloatArray, box: FloatArray
) -> None:
    """Refuse an outline without area, of no robot's size, or beside the base frame."""
    length, width = (box[1] - box[0]).tolist()
    where = f"{nav2.path.name}: local_costmap: footprint"
    if _is_round(costmap):
        where = f"{nav2.path.name}: local_costmap: robot_radius {costmap.robot_radius:g} m"
    way_on = "or drive another robot with --robot NAME"
    if min(length, width) < SMALLEST or max(length, width) > LARGEST:
        raise ParameterError(
            f"{where} has room for a box of {length:.3g} m x {width:.3g} m; allowed are "
            f"{SMALLEST:g} to {LARGEST:g} m on each side: give it in metres, {way_on}"
        )
    if not holds_origin(pad_footprint(outline, SMALLEST)):
        (left, low), (right, high) = box_about(outline).tolist()
        raise ParameterError(
            f"{where}, x from {left:g} to {right:g} m and y from {low:g} to {high:g} m, does not "
            f"hold the base frame's origin: give its corners relative to that, {way_on}"
        )


def _limits(subject: Subject) -> Limits:
    """The largest speeds and accelerations that controller, smoother and behaviors ask for."""
    name = ""
    if subject.drive is not None:
        name = f"{subject.drive.name}."

    def most(default: float, axis: int, smoothed: str, *keys: str) -> float:
        values = [abs(subject.number(CONTROLLER, name + key, 0.0)) for key in keys]
        if subject.smoother is not None and subject.has(SMOOTHER):  # its defaults know no robot
            values.append(abs(getattr(subject.smoother, smoothed)[axis]))
        sane = [value for value in values if 0.0 < value < 100.0]
        return max(sane, default=default)

    turning = ("max_vel_theta", "wz_max", "v_angular_max", "rotate_to_heading_angular_vel")
    speed = most(SPEED, 0, "max_velocity", "max_vel_x", "vx_max", "desired_linear_vel")
    spin = subject.number(BEHAVIORS, "max_rotational_vel", YAW_RATE)
    sideways = subject.number(CONTROLLER, f"{name}max_vel_y", 0.0)
    if subject.value(CONTROLLER, f"{name}motion_model") == "Omni":
        sideways = subject.number(CONTROLLER, f"{name}vy_max", SIDEWAYS)
    return Limits(
        speed=max(speed, min(subject.top_speed, 100.0)),
        yaw_rate=max(most(YAW_RATE, 2, "max_velocity", *turning), min(spin, 100.0)),
        acceleration=most(2.5, 0, "max_accel", "acc_lim_x", "ax_max"),
        deceleration=most(2.5, 0, "max_decel", "decel_lim_x", "ax_min"),
        yaw_acceleration=most(3.2, 2, "max_accel", "acc_lim_theta", "az_max", "max_angular_accel"),
        sideways=sideways,
    )


def _box(outline: FloatArray) -> FloatArray:
    """Lower and upper corner (2, 2) of the body in [m], base frame.

    The largest box of the proportions of the one about the outline that its convex hull has room
    for: so the body touches nothing that its costmap shows free. A round robot is the square within
    its circle.
    """
    # here alone, and seldom: they take long to load
    from scipy.optimize import linprog
    from scipy.spatial import ConvexHull, QhullError

    box = box_about(outline)
    half = 0.5 * (box[1] - box[0])
    try:
        sides = ConvexHull(outline).equations  # outward normals, and minus the distance of each
    except QhullError:  # all vertices on a line
        return box
    normals, room = sides[:, :2], -sides[:, 2]
    # its middle and its share of the size, so that its farthest corner lies within each side
    reach = np.abs(normals) @ half
    found = linprog(
        c=(0.0, 0.0, -1.0),
        A_ub=np.column_stack((normals, reach)),
        b_ub=room,
        bounds=((None, None), (None, None), (0.0, 1.0)),
    )
    middle, share = found.x[:2], found.x[2]
    smaller: FloatArray = np.round((middle - share * half, middle + share * half), 6)
    return smaller


def body_of(box: FloatArray, limits: Limits, known: dict[str, Any]) -> dict[str, Any]:
    """A robot's parameters, as a file of ``params/robots`` has them.

    Args:
        box: lower and upper corner (2, 2) of its body in [m], base frame.
        limits: of its drive.
        known: another robot, whose frictions and time constant it has.
    """
    (x_min, y_min), (x_max, y_max) = box.tolist()
    length, width = x_max - x_min, y_max - y_min
    size = math.sqrt(length * width)
    mass = MASS * length * width
    middle = 0.5 * (x_min + x_max)
    if -x_min >= BEHIND * length:
        wheelbase = max(0.85 * -x_min, 0.3 * length)
        center = min(max(middle, -0.6 * wheelbase), -0.33 * wheelbase)
    else:  # casters in front
        wheelbase = -0.85 * x_max
        center = max(min(middle, -0.6 * wheelbase), -0.33 * wheelbase)
    rear, front = sorted((-wheelbase, 0.0))
    wheel, track = 0.2 * size, 0.85 * width
    tipping = STEADY * GRAVITY / (MASS_CENTER * size)  # [1/s2] acceleration per metre of support
    values = {
        "mass": mass,
        "height": HEIGHT * size,
        "center_of_mass_x": center,
        "center_of_mass_height": MASS_CENTER * size,
        "foot_radius": min(0.03, 0.1 * size),
        "ground_clearance": min(0.05, 0.15 * size),
        "wheel_radius": wheel,
        "track": track,
        "wheelbase": wheelbase,
        "caster_track": 0.7 * width,
        "max_speed": limits.speed,
        "max_yaw_rate": min(limits.yaw_rate, 0.5 * track * tipping / limits.speed),
        "max_acceleration": min(limits.acceleration, (center - rear) * tipping),
        "max_deceleration": min(limits.deceleration, (front - center) * tipping),
        "max_yaw_acceleration": limits.yaw_acceleration,
        "max_wheel_torque": 0.5 * FORCE * mass * wheel,
    }
    return {
        "footprint": [[x_max, y_max], [x_max, y_min], [x_min, y_min], [x_min, y_max]],
        **{name: round(value, 4) for name, value in values.items()},
        **{name: known[name] for name in KEPT},
        "bucket": [0.5 * (x_min + x_max), 0.5 * (y_min + y_max), round(HEIGHT * size, 4)],
    }


def _carried(sensors: dict[str, Any], box: FloatArray, nav2: Nav2File) -> dict[str, Any]:
    """The sensors with the lidar in the middle of the body, and with the range that AMCL knows."""
    lidar = sensors["lidar"]
    carry(lidar, box)
    reach = nav2.value("amcl", "laser_max_range", lidar["range_max"])
    if isinstance(reach, int | float) and 1.0 <= reach < lidar["range_max"]:
        lidar["range_max"] = float(reach)
    return sensors


def _is_round(costmap: CostmapParams) -> bool:
    """Whether a costmap gives its robot by a radius."""
    return costmap.footprint.strip() in ("", "[]")


def _note(
    costmap: CostmapParams,
    outline: FloatArray,
    box: FloatArray,
    body: dict[str, Any],
    limits: Limits,
) -> str:
    """The body in one line."""
    length, width = (box[1] - box[0]).tolist()
    shape = f"{length:.2f} m x {width:.2f} m"
    if _is_round(costmap):
        shape = f"a radius of {abs(costmap.robot_radius):.2f} m, as a square within"
    elif np.abs(box - box_about(outline)).max() > SHRUNK:
        shape += ", a box within its outline"
    note = (
        f"drives the robot that the file describes: {shape}, up to {limits.speed:g} m/s and "
        f"{body['max_yaw_rate']:.3g} rad/s; by its area it weighs {body['mass']:.1f} kg and "
        f"brakes with {body['max_deceleration']:.1f} m/s2 before it tips; --robot NAME drives "
        "another one"
    )
    if limits.sideways > 0.0:
        note += f"; it has two driven wheels and does not drive sideways ({limits.sideways:g} m/s)"
    return note
