"""Rules about DWB's trajectories and critics: does it see far enough, and does it score what matters?"""

import math
from collections.abc import Iterator

from navstack.params.lint.rule import Finding, RuleGroup, above, below, decimal, whole_above
from navstack.params.lint.subject import CONTROLLER, Subject

HIGHEST_SOFT_COST = 252.0  # of a cell that may still be entered
LONG_RATIO, LONG_MARGIN = 1.5, 0.1  # a footprint is far from round from here on (a square has 1.41); [m]
OBSTACLE_CRITICS = ("BaseObstacle", "ObstacleFootprint")
SLACK = 1.05  # a limit is exceeded by more than rounding

RULES = RuleGroup("DWB: trajectories and critics")


@RULES.warning
def beyond_the_plan(subject: Subject) -> Iterator[Finding]:
    """DWB's trajectories are longer than the piece of the plan that it is shown.

    Why: Nav2 cuts the plan at forward_prune_distance along the straight line, and GoalDist and PathDist punish
    trajectories that end beyond it: the robot never reaches max_vel_x, whatever the limits say.
    """
    if subject.dwb is None or subject.local is None:
        return
    name, dwb = subject.dwb
    scores_the_end = {critic.rpartition("::")[2] for critic in dwb.critics} & {"GoalDist", "PathDist"}
    if not dwb.shorten_transformed_plan or dwb.forward_prune_distance <= 0.0 or not scores_the_end:
        return
    shown = min(dwb.forward_prune_distance, subject.local.half_window)
    reach = subject.top_speed * dwb.sim_time
    if shown == dwb.forward_prune_distance and reach > SLACK * shown:
        longer = f"forward_prune_distance: {above(reach)}, or " if reach < subject.local.half_window else ""
        yield Finding(
            CONTROLLER,
            f"{name}.forward_prune_distance",
            f"the plan is cut {shown:g} m ahead, but {subject.top_speed:g} m/s x sim_time {dwb.sim_time:g} s reach "
            f"{reach:.2f} m",
            f"{longer}sim_time: {below(shown / subject.top_speed)}; "
            f"as it is, at most about {shown / dwb.sim_time:.2f} m/s",
        )


@RULES.warning
def beyond_the_window(subject: Subject) -> Iterator[Finding]:
    """DWB's trajectories leave the local costmap.

    Why: a trajectory that leaves the costmap is rejected, so the high speeds are never driven.
    """
    if subject.dwb is None or subject.local is None or not subject.local.params.rolling_window:
        return
    name, dwb = subject.dwb
    reach, half = subject.top_speed * dwb.sim_time, subject.local.half_window
    if reach > half:
        yield Finding(
            CONTROLLER,
            f"{name}.sim_time",
            f"{subject.top_speed:g} m/s x {dwb.sim_time:g} s = {reach:.2f} m, but the local costmap ends {half:g} m "
            "from the robot",
            f"local_costmap width and height: {whole_above(2.2 * reach)}, or sim_time: "
            f"{below(0.9 * half / subject.top_speed)}",
        )


@RULES.warning
def short_horizon(subject: Subject) -> Iterator[Finding]:
    """The robot cannot stop within DWB's horizon.

    Why: an obstacle enters the simulated trajectory when it is too late to brake for it.
    """
    if subject.dwb is None or subject.braking is None or subject.server is None:
        return
    name, dwb = subject.dwb
    needed = subject.top_speed / (2.0 * subject.braking) + 1.0 / subject.server.controller_frequency
    if dwb.sim_time < needed:
        yield Finding(
            CONTROLLER,
            f"{name}.sim_time",
            f"{dwb.sim_time:g} s, but stopping from {subject.top_speed:g} m/s at {subject.braking:g} m/s2 covers what "
            f"the robot drives in {needed:.2f} s",
            f"sim_time: {above(needed * 1.1)}",
        )


@RULES.warning
def coarse_steps(subject: Subject) -> Iterator[Finding]:
    """DWB's scored poses are farther apart than a wall is thick.

    Why: obstacles are looked up at these poses only: a trajectory can step over a wall and counts as free.
    """
    if subject.dwb is None or subject.local is None:
        return
    name, dwb = subject.dwb
    key = "time_granularity" if dwb.discretize_by_time else "linear_granularity"
    step = subject.top_speed * dwb.time_granularity if dwb.discretize_by_time else dwb.linear_granularity
    step = min(step, subject.top_speed * dwb.sim_time)
    thickness = 2.0 * subject.local.inscribed + subject.local.params.resolution
    if step > thickness:
        fine = subject.local.params.resolution
        value = below(fine / subject.top_speed) if dwb.discretize_by_time else decimal(fine)
        yield Finding(
            CONTROLLER,
            f"{name}.{key}",
            f"scored poses lie {step:.2f} m apart, but a thin wall is {thickness:.2f} m thick in the costmap",
            f"{key}: {value}",
        )


@RULES.warning
def no_obstacle_critic(subject: Subject) -> Iterator[Finding]:
    """No critic of DWB looks at obstacles.

    Why: trajectories through people and walls score as well as free ones; a scale of 0 switches a critic off.
    """
    if subject.dwb is None:
        return
    name, dwb = subject.dwb
    if not _obstacle_critics(subject):
        yield Finding(
            CONTROLLER,
            f"{name}.critics",
            f"neither BaseObstacle nor ObstacleFootprint scores (critics: {', '.join(dwb.critics)})",
            "add ObstacleFootprint, or BaseObstacle for a round robot, with a scale above 0",
        )


@RULES.warning
def centre_only(subject: Subject) -> Iterator[Finding]:
    """BaseObstacle is the only obstacle critic of a long or off-centre footprint.

    Why: it looks at the cell under the base only; corners beyond the inscribed circle hit what they swing past.
    """
    if subject.dwb is None or subject.local is None or _obstacle_critics(subject) != {"BaseObstacle"}:
        return
    inscribed, circumscribed = subject.local.inscribed, subject.local.circumscribed
    if circumscribed > max(LONG_RATIO * inscribed, inscribed + LONG_MARGIN):
        yield Finding(
            CONTROLLER,
            f"{subject.dwb[0]}.critics",
            f"only BaseObstacle guards a footprint that reaches {circumscribed:.2f} m from the base, of which "
            f"{inscribed:.2f} m are seen",
            "use ObstacleFootprint instead of BaseObstacle (critics: [..., ObstacleFootprint, ...])",
        )


@RULES.warning
def drowned_obstacles(subject: Subject) -> Iterator[Finding]:
    """The path critics outweigh BaseObstacle.

    Why: the robot cuts through inflated cells rather than leave the path by a cell: inflation has no effect on driving,
    only contact is avoided.
    """
    if subject.dwb is None or subject.local is None or _obstacle_critics(subject) != {"BaseObstacle"}:
        return
    name, dwb = subject.dwb
    per_metre = 0.5 * sum(getattr(dwb, critic).scale for critic in ("PathDist", "PathAlign") if critic in dwb.critics)
    worth = dwb.BaseObstacle.scale * HIGHEST_SOFT_COST / per_metre if per_metre > 0.0 else math.inf  # [m]
    cell = subject.local.params.resolution
    if worth < cell:
        yield Finding(
            CONTROLLER,
            f"{name}.BaseObstacle.scale",
            f"{dwb.BaseObstacle.scale:g}: the highest cost of a free cell weighs as much as {1000.0 * worth:.0f} mm "
            f"off the path, less than a cell ({1000.0 * cell:.0f} mm)",
            f"BaseObstacle.scale: {above(3.0 * cell * per_metre / HIGHEST_SOFT_COST, 3)} (three cells)",
        )


@RULES.warning
def long_nose(subject: Subject) -> Iterator[Finding]:
    """An alignment critic scores a point far ahead of the robot.

    Why: this point is pulled onto the path regardless of obstacles, so that the robot itself swings inside at corners.
    """
    if subject.dwb is None or subject.local is None:
        return
    name, dwb = subject.dwb
    longest = max(2.0 * subject.local.circumscribed, 0.325)  # Nav2's default
    for critic in ("PathAlign", "GoalAlign"):
        params = getattr(dwb, critic)
        if critic in dwb.critics and params.scale > 0.0 and params.forward_point_distance > longest:
            yield Finding(
                CONTROLLER,
                f"{name}.{critic}.forward_point_distance",
                f"{params.forward_point_distance:g} m ahead of the base, but the robot ends "
                f"{subject.local.circumscribed:.2f} m from it",
                f"{critic}.forward_point_distance: {above(subject.local.circumscribed)}",
            )


def _obstacle_critics(subject: Subject) -> set[str]:
    """The obstacle critics that have a weight, by type."""
    if subject.dwb is None:
        return set()
    dwb = subject.dwb[1]
    scales = {each.type: each.params.scale for each in dwb.named_critics.values() if "Obstacle" in each.type}
    scales |= {name: getattr(dwb, name).scale for name in OBSTACLE_CRITICS if name in dwb.critics}
    return {name for name, scale in scales.items() if scale > 0.0}
