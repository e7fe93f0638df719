"""Rules about the costmaps themselves: footprint, window, frames, range."""

from collections.abc import Iterator

import numpy as np

from navstack.geometry import holds_origin, pad_footprint
from navstack.params.costmap import robot_footprint
from navstack.params.lint.costmap_view import SENSOR_LAYERS, STATIC, CostmapView
from navstack.params.lint.rule import Finding, RuleGroup, above, below, whole_above
from navstack.params.lint.subject import CONTROLLER, Subject
from navstack.params.servers import ControllerServerParams

SMALLER = 0.8  # a footprint this much smaller than another one matters
SMALLEST, LARGEST = 0.02, 20.0  # [m] a side of a robot's box
NO_FOOTPRINT = ("", "[]")
COSTMAP_UPDATE_TIMEOUT = 0.3  # [s] the controller server's default

RULES = RuleGroup("Costmaps and frames", "local_costmap")


@RULES.warning
def no_footprint(subject: Subject, view: CostmapView) -> Iterator[Finding]:
    """A costmap has neither footprint nor robot_radius.

    Why: the robot is taken for a circle of 0.1 m and touches what it passes.
    """
    has_radius = subject.value(view.node, "robot_radius") is not None
    if not has_radius and view.params.footprint.strip() in NO_FOOTPRINT:
        yield Finding(
            "robot_radius",
            "neither footprint nor robot_radius: Nav2 takes a circle of 0.1 m",
            'robot_radius: 0.3, or footprint: "[[x, y], ...]"',
        )


@RULES.warning
def two_shapes(subject: Subject, view: CostmapView) -> Iterator[Finding]:
    """A costmap has both footprint and robot_radius.

    Why: the footprint wins silently; who changes the radius later changes nothing.
    """
    radius = subject.number(view.node, "robot_radius", 0.0)
    if radius > 0.0 and view.params.footprint.strip() not in NO_FOOTPRINT:
        yield Finding(
            "robot_radius",
            f"{radius:g} m beside a footprint that reaches {view.circumscribed:.2f} m",
            "remove one of them",
        )


@RULES.warning
def no_robots_size(subject: Subject, view: CostmapView) -> Iterator[Finding]:
    """A costmap's robot has the size of no robot.

    Why: the costmap takes it for a point, or for more than there is room for; lengths are in
    metres.
    """
    length, width = np.ptp(robot_footprint(view.params), axis=0).tolist()
    key = subject.shape_key(view.node)
    negative = key == "robot_radius" and view.params.robot_radius < 0.0
    if negative or min(length, width) < SMALLEST or max(length, width) > LARGEST:
        found = f"{length:.3g} m x {width:.3g} m"
        if negative:
            found = f"{view.params.robot_radius:g} m, a negative radius"
        yield Finding(key, found, f"give it in metres, {SMALLEST:g} to {LARGEST:g} on each side")


@RULES.warning
def base_beside_footprint(subject: Subject, view: CostmapView) -> Iterator[Finding]:
    """The footprint does not hold the base frame's origin.

    Why: poses are those of the base: the robot is taken to be beside itself, and turns about a
    point outside.
    """
    outline = robot_footprint(view.params)
    has_size = np.ptp(outline, axis=0).min() >= SMALLEST
    if has_size and not holds_origin(pad_footprint(outline, SMALLEST)):
        (left, low), (right, high) = outline.min(axis=0).tolist(), outline.max(axis=0).tolist()
        yield Finding(
            subject.shape_key(view.node),
            f"x from {left:g} to {right:g} m, y from {low:g} to {high:g} m",
            "give its corners relative to robot_base_frame",
        )


@RULES.warning
def planner_robot_is_smaller(
    subject: Subject, local: CostmapView, world: CostmapView
) -> Iterator[Finding]:
    """The planner's robot is smaller than the controller's.

    Why: paths lead through gaps that the controller refuses: the robot stands in front of them and
    recovers in vain.
    """
    if world.inscribed < SMALLER * local.inscribed:
        yield Finding(
            subject.shape_key(world.node),
            f"inscribed radius {world.inscribed:.2f} m, "
            f"but {local.inscribed:.2f} m in the local costmap",
            f"the {subject.shape_key(local.node)} of the local costmap",
            world.node,
        )


@RULES.warning
def fixed_local_window(local: CostmapView) -> Iterator[Finding]:
    """The local costmap does not move with the robot.

    Why: the robot leaves it after a few metres and stops, since every trajectory is off the map.
    """
    if not local.params.rolling_window and not local.has(STATIC):
        yield Finding(
            "rolling_window",
            f"false: {local.params.width:g} m x {local.params.height:g} m that do not move",
            "rolling_window: true",
        )


@RULES.warning
def world_without_map(world: CostmapView) -> Iterator[Finding]:
    """The global costmap has neither a map nor a rolling window.

    Why: goals and robot lie outside the costmap, so no plan is found.
    """
    if not world.params.rolling_window and not world.has(STATIC):
        yield Finding(
            "plugins",
            "no enabled StaticLayer and no rolling window: "
            f"{world.params.width:g} m x {world.params.height:g} m "
            f"at ({world.params.origin_x:g}, {world.params.origin_y:g})",
            "add a StaticLayer as the first layer, "
            "or rolling_window: true with width and height of the area",
            world.node,
        )


@RULES.warning
def local_in_map_frame(subject: Subject, local: CostmapView) -> Iterator[Finding]:
    """The local costmap lives in the map frame.

    Why: every correction of the localization shifts the robot against what it has marked: obstacles
    smear, and free ground is blocked.
    """
    if not local.params.rolling_window or not local.has(*SENSOR_LAYERS):
        return
    if str(subject.value(local.node, "global_frame") or "map").strip("/") == "map":
        note = subject.default_note(local.node, "global_frame")
        yield Finding("global_frame", f"map{note}", "global_frame: odom")


@RULES.warning
def large_cells(view: CostmapView) -> Iterator[Finding]:
    """A cell is larger than the robot's inscribed radius.

    Why: one marked cell is wider than the robot: doors close and the footprint check is a matter of
    luck.
    """
    if view.params.resolution > view.inscribed:
        yield Finding(
            "resolution",
            f"{view.params.resolution:g} m, "
            f"but the robot's inscribed radius is {view.inscribed:.2f} m",
            f"resolution: {below(max(0.01, 0.5 * view.inscribed))}",
        )


@RULES.warning
def sees_too_late(
    local: CostmapView, braking: float, server: ControllerServerParams, top_speed: float
) -> Iterator[Finding]:
    """Obstacles enter the local costmap when it is too late to brake.

    Why: at top speed the robot hits what stands in its way although it brakes at once.
    """
    marking = {name: source for name, source in local.sources() if source.marking}
    if not marking or top_speed <= 0.0 or local.params.update_frequency == 0.0:
        return
    farthest = seen = max(source.obstacle_max_range for source in marking.values())
    if local.params.rolling_window:
        seen = min(farthest, local.half_window)
    delay = 1.0 / local.params.update_frequency + 1.0 / server.controller_frequency
    front = float(local.footprint[:, 0].max())
    needed = top_speed * top_speed / (2.0 * braking) + top_speed * delay + front
    if seen < needed:
        found = (
            f"obstacles are seen up to {seen:g} m from the base, but stopping from "
            f"{top_speed:g} m/s at {braking:g} m/s2 with {delay:.2f} s delay takes {needed:.2f} m"
        )
        if seen < farthest:
            yield Finding("width", found, f"width: {whole_above(2.4 * needed)}")
        else:
            name = f"{next(iter(marking))}.obstacle_max_range"
            yield Finding(name, found, f"obstacle_max_range: {above(1.2 * needed, 0)}")


@RULES.warning
def late_costmap(
    subject: Subject, local: CostmapView, server: ControllerServerParams
) -> Iterator[Finding]:
    """The controller server gives up before a cleared local costmap is updated.

    Why: after each clearing Nav2 waits for the next update; where that comes too late,
    CONTROLLER_TIMED_OUT ends the navigation, for no recovery of the default tree answers it.
    """
    timeout = subject.number(CONTROLLER, "costmap_update_timeout", COSTMAP_UPDATE_TIMEOUT)
    frequency = local.params.update_frequency
    if frequency == 0.0:
        found = "0 Hz: it is never updated, and the robot does not move"
        yield Finding("update_frequency", found, "update_frequency: 5.0")
    elif 1.0 / frequency >= timeout and not subject.waits_for_costmaps:
        note = subject.default_note(CONTROLLER, "costmap_update_timeout")
        advice = f"costmap_update_timeout: {above(2.0 / frequency)} in the controller server"
        if timeout > 0.0:
            advice = f"update_frequency: {above(1.5 / timeout)}, or {advice}"
        yield Finding(
            "update_frequency",
            f"{frequency:g} Hz, an update each {1.0 / frequency:.2f} s, but costmap_update_timeout "
            f"of the controller server is {timeout:g} s{note}",
            advice,
        )


@RULES.warning
def unknown_is_free(subject: Subject, world: CostmapView) -> Iterator[Finding]:
    """The planner must avoid unknown space, but its costmap has none.

    Why: without track_unknown_space unknown cells are free: paths lead through unmapped ground all
    the same.
    """
    if world.params.track_unknown_space:
        return
    for name in subject.names("planner_server", "planner_plugins"):
        if subject.value("planner_server", f"{name}.allow_unknown", True) is False:
            yield Finding(
                "track_unknown_space",
                f"false, but {name}.allow_unknown is false",
                "track_unknown_space: true",
                world.node,
            )


@RULES.warning
def frames_disagree(subject: Subject) -> Iterator[Finding]:
    """Nodes disagree about a frame.

    Why: the parts of Nav2 mean different points by the robot's position: goals are missed and
    recoveries look in the wrong place (base_link and base_footprint may be mixed: they differ in
    height only).
    """
    groups = (
        (
            "robot_base_frame",
            ("bt_navigator", "global_costmap", "local_costmap", "behavior_server"),
        ),
        ("global_frame", ("bt_navigator", "global_costmap")),
    )
    for key, node_names in groups:
        given = {
            node: str(subject.value(node, key)).strip("/")
            for node in node_names
            if subject.value(node, key)
        }
        frames = set(given.values())
        if len(frames) > 1 and not frames <= {"base_link", "base_footprint"}:
            node, frame = list(given.items())[-1]
            others = ", ".join(f"{other} {name}" for other, name in given.items() if name != frame)
            yield Finding(
                key,
                f"{frame}, but {others}",
                f"{key}: {next(iter(given.values()))} everywhere",
                node,
            )
