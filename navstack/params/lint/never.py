"""Rules about values with which a robot never gets anywhere, although every part can be built."""

from collections.abc import Iterator

import numpy as np

from navstack.geometry import footprint_radii
from navstack.params.checkers import SimpleGoalCheckerParams, SimpleProgressCheckerParams
from navstack.params.costmap import robot_footprint
from navstack.params.dwb import DwbParams
from navstack.params.lint.costmap_view import CostmapView
from navstack.params.lint.rule import Finding, RuleGroup, decimal
from navstack.params.lint.subject import (
    CONTROLLER,
    MONITOR,
    SMOOTHER,
    SPEEDS,
    DrivingPlugin,
    Named,
    Subject,
)
from navstack.params.mppi import MppiParams
from navstack.params.safety import VelocitySmootherParams
from navstack.params.servers import ControllerServerParams

LEAST = 1e-3  # [s] of a message's way, [m] of a path, [m/s] of a motion, ...

RULES = RuleGroup("Never works", CONTROLLER)


@RULES.error
def negative_tolerance(goal_checker: Named[SimpleGoalCheckerParams]) -> Iterator[Finding]:
    """A limit of the goal checker is below 0.

    Why: nothing is nearer, better turned or slower than that: the goal is never reached.
    """
    name, checker = goal_checker
    limits = (
        ("xy_goal_tolerance", "m", 0.25),
        ("yaw_goal_tolerance", "rad", 0.25),
        ("trans_stopped_velocity", "m/s", 0.25),
        ("rot_stopped_velocity", "rad/s", 0.25),
    )
    for key, unit, usual in limits:
        value = getattr(checker, key, usual)
        if value < 0.0:
            yield Finding(f"{name}.{key}", f"{key} is {value:g} {unit}", f"{key}: {usual}")


@RULES.error
def no_patience(
    progress_checker: Named[SimpleProgressCheckerParams], server: ControllerServerParams
) -> Iterator[Finding]:
    """The progress checker waits for less than a control cycle.

    Why: no robot gets anywhere within one cycle: following is aborted in the moment it begins.
    """
    name, checker = progress_checker
    time, period = checker.movement_time_allowance, 1.0 / server.controller_frequency
    if time < period and checker.required_movement_radius >= 0.0:
        yield Finding(
            f"{name}.movement_time_allowance",
            f"{time:g} s, but a control cycle takes {period:g} s",
            "movement_time_allowance: 10.0",
        )


@RULES.error
def overdue_command(smoother: VelocitySmootherParams) -> Iterator[Finding]:
    """Every command is older than the velocity smoother's timeout.

    Why: it brings the robot to a stop although commands arrive.
    """
    if smoother.velocity_timeout < LEAST:
        yield Finding(
            "velocity_timeout",
            f"{smoother.velocity_timeout:g} s, but a command is some milliseconds old",
            "velocity_timeout: 1.0",
            SMOOTHER,
        )


@RULES.error
def overdue_scan(subject: Subject) -> Iterator[Finding]:
    """Every scan is older than the collision monitor's timeout.

    Why: a source that is overdue stops the robot, and it never moves; 0 turns the timeout off.
    """
    shared = subject.number(MONITOR, "source_timeout", 2.0)
    for name in subject.names(MONITOR, "observation_sources"):
        if subject.value(MONITOR, f"{name}.enabled", True) is False:
            continue
        key = f"{name}.source_timeout"
        if subject.value(MONITOR, key) is None:
            key = "source_timeout"
        timeout = subject.number(MONITOR, key, shared)
        if timeout < LEAST and timeout != 0.0:
            yield Finding(key, f"{timeout:g} s", f"{key}: 1.0", MONITOR)


@RULES.error
def triggered_by_nothing(subject: Subject) -> Iterator[Finding]:
    """A zone of the collision monitor needs no point inside to act.

    Why: it always acts, and one that stops the robot, or lets it approach, holds it for ever.
    """
    for name in subject.names(MONITOR, "polygons"):
        action = subject.value(MONITOR, f"{name}.action_type")
        is_on = subject.value(MONITOR, f"{name}.enabled", True)
        key, least = "min_points", 1
        if subject.value(MONITOR, f"{name}.max_points") is not None:  # which then counts alone
            key, least = "max_points", 0
        points = subject.number(MONITOR, f"{name}.{key}", least)
        if is_on and action in ("stop", "approach") and points < least:
            yield Finding(f"{name}.{key}", f"{key} is {points:g}", f"{key}: {least + 3}", MONITOR)


@RULES.error
def standing_smoother(smoother: VelocitySmootherParams) -> Iterator[Finding]:
    """The velocity smoother lets no motion along x or y through.

    Why: whatever the controller commands, the robot stands.
    """
    speeds = smoother.max_velocity
    for key, usual in (("max_velocity", 0.5), ("max_accel", 2.5)):
        values = getattr(smoother, key)[:2]
        if max(values) < LEAST:
            advice = f"{key}: [{usual}, 0.0, ...]"
            yield Finding(key, f"{key} is {values[0]:g} along x and y", advice, SMOOTHER)
    if all(dead > most for dead, most in zip(smoother.deadband_velocity, speeds, strict=True)):
        found = f"all that is slower than {smoother.deadband_velocity[0]:g} m/s is sent as 0"
        yield Finding("deadband_velocity", found, "deadband_velocity: [0.0, 0.0, 0.0]", SMOOTHER)


@RULES.error
def turned_inside_out(view: CostmapView) -> Iterator[Finding]:
    """A negative padding turns the footprint inside out.

    Why: the costmap knows no body of this robot: it never moves, or it drives into everything.
    """
    padding = view.params.footprint_padding
    inside = footprint_radii(robot_footprint(view.params))[0]
    if padding < 0.0 and -padding >= inside:
        yield Finding(
            "footprint_padding",
            f"{padding:g} m, but the robot is only {inside:.2f} m from its centre to its side",
            "footprint_padding: 0.01",
        )


@RULES.error
def fills_the_costmap(local: CostmapView) -> Iterator[Finding]:
    """The padded robot is as wide as the local costmap.

    Why: there is no place to go to: every motion leaves the costmap.
    """
    reach = float(np.abs(local.footprint).max(axis=0).min())
    if local.params.rolling_window and reach >= local.half_window:
        yield Finding(
            "footprint_padding",
            f"the robot with its padding of {local.params.footprint_padding:g} m reaches "
            f"{reach:g} m to its sides, and the costmap {local.half_window:g} m",
            f"width and height: {decimal(3.0 * reach)}, or footprint_padding: 0.01",
            local.node,
        )


@RULES.error
def nothing_to_follow(dwb: DwbParams, drive: DrivingPlugin) -> Iterator[Finding]:
    """DWB keeps nothing of the path, or its trajectories have no length.

    Why: there is nothing to follow: the robot stands, or following fails at once.
    """
    lengths = (  # a negative forward_prune_distance keeps everything
        ("forward_prune_distance", dwb.forward_prune_distance < 0.0, "m", 2.0),
        ("prune_distance", False, "m", 2.0),
        ("sim_time", False, "s", 1.7),
    )
    for key, is_endless, unit, usual in lengths:
        value = getattr(dwb, key)
        if value < LEAST and not is_endless:
            yield Finding(f"{drive.name}.{key}", f"{key} is {value:g} {unit}", f"{key}: {usual}")


@RULES.error
def everything_is_lethal(view: CostmapView) -> Iterator[Finding]:
    """Every cell of the map is an obstacle.

    Why: the robot stands in one and never moves.
    """
    threshold = view.params.lethal_cost_threshold
    if threshold <= 0:
        yield Finding(
            "lethal_cost_threshold",
            f"{threshold} %, and a free cell has 0 %",
            "lethal_cost_threshold: 100",
        )


@RULES.warning
def never_updated(world: CostmapView) -> Iterator[Finding]:
    """The global costmap is never updated.

    Why: no path can be planned on it.
    """
    if world.params.update_frequency == 0.0:
        yield Finding(
            "update_frequency", "update_frequency is 0 Hz", "update_frequency: 1.0", world.node
        )


@RULES.error
def no_choice(mppi: MppiParams, drive: DrivingPlugin) -> Iterator[Finding]:
    """MPPI has fewer than two trajectories to choose from.

    Why: the one drawn at random is driven, whatever the critics say of it.
    """
    if mppi.batch_size < 2:
        yield Finding(
            f"{drive.name}.batch_size", f"batch_size is {mppi.batch_size}", "batch_size: 1000"
        )


@RULES.error
def no_motion(subject: Subject, drive: DrivingPlugin) -> Iterator[Finding]:
    """A limit of the controller's speed or acceleration is 0.

    Why: there is no velocity to choose but standing still.
    """
    yield from _limits_of_0(subject, drive, is_given=True)


@RULES.warning
def no_speed_given(subject: Subject, drive: DrivingPlugin) -> Iterator[Finding]:
    """The controller's speeds are left to Nav2's defaults, which are 0.

    Why: there is no velocity to choose but standing still.
    """
    yield from _limits_of_0(subject, drive, is_given=False)


def _limits_of_0(subject: Subject, drive: DrivingPlugin, is_given: bool) -> Iterator[Finding]:
    """Limits that keep the robot in its place: those that the file gives, or those left out."""
    dwb, mppi = subject.dwb, subject.mppi
    limits = [(subject.speed_name.rpartition(".")[2], [subject.top_speed])]
    if mppi is not None:
        limits = [("vx_max", [mppi.vx_max, mppi.vx_min])]
    if dwb is not None:
        speeds = [dwb.max_vel_x, dwb.min_vel_x, dwb.max_vel_y, dwb.min_vel_y]
        most = [dwb.max_speed_xy]
        if dwb.max_speed_xy < 0.0:
            most = speeds
        starts = [dwb.acc_lim_x, dwb.acc_lim_y]
        limits = [("max_vel_x", speeds), ("max_speed_xy", most), ("acc_lim_x", starts)]
    if drive.type not in SPEEDS:
        return
    for key, values in limits:
        name = f"{drive.name}.{key}"
        has_it = subject.value(CONTROLLER, name) is not None
        if max(map(abs, values)) < LEAST and has_it == is_given:
            yield Finding(name, f"{key} is {values[0]:g}", f"{key}: 0.5, or what the robot can do")
