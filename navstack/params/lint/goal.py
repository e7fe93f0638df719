"""Rules about reaching the goal and being seen to get there.

Tolerances, progress, turns on the spot.
"""

import math
from collections.abc import Iterator

from navstack.params.checkers import SimpleGoalCheckerParams, SimpleProgressCheckerParams
from navstack.params.dwb import DwbParams
from navstack.params.lint.costmap_view import CostmapView
from navstack.params.lint.rule import Finding, RuleGroup, above, decimal
from navstack.params.lint.subject import CONTROLLER, DrivingPlugin, Named, Subject
from navstack.params.rotation_shim import RotationShimParams
from navstack.params.safety import VelocitySmootherParams
from navstack.params.servers import ControllerServerParams

FAR_GOAL = 0.5  # [m] from here on a goal tolerance is not a matter of precision any more
MOST_OF_TOP_SPEED = 0.5  # share of the top speed that a progress checker may ask for on average
FINEST_CELL = 0.01  # [m] that is advised
SOFTER = 0.8  # a limit this much below another one matters

RULES = RuleGroup("Goal, progress and turning on the spot", CONTROLLER)


@RULES.warning
def stops_outside(
    dwb: DwbParams, drive: DrivingPlugin, goal_checker: Named[SimpleGoalCheckerParams]
) -> Iterator[Finding]:
    """DWB turns on the spot before the goal checker is satisfied.

    Why: from its own tolerance on RotateToGoal slows down and then allows turns only: the robot
    stops short of the goal checker's tolerance, turns, and is aborted for lack of progress.
    """
    name, checker = goal_checker
    if "RotateToGoal" in dwb.critics and dwb.RotateToGoal.scale > 0.0:
        if dwb.xy_goal_tolerance > checker.xy_goal_tolerance + 1e-9:
            yield Finding(
                f"{drive.name}.xy_goal_tolerance",
                f"{dwb.xy_goal_tolerance:g} m, "
                f"but {name}.xy_goal_tolerance is {checker.xy_goal_tolerance:g} m",
                f"xy_goal_tolerance: {decimal(checker.xy_goal_tolerance)} in both",
            )


@RULES.warning
def far_goal(
    subject: Subject, local: CostmapView, goal_checker: Named[SimpleGoalCheckerParams]
) -> Iterator[Finding]:
    """The goal tolerance is larger than the robot.

    Why: the robot counts as arrived on the wrong side of a kerb or a door, and turns to the goal's
    yaw there.
    """
    name, checker = goal_checker
    size = local.circumscribed
    if size <= 0.0 or checker.xy_goal_tolerance <= max(FAR_GOAL, size):
        return
    found = (
        f"{checker.xy_goal_tolerance:g} m, {checker.xy_goal_tolerance / size:.1f} times "
        f"the robot's outer radius of {size:.2f} m"
    )
    if subject.dwb is not None and "RotateToGoal" in subject.dwb.critics:
        found += ", and RotateToGoal forbids to speed up from there and turns on the spot"
    yield Finding(
        f"{name}.xy_goal_tolerance",
        found,
        "xy_goal_tolerance: 0.25 in the goal checker and in the controller",
    )


@RULES.warning
def goal_below_a_cell(
    dwb: DwbParams, local: CostmapView, goal_checker: Named[SimpleGoalCheckerParams]
) -> Iterator[Finding]:
    """The goal tolerance is finer than a cell of the local costmap.

    Why: GoalDist is 0 all over the goal's cell, so nothing pulls the robot nearer; it circles until
    it is aborted.
    """
    name, checker = goal_checker
    cell = local.params.resolution
    if checker.xy_goal_tolerance < cell:
        finer = ""
        if checker.xy_goal_tolerance > FINEST_CELL:
            half = decimal(checker.xy_goal_tolerance / 2.0)
            finer = f", or local_costmap resolution: {half}"
        yield Finding(
            f"{name}.xy_goal_tolerance",
            f"{checker.xy_goal_tolerance:g} m, but a cell of the local costmap is {cell:g} m wide",
            f"xy_goal_tolerance: {decimal(2.0 * cell)}{finer}",
        )


@RULES.warning
def impatient(
    subject: Subject, server: ControllerServerParams, drive: DrivingPlugin
) -> Iterator[Finding]:
    """One failed control cycle aborts following.

    Why: a single scan in which every trajectory touches something clears the local costmap,
    obstacles that are out of sight included, and starts the recoveries.
    """
    if subject.is_of_foxy:
        return  # Foxy has no such parameter
    tolerance, period = server.failure_tolerance, 1.0 / server.controller_frequency
    if 0.0 <= tolerance < period:
        note = subject.default_note(CONTROLLER, "failure_tolerance")
        yield Finding(
            "failure_tolerance",
            f"{tolerance:g} s{note}, less than a control period of {period:g} s",
            f"failure_tolerance: {max(0.3, 2.0 * period):g}",
        )


@RULES.warning
def demanding_progress(
    progress_checker: Named[SimpleProgressCheckerParams], top_speed: float
) -> Iterator[Finding]:
    """The progress checker asks for more than half the top speed.

    Why: waiting for a pedestrian or creeping through a door counts as stuck and starts the
    recoveries.
    """
    name, checker = progress_checker
    if top_speed <= 0.0:
        return
    radius, time, needed = (
        checker.required_movement_radius,
        checker.movement_time_allowance,
        math.inf,
    )
    if time > 0.0:
        needed = radius / time
    if needed > MOST_OF_TOP_SPEED * top_speed:
        yield Finding(
            f"{name}.required_movement_radius",
            f"{radius:g} m in {time:g} s = {needed:.2f} m/s, "
            f"but the top speed is {top_speed:g} m/s",
            f"movement_time_allowance: {above(5.0 * radius / top_speed, 0)}",
        )


@RULES.warning
def turn_counts_as_stuck(
    subject: Subject, progress_checker: Named[SimpleProgressCheckerParams]
) -> Iterator[Finding]:
    """Half a turn takes longer than the robot may stay in one place.

    Why: SimpleProgressChecker sees positions only: turning on the spot counts as stuck and is
    aborted half way.
    """
    name, checker = progress_checker
    if hasattr(checker, "required_movement_angle"):
        return
    rate = _turning_rate(subject)
    if rate > 0.0 and math.pi / rate > checker.movement_time_allowance > 0.0:
        yield Finding(
            f"{name}.movement_time_allowance",
            f"{checker.movement_time_allowance:g} s, "
            f"but half a turn at {rate:g} rad/s takes {math.pi / rate:.1f} s",
            f"movement_time_allowance: {above(2.0 * math.pi / rate, 0)}, or "
            "nav2_controller::PoseProgressChecker, which counts turning as progress",
        )


@RULES.warning
def shim_hands_over_at_once(shim: Named[RotationShimParams]) -> Iterator[Finding]:
    """The rotation shim disengages at a larger heading error than it engages at.

    Why: in the range between them each turn ends in the cycle after it began; the robot twitches
    and drives off askew.
    """
    name, params = shim
    if params.angular_disengage_threshold >= params.angular_dist_threshold:
        yield Finding(
            f"{name}.angular_dist_threshold",
            f"{params.angular_dist_threshold:g} rad, but turning ends below "
            f"angular_disengage_threshold {params.angular_disengage_threshold:g} rad",
            f"angular_disengage_threshold: {decimal(params.angular_dist_threshold / 2.0)}",
        )


@RULES.warning
def shim_turns_blind(
    shim: Named[RotationShimParams], server: ControllerServerParams
) -> Iterator[Finding]:
    """The rotation shim does not look ahead.

    Why: no step of the turn is simulated, so corners of the robot sweep into whatever stands beside
    it.
    """
    name, params = shim
    if params.simulate_ahead_time < 1.0 / server.controller_frequency:
        yield Finding(
            f"{name}.simulate_ahead_time",
            f"{params.simulate_ahead_time:g} s, less than a control period",
            "simulate_ahead_time: 1.0",
        )


@RULES.warning
def shim_turns_too_fast(
    shim: Named[RotationShimParams], smoother: VelocitySmootherParams
) -> Iterator[Finding]:
    """The rotation shim plans with more than the velocity smoother lets through.

    Why: it computes its last moment to brake with its own limits; the smoother brakes later and the
    turn overshoots.
    """
    name, params = shim
    if params.rotate_to_heading_angular_vel > smoother.max_velocity[2]:
        yield Finding(
            f"{name}.rotate_to_heading_angular_vel",
            f"{params.rotate_to_heading_angular_vel:g} rad/s, but the velocity smoother allows "
            f"{smoother.max_velocity[2]:g} rad/s",
            f"rotate_to_heading_angular_vel: {decimal(smoother.max_velocity[2])}",
        )
    braking = min(smoother.max_accel[2], -smoother.max_decel[2])
    if braking < SOFTER * params.max_angular_accel:
        yield Finding(
            f"{name}.max_angular_accel",
            f"{params.max_angular_accel:g} rad/s2, "
            f"but the velocity smoother allows {braking:g} rad/s2",
            f"max_angular_accel: {decimal(braking)}",
        )


def _turning_rate(subject: Subject) -> float:
    """How fast the robot turns on the spot, in [rad/s]; 0: unknown."""
    if subject.shim is not None:
        return subject.shim.params.rotate_to_heading_angular_vel
    if subject.dwb is not None:
        return subject.dwb.max_vel_theta
    return 0.0
