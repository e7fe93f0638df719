"""Rules about DWB's trajectories and critics.

Does it see far enough, and does it score what matters?
"""

from collections.abc import Iterator

from navstack.params.dwb import DwbParams
from navstack.params.lint.costmap_view import CostmapView
from navstack.params.lint.rule import Finding, RuleGroup, above, below, decimal, whole_above
from navstack.params.lint.subject import CONTROLLER, DrivingPlugin
from navstack.params.servers import ControllerServerParams

HIGHEST_SOFT_COST = 252.0  # of a cell that may still be entered
# a footprint is far from round from here on (a square has 1.41); [m]
LONG_RATIO, LONG_MARGIN = 1.5, 0.1
OBSTACLE_CRITICS = ("BaseObstacle", "ObstacleFootprint")
PATH_CRITICS = ("PathDist", "PathAlign")
SLACK = 1.05  # a limit is exceeded by more than rounding

RULES = RuleGroup("DWB: trajectories and critics", CONTROLLER)


@RULES.warning
def beyond_the_plan(
    dwb: DwbParams, local: CostmapView, drive: DrivingPlugin, top_speed: float
) -> Iterator[Finding]:
    """DWB's trajectories are longer than the piece of the plan that it is shown.

    Why: Nav2 cuts the plan at forward_prune_distance along the straight line, and GoalDist and
    PathDist punish trajectories that end beyond it: the robot never reaches max_vel_x, whatever the
    limits say.
    """
    critics = {critic.rpartition("::")[2] for critic in dwb.critics}
    scores_the_end = critics & {"GoalDist", "PathDist"}
    if not dwb.shorten_transformed_plan or dwb.forward_prune_distance <= 0.0 or not scores_the_end:
        return
    shown = min(dwb.forward_prune_distance, local.half_window)
    reach = top_speed * dwb.sim_time
    if shown == dwb.forward_prune_distance and reach > SLACK * shown:
        driven = shown / dwb.sim_time
        advice = f"sim_time: {below(shown / top_speed)}; as it is, at most about {driven:.2f} m/s"
        if reach < local.half_window:
            advice = f"forward_prune_distance: {above(reach)}, or {advice}"
        yield Finding(
            f"{drive.name}.forward_prune_distance",
            f"the plan is cut {shown:g} m ahead, "
            f"but {top_speed:g} m/s x sim_time {dwb.sim_time:g} s reach {reach:.2f} m",
            advice,
        )


@RULES.warning
def beyond_the_window(
    dwb: DwbParams, local: CostmapView, drive: DrivingPlugin, top_speed: float
) -> Iterator[Finding]:
    """DWB's trajectories leave the local costmap.

    Why: a trajectory that leaves the costmap is rejected, so the high speeds are never driven.
    """
    if not local.params.rolling_window:
        return
    reach, half = top_speed * dwb.sim_time, local.half_window
    if reach > half:
        yield Finding(
            f"{drive.name}.sim_time",
            f"{top_speed:g} m/s x {dwb.sim_time:g} s = {reach:.2f} m, "
            f"but the local costmap ends {half:g} m from the robot",
            f"local_costmap width and height: {whole_above(2.2 * reach)}, "
            f"or sim_time: {below(0.9 * half / top_speed)}",
        )


@RULES.warning
def short_horizon(
    dwb: DwbParams,
    braking: float,
    server: ControllerServerParams,
    drive: DrivingPlugin,
    top_speed: float,
) -> Iterator[Finding]:
    """The robot cannot stop within DWB's horizon.

    Why: an obstacle enters the simulated trajectory when it is too late to brake for it.
    """
    needed = top_speed / (2.0 * braking) + 1.0 / server.controller_frequency
    if dwb.sim_time < needed:
        yield Finding(
            f"{drive.name}.sim_time",
            f"{dwb.sim_time:g} s, but stopping from {top_speed:g} m/s at {braking:g} m/s2 "
            f"covers what the robot drives in {needed:.2f} s",
            f"sim_time: {above(needed * 1.1)}",
        )


@RULES.warning
def coarse_steps(
    dwb: DwbParams, local: CostmapView, drive: DrivingPlugin, top_speed: float
) -> Iterator[Finding]:
    """DWB's scored poses are farther apart than a wall is thick.

    Why: obstacles are looked up at these poses only: a trajectory can step over a wall and counts
    as free.
    """
    fine = local.params.resolution
    key, step = "linear_granularity", dwb.linear_granularity
    if dwb.discretize_by_time:
        key, step = "time_granularity", top_speed * dwb.time_granularity
    step = min(step, top_speed * dwb.sim_time)
    thickness = 2.0 * local.inscribed + fine
    if step > thickness:
        value = below(fine / top_speed) if dwb.discretize_by_time else decimal(fine)
        yield Finding(
            f"{drive.name}.{key}",
            f"scored poses lie {step:.2f} m apart, "
            f"but a thin wall is {thickness:.2f} m thick in the costmap",
            f"{key}: {value}",
        )


@RULES.warning
def no_obstacle_critic(dwb: DwbParams, drive: DrivingPlugin) -> Iterator[Finding]:
    """No critic of DWB looks at obstacles.

    Why: trajectories through people and walls score as well as free ones; a scale of 0 switches a
    critic off.
    """
    if not _obstacle_critics(dwb):
        yield Finding(
            f"{drive.name}.critics",
            "neither BaseObstacle nor ObstacleFootprint scores "
            f"(critics: {', '.join(dwb.critics)})",
            "add ObstacleFootprint, or BaseObstacle for a round robot, with a scale above 0",
        )


@RULES.warning
def centre_only(dwb: DwbParams, local: CostmapView, drive: DrivingPlugin) -> Iterator[Finding]:
    """BaseObstacle is the only obstacle critic of a long or off-centre footprint.

    Why: it looks at the cell under the base only; corners beyond the inscribed circle hit what they
    swing past.
    """
    if _obstacle_critics(dwb) != {"BaseObstacle"}:
        return
    inscribed, circumscribed = local.inscribed, local.circumscribed
    if circumscribed > max(LONG_RATIO * inscribed, inscribed + LONG_MARGIN):
        yield Finding(
            f"{drive.name}.critics",
            f"only BaseObstacle guards the footprint: it sees the inscribed {inscribed:.2f} m "
            f"about the base, corners reach {circumscribed:.2f} m",
            "use ObstacleFootprint instead of BaseObstacle "
            "(critics: [..., ObstacleFootprint, ...])",
        )


@RULES.warning
def drowned_obstacles(
    dwb: DwbParams, local: CostmapView, drive: DrivingPlugin
) -> Iterator[Finding]:
    """The path critics outweigh BaseObstacle.

    Why: the robot cuts through inflated cells rather than leave the path by a cell: inflation has
    no effect on driving, only contact is avoided.
    """
    if _obstacle_critics(dwb) != {"BaseObstacle"}:
        return
    scales = [getattr(dwb, critic).scale for critic in PATH_CRITICS if critic in dwb.critics]
    per_metre = 0.5 * sum(scales)
    scale, cell = dwb.BaseObstacle.scale, local.params.resolution
    if scale * HIGHEST_SOFT_COST < cell * per_metre:
        worth = scale * HIGHEST_SOFT_COST / per_metre  # [m]
        wanted = 3.0 * cell * per_metre / HIGHEST_SOFT_COST
        yield Finding(
            f"{drive.name}.BaseObstacle.scale",
            f"{scale:g}: the highest cost of a free cell weighs as much as "
            f"{1000.0 * worth:.0f} mm off the path, less than a cell ({1000.0 * cell:.0f} mm)",
            f"BaseObstacle.scale: {above(wanted, 3)} (three cells)",
        )


@RULES.warning
def long_nose(dwb: DwbParams, local: CostmapView, drive: DrivingPlugin) -> Iterator[Finding]:
    """An alignment critic scores a point far ahead of the robot.

    Why: this point is pulled onto the path regardless of obstacles, so that the robot itself swings
    inside at corners.
    """
    longest = max(2.0 * local.circumscribed, 0.325)  # Nav2's default
    for critic in ("PathAlign", "GoalAlign"):
        params = getattr(dwb, critic)
        if critic in dwb.critics and params.scale > 0.0 and params.forward_point_distance > longest:
            yield Finding(
                f"{drive.name}.{critic}.forward_point_distance",
                f"{params.forward_point_distance:g} m ahead of the base, but the robot ends "
                f"{local.circumscribed:.2f} m from it",
                f"{critic}.forward_point_distance: {above(local.circumscribed)}",
            )


def _obstacle_critics(dwb: DwbParams) -> set[str]:
    """The obstacle critics that have a weight, by type."""
    scales = {
        each.type: each.params.scale
        for each in dwb.named_critics.values()
        if "Obstacle" in each.type
    }
    scales |= {name: getattr(dwb, name).scale for name in OBSTACLE_CRITICS if name in dwb.critics}
    return {name for name, scale in scales.items() if scale > 0.0}
