"""Rules about reaching the goal and being seen to get there: tolerances, progress, turns on the spot."""

import math
from collections.abc import Iterator

from navstack.params.lint.rule import Finding, RuleGroup, above, decimal
from navstack.params.lint.subject import CONTROLLER, Subject

FAR_GOAL = 0.5  # [m] from here on a goal tolerance is not a matter of precision any more
MOST_OF_TOP_SPEED = 0.5  # share of the top speed that a progress checker may ask for on average
SOFTER = 0.8  # a limit this much below another one matters

RULES = RuleGroup("Goal, progress and turning on the spot")


@RULES.warning
def stops_outside(subject: Subject) -> Iterator[Finding]:
    """DWB turns on the spot before the goal checker is satisfied.

    Why: from its own tolerance on RotateToGoal slows down and then allows turns only: the robot stops short of the goal
    checker's tolerance, turns, and is aborted for lack of progress.
    """
    if subject.dwb is None or subject.goal_checker is None:
        return
    (name, dwb), (checker_name, checker) = subject.dwb, subject.goal_checker
    if "RotateToGoal" in dwb.critics and dwb.RotateToGoal.scale > 0.0:
        if dwb.xy_goal_tolerance > checker.xy_goal_tolerance + 1e-9:
            yield Finding(
                CONTROLLER,
                f"{name}.xy_goal_tolerance",
                f"{dwb.xy_goal_tolerance:g} m, but {checker_name}.xy_goal_tolerance is {checker.xy_goal_tolerance:g} m",
                f"xy_goal_tolerance: {decimal(checker.xy_goal_tolerance)} in both",
            )


@RULES.warning
def far_goal(subject: Subject) -> Iterator[Finding]:
    """The goal tolerance is larger than the robot.

    Why: the robot counts as arrived on the wrong side of a kerb or a door, and turns to the goal's yaw there.
    """
    if subject.goal_checker is None or subject.local is None:
        return
    name, checker = subject.goal_checker
    size = subject.local.circumscribed
    if size <= 0.0 or checker.xy_goal_tolerance <= max(FAR_GOAL, size):
        return
    stops = subject.dwb is not None and "RotateToGoal" in subject.dwb[1].critics
    from_there = ", and RotateToGoal forbids to speed up from there and turns on the spot" if stops else ""
    yield Finding(
        CONTROLLER,
        f"{name}.xy_goal_tolerance",
        f"{checker.xy_goal_tolerance:g} m, {checker.xy_goal_tolerance / size:.1f} times the robot's outer radius of "
        f"{size:.2f} m{from_there}",
        "xy_goal_tolerance: 0.25 in the goal checker and in the controller",
    )


@RULES.warning
def goal_below_a_cell(subject: Subject) -> Iterator[Finding]:
    """The goal tolerance is finer than a cell of the local costmap.

    Why: GoalDist is 0 all over the goal's cell, so nothing pulls the robot nearer; it circles until it is aborted.
    """
    if subject.goal_checker is None or subject.dwb is None or subject.local is None:
        return
    name, checker = subject.goal_checker
    cell = subject.local.params.resolution
    if checker.xy_goal_tolerance < cell:
        yield Finding(
            CONTROLLER,
            f"{name}.xy_goal_tolerance",
            f"{checker.xy_goal_tolerance:g} m, but a cell of the local costmap is {cell:g} m wide",
            f"xy_goal_tolerance: {decimal(2.0 * cell)}, or local_costmap resolution: "
            f"{decimal(checker.xy_goal_tolerance / 2.0)}",
        )


@RULES.warning
def impatient(subject: Subject) -> Iterator[Finding]:
    """One failed control cycle aborts following.

    Why: a single scan in which every trajectory touches something clears the local costmap, obstacles that are out of
    sight included, and starts the recoveries.
    """
    if subject.server is None or subject.drive is None or subject.is_of_foxy:
        return  # Foxy has no such parameter
    tolerance, period = subject.server.failure_tolerance, 1.0 / subject.server.controller_frequency
    if 0.0 <= tolerance < period:
        given = "" if subject.value(CONTROLLER, "failure_tolerance") is not None else " (Nav2's default)"
        yield Finding(
            CONTROLLER,
            "failure_tolerance",
            f"{tolerance:g} s{given}, less than a control period of {period:g} s",
            "failure_tolerance: 0.3",
        )


@RULES.warning
def demanding_progress(subject: Subject) -> Iterator[Finding]:
    """The progress checker asks for more than half the top speed.

    Why: waiting for a pedestrian or creeping through a door counts as stuck and starts the recoveries.
    """
    if subject.progress_checker is None or subject.top_speed <= 0.0:
        return
    name, checker = subject.progress_checker
    if checker.movement_time_allowance <= 0.0:
        needed = math.inf
    else:
        needed = checker.required_movement_radius / checker.movement_time_allowance
    if needed > MOST_OF_TOP_SPEED * subject.top_speed:
        yield Finding(
            CONTROLLER,
            f"{name}.required_movement_radius",
            f"{checker.required_movement_radius:g} m in {checker.movement_time_allowance:g} s = {needed:.2f} m/s, "
            f"but the top speed is {subject.top_speed:g} m/s",
            f"movement_time_allowance: {above(5.0 * checker.required_movement_radius / subject.top_speed, 0)}",
        )


@RULES.warning
def turn_counts_as_stuck(subject: Subject) -> Iterator[Finding]:
    """Half a turn takes longer than the robot may stay in one place.

    Why: SimpleProgressChecker sees positions only: turning on the spot counts as stuck and is aborted half way.
    """
    if subject.progress_checker is None or hasattr(subject.progress_checker[1], "required_movement_angle"):
        return
    name, checker = subject.progress_checker
    rate = _turning_rate(subject)
    if rate > 0.0 and math.pi / rate > checker.movement_time_allowance > 0.0:
        yield Finding(
            CONTROLLER,
            f"{name}.movement_time_allowance",
            f"{checker.movement_time_allowance:g} s, but half a turn at {rate:g} rad/s takes {math.pi / rate:.1f} s",
            f"movement_time_allowance: {above(2.0 * math.pi / rate, 0)}, or "
            "nav2_controller::PoseProgressChecker, which counts turning as progress",
        )


@RULES.warning
def shim_hands_over_at_once(subject: Subject) -> Iterator[Finding]:
    """The rotation shim disengages at a larger heading error than it engages at.

    Why: in the range between them each turn ends in the cycle after it began; the robot twitches and drives off askew.
    """
    if subject.shim is None:
        return
    name, shim = subject.shim
    if shim.angular_disengage_threshold >= shim.angular_dist_threshold:
        yield Finding(
            CONTROLLER,
            f"{name}.angular_dist_threshold",
            f"{shim.angular_dist_threshold:g} rad, but turning ends below angular_disengage_threshold "
            f"{shim.angular_disengage_threshold:g} rad",
            f"angular_disengage_threshold: {decimal(shim.angular_dist_threshold / 2.0)}",
        )


@RULES.warning
def shim_turns_blind(subject: Subject) -> Iterator[Finding]:
    """The rotation shim does not look ahead.

    Why: no step of the turn is simulated, so corners of the robot sweep into whatever stands beside it.
    """
    if subject.shim is None or subject.server is None:
        return
    name, shim = subject.shim
    if shim.simulate_ahead_time < 1.0 / subject.server.controller_frequency:
        yield Finding(
            CONTROLLER,
            f"{name}.simulate_ahead_time",
            f"{shim.simulate_ahead_time:g} s, less than a control period",
            "simulate_ahead_time: 1.0",
        )


@RULES.warning
def shim_turns_too_fast(subject: Subject) -> Iterator[Finding]:
    """The rotation shim plans with more than the velocity smoother lets through.

    Why: it computes its last moment to brake with its own limits; the smoother brakes later and the turn overshoots.
    """
    if subject.shim is None or subject.smoother is None:
        return
    (name, shim), smoother = subject.shim, subject.smoother
    if shim.rotate_to_heading_angular_vel > smoother.max_velocity[2]:
        yield Finding(
            CONTROLLER,
            f"{name}.rotate_to_heading_angular_vel",
            f"{shim.rotate_to_heading_angular_vel:g} rad/s, but the velocity smoother allows "
            f"{smoother.max_velocity[2]:g} rad/s",
            f"rotate_to_heading_angular_vel: {decimal(smoother.max_velocity[2])}",
        )
    braking = min(smoother.max_accel[2], -smoother.max_decel[2])
    if braking < SOFTER * shim.max_angular_accel:
        yield Finding(
            CONTROLLER,
            f"{name}.max_angular_accel",
            f"{shim.max_angular_accel:g} rad/s2, but the velocity smoother allows {braking:g} rad/s2",
            f"max_angular_accel: {decimal(braking)}",
        )


def _turning_rate(subject: Subject) -> float:
    """How fast the robot turns on the spot, in [rad/s]; 0: unknown."""
    if subject.shim is not None:
        return subject.shim[1].rotate_to_heading_angular_vel
    return subject.dwb[1].max_vel_theta if subject.dwb is not None else 0.0
