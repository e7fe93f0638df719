"""Rules about costmap layers: inflation, marking and clearing."""

import math
from collections.abc import Iterator

from navstack.params.lint.costmap_view import (
    INFLATION,
    MARKING_LAYERS,
    SENSOR_LAYERS,
    STATIC,
    VOXEL,
    CostmapView,
)
from navstack.params.lint.rule import Finding, RuleGroup, above, decimal
from navstack.params.lint.subject import Subject

ROUND = 1.1  # a footprint whose outer radius is at most this much larger than its inner one
HIGHEST_SOFT_COST = 252.0  # of a cell that may still be entered
FLAT = 0.5  # share of the highest cost that is left where inflation ends
STEEP = 0.2  # [m] within which the cost falls to nothing
# others may mark by themselves
KNOWN_LAYERS = {STATIC, INFLATION, *SENSOR_LAYERS} | {
    f"nav2_costmap_2d::{name}" for name in ("DenoiseLayer", "KeepoutFilter", "SpeedFilter")
}
OPEN_SPACE = 5.0  # [m] obstacle range from which beams without a return are common
LONG_PERSISTENCE = 1.0  # [s]
WALKING_SPEED = 1.4  # [m/s] of a pedestrian

RULES = RuleGroup("Costmap layers")


@RULES.warning
def narrow_inflation(view: CostmapView) -> Iterator[Finding]:
    """The inflation radius is smaller than the robot.

    Why: cells where the robot would touch cost nothing, so paths are planned through them (for a
    robot that is not round its outer radius counts: its corners swing that far).
    """
    for name, params in view.inflations.items():
        needed, which = view.circumscribed, "circumscribed"
        if view.circumscribed <= ROUND * view.inscribed:
            needed, which = view.inscribed, "inscribed"
        if params.inflation_radius < needed - view.params.resolution:
            yield Finding(
                f"{name}.inflation_radius",
                f"{params.inflation_radius:g} m, "
                f"but the padded footprint's {which} radius is {needed:.2f} m",
                f"inflation_radius: {above(needed + 0.2)}",
            )


@RULES.warning
def flat_inflation(view: CostmapView) -> Iterator[Finding]:
    """The inflated cost hardly falls up to its edge.

    Why: the slope is too weak to keep the robot off: paths cut corners at the inscribed radius,
    where every error of localization is a contact.
    """
    for name, params in view.inflations.items():
        width = params.inflation_radius - view.inscribed
        left = math.exp(-params.cost_scaling_factor * max(width, 0.0))
        if width > 0.1 and left > FLAT:
            yield Finding(
                f"{name}.cost_scaling_factor",
                f"{params.cost_scaling_factor:g}/m: the cost falls only from 252 to "
                f"{HIGHEST_SOFT_COST * left:.0f} over the {width:.2f} m "
                "beyond the inscribed radius, then to 0",
                f"cost_scaling_factor: {math.log(20.0) / width:.1f} (5 % are left at the edge)",
            )


@RULES.warning
def steep_inflation(view: CostmapView) -> Iterator[Finding]:
    """The inflated cost has fallen to nothing right beside the robot.

    Why: paths hug walls at the inscribed radius, and every localization error becomes a contact.
    """
    for name, params in view.inflations.items():
        width, factor = params.inflation_radius - view.inscribed, params.cost_scaling_factor
        highest = math.log(HIGHEST_SOFT_COST)
        if highest < STEEP * factor and width > STEEP:
            yield Finding(
                f"{name}.cost_scaling_factor",
                f"{factor:g}/m: the cost is below 1 from {highest / factor:.2f} m "
                "beyond the inscribed radius on",
                f"cost_scaling_factor: {math.log(20.0) / width:.1f}",
            )


@RULES.warning
def not_inflated(view: CostmapView) -> Iterator[Finding]:
    """A layer marks obstacles after the inflation layer.

    Why: what it marks is not inflated: planner and BaseObstacle see no need to keep the robot's
    width away from it.
    """
    inflations = [i for i, layer in enumerate(view.layers) if layer.type == INFLATION]
    last = max(inflations, default=len(view.layers))
    late = [layer.name for layer in view.layers[last + 1 :] if layer.type in MARKING_LAYERS]
    if late:
        yield Finding(
            "plugins",
            f"{', '.join(late)} after {view.layers[last].name}",
            f"plugins: [{_right_order(view)}]",
        )


@RULES.warning
def static_hides_scan(view: CostmapView) -> Iterator[Finding]:
    """A StaticLayer without use_maximum stands behind a layer that marks obstacles.

    Why: it overwrites every cell of the map, free ones included: of what the sensors see there
    nothing is left, and the robot drives into it.
    """
    last = max((i for i, layer in enumerate(view.layers) if layer.type == STATIC), default=0)
    hidden = [layer.name for layer in view.layers[:last] if layer.marks_what_is_seen]
    if hidden and not view.params.use_maximum:
        yield Finding(
            "plugins",
            f"{view.layers[last].name} after {', '.join(hidden)}, without use_maximum",
            f"plugins: [{_right_order(view)}]",
        )


@RULES.warning
def no_inflation(subject: Subject, view: CostmapView) -> Iterator[Finding]:
    """A costmap that takes the robot for a point has no inflation layer.

    Why: the centre of the robot may go up to the wall.
    """
    if (
        view.has(*MARKING_LAYERS)
        and not view.has(INFLATION)
        and _takes_robot_for_a_point(subject, view)
    ):
        yield Finding(
            "plugins",
            "no enabled InflationLayer",
            "add one as the last layer: inflation_layer: "
            '{plugin: "nav2_costmap_2d::InflationLayer", '
            f"inflation_radius: {above(view.circumscribed + 0.2)}}}",
        )


@RULES.warning
def short_clearing(view: CostmapView) -> Iterator[Finding]:
    """Obstacles are marked farther away than they are cleared.

    Why: what was marked beyond the clearing range stays for good: ghosts that block the way.
    """
    for name, source in view.sources():
        marked, cleared = source.obstacle_max_range, source.raytrace_max_range
        if source.marking and source.clearing and cleared < marked:
            yield Finding(
                f"{name}.raytrace_max_range",
                f"clears up to {cleared:g} m, but marks up to {marked:g} m",
                f"raytrace_max_range: {decimal(marked + 0.5)}",
            )


@RULES.warning
def never_cleared(view: CostmapView) -> Iterator[Finding]:
    """A layer marks obstacles and never clears them.

    Why: whoever walked past stays in the costmap until it leaves the window or a recovery clears
    everything.
    """
    for layer in view.layers:
        marking = [name for name, source in layer.sources.items() if source.marking]
        clears = any(source.clearing for source in layer.sources.values())
        if layer.type in SENSOR_LAYERS and marking and not clears:
            found = f"{marking[0]} only marks"
            if marking[1:]:
                found = f"{', '.join(marking)} of {layer.name} only mark"
            name = f"{layer.name}.{marking[0]}.clearing"
            yield Finding(name, found, f"{name}: true")


@RULES.warning
def nothing_marks(local: CostmapView) -> Iterator[Finding]:
    """No layer of the local costmap marks what sensors see.

    Why: the controller drives into everything that no map shows: people, bins, doors.
    """
    kinds = {layer.type for layer in local.layers}
    if not kinds <= KNOWN_LAYERS or any(layer.marks_what_is_seen for layer in local.layers):
        return
    name, found = "plugins", "no obstacle layer is on and has a source"
    advice = "list an obstacle_layer with enabled: true and observation_sources: scan"
    for source, _ in local.sources():
        name, found, advice = f"{source}.marking", "false everywhere", f"{source}.marking: true"
    yield Finding(name, found, advice, local.node)


@RULES.warning
def blind_source(subject: Subject, view: CostmapView) -> Iterator[Finding]:
    """An observation source without a max_obstacle_height above 0.

    Why: Nav2 drops every point above it: on the robot the source neither marks nor clears, while
    here it does.
    """
    for name, source in view.sources():
        key = f"{name}.max_obstacle_height"
        highest = subject.number(view.node, key, 0.0)
        if highest <= 0.0 and (source.marking or source.clearing):
            absent = "absent, and Nav2's default for a source is 0.0 m"
            found = subject.default_note(view.node, key, absent) or f"{highest:g} m"
            yield Finding(key, found, "max_obstacle_height: 2.0")


@RULES.warning
def unreached_threshold(subject: Subject, view: CostmapView) -> Iterator[Finding]:
    """A voxel layer on planar scans wants more voxels in a column than they can fill.

    Why: in Nav2 it never marks anything, while here it runs as an obstacle layer and does.
    """
    for layer in view.layers:
        marking = [name for name, source in layer.sources.items() if source.marking]
        kinds = {
            str(subject.value(view.node, f"{layer.name}.{name}.data_type", "LaserScan"))
            for name in marking
        }
        threshold = subject.number(view.node, f"{layer.name}.mark_threshold", 0.0)
        if layer.type == VOXEL and kinds == {"LaserScan"} and threshold >= len(marking):
            scans = f"{len(marking)} LaserScans mark"
            if len(marking) == 1:
                scans = "a LaserScan marks"
            yield Finding(
                f"{layer.name}.mark_threshold",
                f"{threshold:g}: a cell needs more marked voxels than that, "
                f"but {scans} {len(marking)} at most",
                "mark_threshold: 0",
            )


@RULES.warning
def endless_beams(subject: Subject, view: CostmapView) -> Iterator[Finding]:
    """Beams without a return clear nothing, although the sensor looks into the open.

    Why: who crossed such a beam stays in the costmap: trails of ghosts in open places.
    """
    for name, source in view.sources():
        is_scan = subject.value(view.node, f"{name}.data_type", "LaserScan") == "LaserScan"
        sees_far = source.marking and source.obstacle_max_range > OPEN_SPACE
        if is_scan and sees_far and source.clearing and not source.inf_is_valid:
            yield Finding(
                f"{name}.inf_is_valid",
                f"false, with obstacles marked up to {source.obstacle_max_range:g} m",
                "inf_is_valid: true (if the lidar reports inf where nothing returns)",
            )


@RULES.warning
def long_memory(view: CostmapView) -> Iterator[Finding]:
    """Old scans stay in the costmap.

    Why: moving people leave a wall behind them that lasts as long as the persistence.
    """
    for name, source in view.sources():
        if source.marking and source.observation_persistence > LONG_PERSISTENCE:
            trail = WALKING_SPEED * source.observation_persistence
            yield Finding(
                f"{name}.observation_persistence",
                f"{source.observation_persistence:g} s: "
                f"a pedestrian drags {trail:.1f} m of obstacles behind",
                "observation_persistence: 0.0",
            )


def _right_order(view: CostmapView) -> str:
    """The names of the layers, maps first and the last inflation behind all others."""
    maps = [layer.name for layer in view.layers if layer.type == STATIC]
    inflations = [layer.name for layer in view.layers if layer.type == INFLATION]
    others = [layer.name for layer in view.layers if layer.name not in (*maps, *inflations)]
    return ", ".join((*maps, *others, *inflations[-1:]))


def _takes_robot_for_a_point(subject: Subject, view: CostmapView) -> bool:
    """Whether the user of a costmap looks at the cost of the robot's centre only."""
    if view is subject.world:
        planners = subject.names("planner_server", "planner_plugins") or ("GridBased",)
        kinds = [
            str(subject.value("planner_server", f"{name}.plugin", "NavfnPlanner"))
            for name in planners
        ]
        return all(
            kind.endswith(("NavfnPlanner", "SmacPlanner2D", "ThetaStarPlanner")) for kind in kinds
        )
    return subject.dwb is not None and "ObstacleFootprint" not in subject.dwb.critics
