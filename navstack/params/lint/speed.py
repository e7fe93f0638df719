"""Rules about the nodes between the controller and the wheels, and about speeds and rates."""

from collections.abc import Iterator

from navstack.params.dwb import DwbParams
from navstack.params.lint.costmap_view import CostmapView
from navstack.params.lint.rule import Finding, RuleGroup, above, decimal
from navstack.params.lint.subject import (
    BEHAVIORS,
    CONTROLLER,
    MONITOR,
    PURSUIT,
    SMOOTHER,
    DrivingPlugin,
    Subject,
)
from navstack.params.safety import VelocitySmootherParams
from navstack.params.servers import ControllerServerParams

SOFTER = 0.8  # a limit this much below another one matters
LARGE_DEADBAND = 0.25  # share of the top speed
LONGEST_BLIND_DRIVE = 0.25  # [m] between two updates

RULES = RuleGroup("Speed: smoother, recoveries, rates", SMOOTHER)


@RULES.warning
def smoother_caps(
    subject: Subject, smoother: VelocitySmootherParams, top_speed: float
) -> Iterator[Finding]:
    """The velocity smoother allows less speed than the controller commands.

    Why: the robot is slower than simulated: DWB turns in curves that the robot does not drive, and
    never learns of it.
    """
    dwb = subject.dwb
    if top_speed > 1.01 * smoother.max_velocity[0]:
        yield _limit(subject, "max_velocity", 0, subject.speed_name, top_speed, "m/s")
    if dwb is None or subject.drive is None:
        return
    name = f"{subject.drive.name}.max_vel_theta"
    if dwb.max_vel_theta > 1.01 * smoother.max_velocity[2]:
        yield _limit(subject, "max_velocity", 2, name, dwb.max_vel_theta, "rad/s")
    elif dwb.max_vel_theta > -1.01 * smoother.min_velocity[2]:
        yield Finding(
            "min_velocity",
            f"{smoother.min_velocity[2]:g} rad/s, but the controller turns right at up to {name} "
            f"{dwb.max_vel_theta:g} rad/s",
            f"min_velocity: [..., {decimal(-dwb.max_vel_theta)}], "
            f"or {name}: {decimal(-smoother.min_velocity[2])}",
        )


@RULES.warning
def smoother_is_softer(
    subject: Subject, smoother: VelocitySmootherParams, dwb: DwbParams, drive: DrivingPlugin
) -> Iterator[Finding]:
    """The velocity smoother changes speed more gently than DWB simulates.

    Why: DWB trusts in brakes that it does not have: stops end later and curves wider than the
    trajectories it checked.
    """
    limits = (
        ("max_accel", 0, "acc_lim_x", "m/s2"),
        ("max_decel", 0, "decel_lim_x", "m/s2"),
        ("max_accel", 2, "acc_lim_theta", "rad/s2"),
        ("max_decel", 2, "decel_lim_theta", "rad/s2"),
    )
    for key, axis, dwb_key, unit in limits:
        assumed = getattr(dwb, dwb_key)
        if abs(getattr(smoother, key)[axis]) < SOFTER * abs(assumed):
            yield _limit(subject, key, axis, f"{drive.name}.{dwb_key}", assumed, unit)


@RULES.warning
def smoother_is_slower(
    smoother: VelocitySmootherParams, server: ControllerServerParams
) -> Iterator[Finding]:
    """The velocity smoother runs less often than the controller.

    Why: it drops commands and adds up to a period of delay, so the controller corrects what it does
    not see.
    """
    ours, theirs = smoother.smoothing_frequency, server.controller_frequency
    if ours < 0.99 * theirs:
        yield Finding(
            "smoothing_frequency",
            f"{ours:g} Hz, but the controller runs at {theirs:g} Hz",
            f"smoothing_frequency: {decimal(theirs)}",
        )


@RULES.warning
def large_deadband(
    subject: Subject, smoother: VelocitySmootherParams, top_speed: float
) -> Iterator[Finding]:
    """The deadband swallows commands that are needed.

    Why: slow commands are sent as 0: the robot stops in front of the goal or in its turn and stays
    there until it is aborted.
    """
    linear, _, angular = smoother.deadband_velocity
    if top_speed > 0.0 and linear > LARGE_DEADBAND * top_speed:
        yield Finding(
            "deadband_velocity",
            f"{linear:g} m/s of a top speed of {top_speed:g} m/s",
            f"at most {0.1 * top_speed:.2g} m/s; the drive itself may keep a larger one",
        )
    slowest = subject.number(BEHAVIORS, "min_rotational_vel", 0.4)
    if subject.has(BEHAVIORS) and subject.smooths_behaviors and angular > slowest:
        yield Finding(
            "deadband_velocity",
            f"{angular:g} rad/s, "
            f"but the Spin recovery slows down to min_rotational_vel {slowest:g} rad/s",
            f"behavior_server min_rotational_vel: {decimal(angular * 1.1, 2)}",
        )


@RULES.warning
def no_way_back(subject: Subject, smoother: VelocitySmootherParams) -> Iterator[Finding]:
    """The velocity smoother does not let the robot drive backwards.

    Why: BackUp stands still until its time is up, so a robot that is stuck nose first stays stuck.
    """
    if smoother.min_velocity[0] < 0.0:
        return
    if subject.dwb is not None and subject.dwb.min_vel_x < 0.0:
        reason = "DWB's min_vel_x is negative"
    elif subject.smooths_behaviors and any(
        kind.endswith("BackUp") for kind in subject.behavior_types
    ):
        reason = "the BackUp recovery is listed"
    else:
        return
    yield Finding(
        "min_velocity",
        f"{smoother.min_velocity[0]:g} m/s forwards at least, but {reason}",
        "min_velocity: [-0.3, 0.0, ...] with what the robot may drive backwards",
    )


@RULES.warning
def crossed_spin(subject: Subject) -> Iterator[Finding]:
    """min_rotational_vel lies above max_rotational_vel.

    Why: the Spin recovery turns at a speed that the file forbids and overshoots.
    """
    low = subject.number(BEHAVIORS, "min_rotational_vel", 0.4)
    high = subject.number(BEHAVIORS, "max_rotational_vel", 1.0)
    if subject.has(BEHAVIORS) and low > high:
        yield Finding(
            "min_rotational_vel",
            f"{low:g} rad/s is above max_rotational_vel {high:g} rad/s",
            f"min_rotational_vel: {decimal(0.4 * high)}",
            BEHAVIORS,
        )


@RULES.warning
def blind_recoveries(subject: Subject) -> Iterator[Finding]:
    """Spin and BackUp do not look ahead.

    Why: they turn and drive into whatever stands beside or behind the robot.
    """
    ahead = subject.number(BEHAVIORS, "simulate_ahead_time", 2.0)
    frequency = subject.number(BEHAVIORS, "cycle_frequency", 10.0)
    if subject.has(BEHAVIORS) and frequency > 0.0 and ahead < 1.0 / frequency:
        yield Finding(
            "simulate_ahead_time",
            f"{ahead:g} s, less than a cycle of {1.0 / frequency:g} s",
            "simulate_ahead_time: 2.0",
            BEHAVIORS,
        )


@RULES.warning
def blind_drive(local: CostmapView, top_speed: float) -> Iterator[Finding]:
    """The local costmap is updated too rarely for the speed.

    Why: a pedestrian who steps out is not in the costmap while the robot drives this far.
    """
    frequency = local.params.update_frequency
    if frequency == 0.0:
        return
    driven = top_speed / frequency
    if driven > LONGEST_BLIND_DRIVE:
        yield Finding(
            "update_frequency",
            f"{frequency:g} Hz: at {top_speed:g} m/s "
            f"the robot drives {driven:.2f} m between two updates",
            f"update_frequency: {above(top_speed / 0.1, 0)} (every 10 cm)",
            local.node,
        )


@RULES.warning
def slow_controller(server: ControllerServerParams, top_speed: float) -> Iterator[Finding]:
    """The controller decides too rarely for the speed.

    Why: the command is kept while the robot drives this far, whatever appears.
    """
    frequency = server.controller_frequency
    driven = top_speed / frequency
    if driven > LONGEST_BLIND_DRIVE:
        yield Finding(
            "controller_frequency",
            f"{frequency:g} Hz: at {top_speed:g} m/s "
            f"the robot drives {driven:.2f} m between two commands",
            "controller_frequency: 20.0",
            CONTROLLER,
        )


@RULES.warning
def blind_pursuit(subject: Subject, drive: DrivingPlugin) -> Iterator[Finding]:
    """Pure pursuit without collision detection, and no collision monitor.

    Why: nothing between the planner's last path and the wheels looks at obstacles.
    """
    name = f"{drive.name}.use_collision_detection"
    if (
        drive.type == PURSUIT
        and not subject.has(MONITOR)
        and subject.value(CONTROLLER, name, True) is False
    ):
        advice = "use_collision_detection: true"
        yield Finding(name, "false, and the file has no collision_monitor", advice, CONTROLLER)


def _limit(subject: Subject, key: str, axis: int, other: str, wanted: float, unit: str) -> Finding:
    limits = list(getattr(subject.smoother, key))
    value, limits[axis] = limits[axis], wanted
    note = subject.default_note(SMOOTHER, key, ", Nav2's default as the file leaves it out")
    return Finding(
        key,
        f"{value:g} {unit}{note}, but the controller counts on {other} {wanted:g} {unit}",
        f"{key}: [{', '.join(map(decimal, limits))}], or {other}: {decimal(value)}",
    )
