"""Rules about DWB's limits and samples: can it choose what it must?"""

from collections.abc import Iterator

from navstack.params.dwb import DwbParams
from navstack.params.lint.rule import Finding, RuleGroup, above, decimal
from navstack.params.lint.subject import CONTROLLER, DrivingPlugin

FEW_SAMPLES = 2  # Nav2 raises fewer to this: both ends of the range and nothing between

RULES = RuleGroup("DWB: limits and samples", CONTROLLER)


@RULES.warning
def crossed_limits(dwb: DwbParams, drive: DrivingPlugin) -> Iterator[Finding]:
    """A lower limit of DWB lies above its upper one.

    Why: no velocity satisfies both, and Nav2 does not check: DWB fails in every cycle or drives at
    one end only.
    """
    if dwb.max_vel_theta < 0.0:
        name = f"{drive.name}.max_vel_theta"
        yield Finding(name, f"{dwb.max_vel_theta:g} rad/s", "max_vel_theta: 0.1 or more")
    pairs = (  # and whether the upper one limits anything
        ("min_vel_x", "max_vel_x", True),
        ("min_vel_y", "max_vel_y", True),
        ("min_speed_xy", "max_speed_xy", dwb.max_speed_xy > 0.0),
        ("min_speed_theta", "max_vel_theta", dwb.max_vel_theta > 0.0),
    )
    for low_name, high_name, is_limit in pairs:
        low, high = getattr(dwb, low_name), getattr(dwb, high_name)
        if is_limit and low > high:
            yield Finding(
                f"{drive.name}.{low_name}",
                f"{low_name} {low:g} is above {high_name} {high:g}",
                f"{high_name}: {decimal(max(low, 0.1))} or more",
            )


@RULES.warning
def wrong_sign(dwb: DwbParams, drive: DrivingPlugin) -> Iterator[Finding]:
    """An acceleration of DWB is negative, or a deceleration positive.

    Why: the range of reachable velocities comes out upside down and nothing is sampled in it.
    """
    for axis in ("x", "y", "theta"):
        for key, sign in ((f"acc_lim_{axis}", 1.0), (f"decel_lim_{axis}", -1.0)):
            value = getattr(dwb, key)
            if value * sign < 0.0:
                yield Finding(
                    f"{drive.name}.{key}", f"{key} is {value:g}", f"{key}: {decimal(-value)}"
                )


@RULES.warning
def no_acceleration(dwb: DwbParams, drive: DrivingPlugin) -> Iterator[Finding]:
    """DWB may move along an axis but not change its velocity.

    Why: only velocities that the robot has already are sampled: from standstill it never starts,
    and it never brakes.
    """
    axes = (("x", dwb.max_vel_x, 2.5), ("y", dwb.max_vel_y, 2.5), ("theta", dwb.max_vel_theta, 3.2))
    for axis, speed, usual in axes:
        for key, value in ((f"acc_lim_{axis}", usual), (f"decel_lim_{axis}", -usual)):
            if speed > 0.0 and getattr(dwb, key) == 0.0:
                yield Finding(
                    f"{drive.name}.{key}",
                    f"{key} is 0, which is also Nav2's default",
                    f"{key}: {decimal(value)}, or what the drive can do",
                )


@RULES.warning
def capped_speed(dwb: DwbParams, drive: DrivingPlugin) -> Iterator[Finding]:
    """max_speed_xy lies below max_vel_x.

    Why: max_speed_xy bounds the speed over ground, so max_vel_x is never reached.
    """
    if 0.0 < dwb.max_speed_xy < 0.99 * dwb.max_vel_x:
        yield Finding(
            f"{drive.name}.max_speed_xy",
            f"{dwb.max_speed_xy:g} m/s, but max_vel_x is {dwb.max_vel_x:g} m/s",
            f"max_speed_xy: {decimal(dwb.max_vel_x)}, or max_vel_x: {decimal(dwb.max_speed_xy)}",
        )


@RULES.warning
def idle_minimum(dwb: DwbParams, drive: DrivingPlugin) -> Iterator[Finding]:
    """Only one of min_speed_xy and min_speed_theta is set.

    Why: Nav2 drops a sample only if it is slower than both, and nothing is slower than 0: this
    minimum has no effect, and the drive is asked for turns in its deadband.
    """
    linear, angular = dwb.min_speed_xy, dwb.min_speed_theta
    if angular > 0.0 and linear == 0.0:
        yield Finding(
            f"{drive.name}.min_speed_theta",
            f"{angular:g} rad/s, with min_speed_xy 0",
            "min_speed_xy: 0.05, or the slowest speed that the drive can hold; "
            "or min_speed_theta: 0.0",
        )
    elif linear > 0.0 and angular == 0.0:
        yield Finding(
            f"{drive.name}.min_speed_xy",
            f"{linear:g} m/s, with min_speed_theta 0",
            "min_speed_theta: 0.2, or the slowest turn that the drive can hold; "
            "or min_speed_xy: 0.0",
        )


@RULES.warning
def short_reach(dwb: DwbParams, drive: DrivingPlugin) -> Iterator[Finding]:
    """sim_time x acceleration does not span DWB's speeds.

    Why: the samples end where the acceleration leads within sim_time: from standstill the top speed
    is not among them and the start is hesitant, and from the top speed a stop is not.
    """
    if dwb.trajectory_generator_name.endswith("LimitedAccelGenerator"):
        return
    top = dwb.max_vel_x
    for key, start, sign, what in (
        ("acc_lim_x", 0.0, 1.0, "from standstill at most"),
        ("decel_lim_x", top, -1.0, "from full speed at least"),
    ):
        reach = abs(getattr(dwb, key)) * dwb.sim_time  # [m/s]
        if 0.0 < reach < 0.999 * top:
            yield Finding(
                f"{drive.name}.sim_time",
                f"{key} x sim_time is {reach:g} m/s, max_vel_x {top:g} m/s: "
                f"{what} {start + sign * reach:g} m/s is sampled",
                f"sim_time: {above(top * dwb.sim_time / reach)} or more, "
                f"or max_vel_x: {decimal(reach)}",
            )


@RULES.warning
def few_samples(dwb: DwbParams, drive: DrivingPlugin) -> Iterator[Finding]:
    """DWB tries an axis only at the ends of its range.

    Why: the robot drives at full speed or not at all and swings from one side to the other.
    """
    axes = (
        ("vx_samples", dwb.vx_samples, dwb.max_vel_x > dwb.min_vel_x),
        ("vy_samples", dwb.vy_samples, dwb.max_vel_y > dwb.min_vel_y),
        ("vtheta_samples", dwb.vtheta_samples, dwb.max_vel_theta > 0.0),
    )
    for key, count, moves in axes:
        if moves and count <= FEW_SAMPLES:
            usual = getattr(DwbParams(), key)
            yield Finding(
                f"{drive.name}.{key}", f"{key} is {count}", f"{key}: {usual} (Nav2's default)"
            )
