"""Rules that hold a file against the body of a robot."""

from collections.abc import Iterator

import numpy as np

from navstack.geometry import footprint_radii
from navstack.params.dwb import DwbParams
from navstack.params.lint.costmap_view import CostmapView
from navstack.params.lint.rule import Finding, RuleGroup, decimal
from navstack.params.lint.subject import CONTROLLER, DrivingPlugin, RobotLimits, Subject
from navstack.types import FloatArray

MORE = 1.01  # a limit is exceeded by more than rounding
LEAST_GAP = 1e-3  # [m] by which the body sticks out

RULES = RuleGroup("With --robot", CONTROLLER)


@RULES.warning
def faster_than_robot(subject: Subject, robot: RobotLimits, top_speed: float) -> Iterator[Finding]:
    """The controller asks for more speed than the robot has.

    Why: simulated trajectories are longer and wider than what the robot drives.
    """
    if top_speed > MORE * robot.max_speed:
        yield _exceeds(subject.speed_name, top_speed, robot.max_speed, "m/s", robot.name)
    drive, dwb = subject.drive, subject.dwb
    if drive is not None and dwb is not None and dwb.max_vel_theta > MORE * robot.max_yaw_rate:
        yield _exceeds(
            f"{drive.name}.max_vel_theta",
            dwb.max_vel_theta,
            robot.max_yaw_rate,
            "rad/s",
            robot.name,
        )


@RULES.warning
def harder_than_robot(
    robot: RobotLimits, dwb: DwbParams, drive: DrivingPlugin
) -> Iterator[Finding]:
    """DWB counts on accelerations that the robot does not have.

    Why: the robot brakes later and turns wider than the trajectories that were checked.
    """
    limits = (
        ("acc_lim_x", 1.0, robot.max_acceleration, "m/s2"),
        ("decel_lim_x", -1.0, robot.max_deceleration, "m/s2"),
        ("acc_lim_theta", 1.0, robot.max_yaw_acceleration, "rad/s2"),
        ("decel_lim_theta", -1.0, robot.max_yaw_acceleration, "rad/s2"),
    )
    for key, sign, possible, unit in limits:
        wanted = getattr(dwb, key)
        if sign * wanted > MORE * possible:
            yield _exceeds(f"{drive.name}.{key}", wanted, sign * possible, unit, robot.name)


@RULES.warning
def larger_than_footprint(
    subject: Subject, robot: RobotLimits, view: CostmapView
) -> Iterator[Finding]:
    """The robot is larger than its footprint in the file.

    Why: what sticks out is not checked for collisions.
    """
    gap = max(_distance_outside(view.footprint, vertex) for vertex in robot.footprint)
    if gap > LEAST_GAP:
        text = ", ".join(f"[{x:g}, {y:g}]" for x, y in np.asarray(robot.footprint))
        yield Finding(
            subject.shape_key(view.node),
            f"{robot.name} sticks out of the padded footprint by up to {gap:.2f} m",
            f'footprint: "[{text}]"',
        )


def _distance_outside(polygon: FloatArray, point: FloatArray) -> float:
    """How far a point (2,) lies outside a polygon (N, 2), in [m]; 0 inside."""
    seen = polygon - point
    x, y = seen[:, 0], seen[:, 1]
    next_x, next_y = np.roll(x, -1), np.roll(y, -1)
    crosses = (y > 0.0) != (next_y > 0.0)  # edges that a ray along x may hit
    with np.errstate(all="ignore"):
        ahead = crosses & (x - y * (next_x - x) / (next_y - y) > 0.0)
    if ahead.sum() % 2:
        return 0.0
    return footprint_radii(seen)[0]


def _exceeds(name: str, wanted: float, possible: float, unit: str, robot: str) -> Finding:
    return Finding(
        name,
        f"{wanted:g} {unit}, but {robot} can do {possible:g} {unit}",
        f"{name.rpartition('.')[2]}: {decimal(possible)}",
    )
