"""What happened on a recorded drive: contacts, near misses, hard brakes, interventions."""

import math
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from scipy.ndimage import distance_transform_edt
from scipy.signal import savgol_filter

from harness.economics.contact_costs import injury_costs, property_cost
from harness.economics.prices import Prices
from harness.identify.collisions import Impact, Impacts, strongest_steps
from harness.identify.stillness import standing
from harness.metrics.encounters import (
    Body,
    in_base_frame,
    surface_distances,
    times_to_collision,
)
from harness.recorded.drive_log import DriveLog, period_of
from harness.world.map.scene import Scene
from harness.world.physics.robot import RobotParams
from harness.world.world_params import WorldParams
from navstack.costmap.occupancy_grid import FREE, OCCUPIED
from navstack.geometry import transform_points
from navstack.params.tracker import TrackerParams
from navstack.perception.tracker import Tracker
from navstack.types import BoolArray, FloatArray, Pose2D

HARD_BRAKE = 2.94  # [m/s2] 0.3 g, as fleets count hard brakes
NEAR_DISTANCE, NEAR_TIME = 0.25, 1.0  # [m] to a person's body, [s] to a collision: a near miss
_SMOOTH = 0.4  # [s] over which speed is smoothed for braking
_APART = 3.0  # [s] between two events of one kind
_BESIDE = 0.35  # [m] between the robot's outline and what it touched on the map
_OFF_THE_MAP = 0.2  # [-] share of the poses that no map of theirs has off its free ground
_JUMP = 1.0  # [m] by which a standing robot's believed place may not change
# a step of fixes of a standing robot: its median and its largest by noise, in standard deviations
_MEDIAN_STEP, _BEYOND_NOISE = 1.665, 7.07
_GAP = 3.0  # periods between two rows of odometry between which others are missing


People = list[tuple[float, Pose2D, FloatArray]]  # [s], pose, (n, 5) track, x, y, vx, vy


@dataclass(frozen=True, slots=True)
class DriveEvent:
    """One event of a drive."""

    kind: str  # contact, near_miss, hard_brake, intervention
    stamp: float  # [s] since the log's first odometry
    what: str  # person, a kind of property, unknown; else how it was told
    size: float  # [N s] of a contact, [m] of a near miss, [m/s2] of a brake, 0
    x: float | None = None  # [m] map frame
    y: float | None = None  # [m]
    # [USD] expected of a contact, of which the log does not tell whether the rule counts it
    cost: float | None = None

    def as_json(self) -> dict[str, Any]:
        """As ``navbench cost-log --json`` prints it."""
        return asdict(self)


def pose_at(log: DriveLog, stamp: float) -> Pose2D | None:
    """The believed pose in the map frame; None: the log has none."""
    if not len(log.poses):
        return None
    return _pose_of(log.poses, stamp)


def _pose_of(rows: FloatArray, stamp: float) -> Pose2D:
    """The pose at a time, between rows (N, 4) [s], x, y [m], yaw [rad]."""
    stamps, x, y, yaw = rows.T
    return Pose2D(
        float(np.interp(stamp, stamps, x)),
        float(np.interp(stamp, stamps, y)),
        float(np.interp(stamp, stamps, np.unwrap(yaw))),
    )


def doubt_of_map(log: DriveLog, scene: Scene) -> str:
    """Why the map cannot be that of the log's poses; empty: nothing speaks against it."""
    if not len(log.poses):
        return ""
    places = log.poses[:, 1:3].tolist()
    off = [(x, y) for x, y in places if scene.geometry.value_at(x, y) != FREE]
    share = len(off) / len(places)
    if share < _OFF_THE_MAP:
        return ""
    x, y = off[0]
    return (
        f"{share:.0%} of the log's poses are not on free ground of map '{scene.name}', the first "
        f"at {x:.1f}, {y:.1f} m; near misses, and what a contact was with, are told by the map: "
        "give the one that the robot was localized on"
    )


def events_of(
    log: DriveLog,
    impacts: Impacts,
    people: People,
    robot: RobotParams,
    scene: Scene,
    world: WorldParams,
    prices: Prices,
) -> tuple[DriveEvent, ...]:
    """All events of a drive, in the order of time."""
    contacts = [_contact(impact, log, robot, scene, world, prices) for impact in impacts.found]
    events = [*contacts, *_near_misses(people, contacts, log, robot, world)]
    events += [*_hard_brakes(log), *_interventions(log)]
    return tuple(sorted(events, key=lambda event: event.stamp))


def _contact(
    impact: Impact,
    log: DriveLog,
    robot: RobotParams,
    scene: Scene,
    world: WorldParams,
    prices: Prices,
) -> DriveEvent:
    """A contact with what it was with: what stands on the map where it was, else a person."""
    at = pose_at(log, impact.stamp)
    steps = strongest_steps(impact.impulse)
    counted = steps >= world.contacts.counted_impulse
    cost = float(np.mean(counted * injury_costs(steps, prices)))
    if at is None:
        return DriveEvent("contact", impact.stamp, "unknown", impact.impulse, cost=cost)
    what = _touched(at, robot, scene)
    if what != "person":
        each = [property_cost(what, step, prices) for step in steps.tolist()]
        cost = float(np.mean(counted * each))
    return DriveEvent("contact", impact.stamp, what, impact.impulse, at.x, at.y, cost)


def _touched(at: Pose2D, robot: RobotParams, scene: Scene) -> str:
    """The kind of what stands beside the robot on the map; ``person``: nothing does."""
    outline = _outline(robot)
    points = transform_points(at, outline)
    grid = scene.geometry
    cells = ((points - (grid.origin.x, grid.origin.y)) / grid.resolution).astype(int)
    reach = math.ceil(_BESIDE / grid.resolution)
    low, high = cells.min(axis=0) - reach, cells.max(axis=0) + reach + 1
    low, high = np.maximum(low, 0), np.minimum(high, (grid.width, grid.height))
    part = grid.data[low[1] : high[1], low[0] : high[0]] >= OCCUPIED
    if not part.size or not part.any():
        return "person"
    distances = distance_transform_edt(~part) * grid.resolution
    inside = (cells - low).clip(0, np.array(part.shape[::-1]) - 1)
    if float(distances[inside[:, 1], inside[:, 0]].min()) > _BESIDE:
        return "person"
    nearest, kind = 2.0 * _BESIDE, "unknown"
    for obstacle in scene.obstacles:
        gaps = np.hypot(*(obstacle.polygon[:, None] - points[None]).transpose(2, 0, 1))
        if float(gaps.min()) < nearest:
            nearest, kind = float(gaps.min()), obstacle.kind
    return kind


def _outline(robot: RobotParams) -> FloatArray:
    """Points (n, 2) [m] along the body's sides, base frame."""
    corners = np.vstack((robot.polygon, robot.polygon[:1]))
    shares = np.linspace(0.0, 1.0, 12, endpoint=False)[:, None]
    sides = [a + shares * (b - a) for a, b in zip(corners[:-1], corners[1:], strict=True)]
    return np.vstack(sides)


def people_on(log: DriveLog, scene: Scene) -> People:
    """Who was seen beside the map's own, scan by scan."""
    if not log.scans or not len(log.poses):
        return []
    tracker = Tracker(TrackerParams(), scene.mapped_geometry)
    seen: People = []
    for scan in log.scans:
        if not log.poses[0, 0] <= scan.stamp <= log.poses[-1, 0]:
            continue
        at = pose_at(log, scan.stamp)
        assert at is not None
        tracker.observe(scan, at, _pose_of(log.odometry[:, :4], scan.stamp))
        rows = [(each.id, each.x, each.y, each.vx, each.vy) for each in tracker.tracks(scan.stamp)]
        seen.append((scan.stamp, at, np.array(rows).reshape(-1, 5)))
    return seen


def _near_misses(
    people: People,
    contacts: list[DriveEvent],
    log: DriveLog,
    robot: RobotParams,
    world: WorldParams,
) -> list[DriveEvent]:
    """Moments at which somebody was too near or on a collision course, without a contact."""
    body = Body(robot.center, robot.half_size, world.people.radius)
    found: list[DriveEvent] = []
    last: dict[int, float] = {}
    for stamp, at, rows in people:
        if not len(rows):
            continue
        speed = float(np.interp(stamp, log.stamps, log.speeds))
        turn = float(np.interp(stamp, log.stamps, log.yaw_rates))
        own = np.tile((0.0, at.x, at.y, at.yaw, speed, 0.0, turn), (len(rows), 1))
        seen = in_base_frame(own, rows[:, 1:])
        distances, times = surface_distances(seen, body), times_to_collision(own[:, 4:], seen, body)
        moves = abs(speed) > 0.05
        for row, distance, time in zip(rows, distances.tolist(), times.tolist(), strict=True):
            number = int(row[0])
            is_near = moves and (distance < NEAR_DISTANCE or time < NEAR_TIME)
            if not is_near or stamp - last.get(number, -math.inf) < _APART:
                continue
            last[number] = stamp
            if all(abs(stamp - contact.stamp) > _APART for contact in contacts):
                place = float(row[1]), float(row[2])
                found.append(DriveEvent("near_miss", stamp, "person", distance, *place))
    return found


def _hard_brakes(log: DriveLog) -> list[DriveEvent]:
    """Where the speed fell by more than :data:`HARD_BRAKE`."""
    stamps, speeds = log.stamps, np.abs(log.speeds)
    if len(stamps) < 10:
        return []
    period = period_of(stamps)
    width = max(round(_SMOOTH / period) | 1, 5)
    slopes = np.zeros(len(stamps))
    gaps = (np.diff(stamps) > _GAP * period) | _over_a_pause(log, stamps)
    for part in np.split(np.arange(len(stamps)), np.flatnonzero(gaps) + 1):
        if len(part) >= width:
            slopes[part] = savgol_filter(speeds[part], width, 2, deriv=1, delta=period)
    found: list[DriveEvent] = []
    for at in np.flatnonzero(slopes < -HARD_BRAKE):
        stamp = float(stamps[at])
        if not found or stamp - found[-1].stamp > _APART:
            found.append(DriveEvent("hard_brake", stamp, "odometry", -float(slopes[at])))
        elif -slopes[at] > found[-1].size:
            found[-1] = replace(found[-1], size=-float(slopes[at]))
    return found


def _interventions(log: DriveLog) -> list[DriveEvent]:
    """Takeovers by buttons and switches; without such topics standing robots that are carried."""
    if len(log.takeovers):
        return [DriveEvent("intervention", float(stamp), "switch", 0.0) for stamp in log.takeovers]
    places = log.poses if len(log.poses) else log.fixes
    if len(places) < 2:
        return []
    rows = np.searchsorted(log.stamps, places[:-1, 0]).clip(max=len(log.stamps) - 1)
    still = standing(log)[rows] & ~_over_a_pause(log, places[:, 0])
    jumps = np.where(still, np.hypot(np.diff(places[:, 1]), np.diff(places[:, 2])), 0.0)
    least = np.full(len(jumps), _JUMP)
    if not len(log.poses) and still.any():
        noise = np.maximum(places[1:, 3], np.median(jumps[still]) / _MEDIAN_STEP)
        least = np.maximum(least, _BEYOND_NOISE * noise)
    found: list[DriveEvent] = []
    for at in np.flatnonzero(jumps > least):
        stamp = float(places[at, 0])
        if not found or stamp - found[-1].stamp > _APART:
            found.append(DriveEvent("intervention", stamp, "jump", float(jumps[at])))
    return found


def _over_a_pause(log: DriveLog, stamps: FloatArray) -> BoolArray:
    """Which steps (N - 1,) between stamps (N,) [s] go over a pause of the log."""
    parts = np.searchsorted(log.resumed, stamps, side="right")
    found: BoolArray = np.diff(parts) > 0
    return found
