"""Where the time of a delivery went: what the robot did, where, and with whom around it."""

import dataclasses
import math
from typing import Any

import numpy as np
from scipy import ndimage

from harness.explain.evidence import Evidence
from harness.metrics.ghost_tracks import are_ghosts, in_true_frame
from harness.task.shortest_paths import distance_field
from harness.world.map.scene import Scene
from navstack.costmap.occupancy_grid import FREE
from navstack.types import BoolArray, FloatArray, IntArray

FAST, SLOW, STANDS, REVERSES, AWAY = ACTIVITIES = (
    "fast",
    "slow",
    "stands",
    "reverses",
    "away from the goal",
)
STANDING = 0.05  # [m/s] up to which it stands
UNHURRIED = 1.0  # [m/s] below which it is slow
WINDOW = 10  # steps of the trace, to each side, over which the way left is compared
NEAR = 5.0  # [m] from the robot within which people are counted
POOLED = 4  # cells of the map along each side of one in which ways are measured


@dataclasses.dataclass(frozen=True, slots=True)
class Activity:
    """What was done of one kind."""

    activity: str  # of ACTIVITIES
    time_s: float
    distance_m: float
    progress_m: float  # by which the way left to the goal fell
    people_near: float  # within NEAR, on average
    ghost_tracks: float | None  # that were nobody, on average; None: nothing was ever tracked
    street_width_m: float | None  # median; None: the map is not known
    # the longest stretch: since when, how long, and where it began
    longest_since_s: float
    longest_s: float
    longest_x_m: float
    longest_y_m: float

    def document(self) -> dict[str, Any]:
        """As JSON has it."""
        return dataclasses.asdict(self)


def activities(evidence: Evidence, scene: Scene | None) -> list[Activity]:
    """The activities of a delivery, those with the most time first.

    Args:
        evidence: of the delivery.
        scene: its map; None: ways are measured straight, and no width is known.
    """
    trace = evidence.trace
    if len(trace) < 2:
        return []
    left, width = _ways(evidence, scene)
    doing = _doing(trace, left)
    ghosts = _ghosts(evidence)
    away = evidence.crowd - trace[:, np.newaxis, 1:3]
    people = (np.hypot(away[..., 0], away[..., 1]) <= NEAR).sum(axis=1)
    found = []
    for number, activity in enumerate(ACTIVITIES):
        own = doing == number
        if own.any():
            parts = (people, ghosts, width)
            found.append(_activity(activity, own, trace, left, parts))
    return sorted(found, key=lambda each: -each.time_s)


def _activity(
    activity: str,
    own: BoolArray,
    trace: FloatArray,
    left: FloatArray,
    parts: tuple[IntArray, FloatArray, FloatArray],
) -> Activity:
    """Sums over the ``own`` (T - 1,) steps of a trace (T, 11)."""
    people, ghosts, width = (each[:-1][own] for each in parts)
    stamps, steps = trace[:, 0], np.hypot(*np.diff(trace[:, 1:3], axis=0).T)
    first, end = _longest(own, stamps)
    return Activity(
        activity=activity,
        time_s=float(np.diff(stamps)[own].sum()),
        distance_m=float(steps[own].sum()),
        progress_m=float(-np.diff(left)[own].sum()),
        people_near=float(people.mean()),
        ghost_tracks=_known(ghosts.mean()),
        street_width_m=_known(np.median(width)),
        longest_since_s=float(stamps[first]),
        longest_s=float(stamps[end] - stamps[first]),
        longest_x_m=float(trace[first, 1]),
        longest_y_m=float(trace[first, 2]),
    )


def _known(value: float) -> float | None:
    if math.isnan(value):
        return None
    return float(value)


def _doing(trace: FloatArray, left: FloatArray) -> IntArray:
    """The activity of each step (T - 1,), as its place in ACTIVITIES."""
    speed = trace[:-1, 4]
    rows = np.arange(len(speed))
    later = left[np.minimum(rows + WINDOW, len(left) - 1)]
    came_nearer = left[np.maximum(rows - WINDOW, 0)] - later
    conditions = (np.abs(speed) <= STANDING, speed < 0.0, came_nearer < 0.0, speed < UNHURRIED)
    kinds = [ACTIVITIES.index(each) for each in (STANDS, REVERSES, AWAY, SLOW)]
    doing: IntArray = np.select(conditions, kinds, ACTIVITIES.index(FAST))
    return doing


def _longest(own: BoolArray, stamps: FloatArray) -> tuple[int, int]:
    """First and end of the longest stretch of ``own`` steps, as rows of the trace."""
    edges = np.diff(np.concatenate(((0,), own.astype(np.int8), (0,))))
    firsts, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    longest = int(np.argmax(stamps[ends] - stamps[firsts]))
    return int(firsts[longest]), int(ends[longest])


def _ghosts(evidence: Evidence) -> FloatArray:
    """Tracks (T,) that were nobody; NaN: nothing was ever tracked."""
    if not any(map(len, evidence.tracks)):
        return np.full(len(evidence.trace), np.nan)
    count = []
    for tracks, row, people in zip(evidence.tracks, evidence.trace, evidence.crowd, strict=True):
        places = in_true_frame(tracks[:, 1:3], row[6:9], row[1:4])
        count.append(are_ghosts(places, people).sum())
    return np.array(count, dtype=np.float64)


def _ways(evidence: Evidence, scene: Scene | None) -> tuple[FloatArray, FloatArray]:
    """The way left to the goal (T,) [m], and the width of the street (T,) [m]; NaN: not known."""
    places = evidence.trace[:, 1:3]
    goal = np.array((evidence.row["goal_x_m"], evidence.row["goal_y_m"]))
    straight: FloatArray = np.hypot(*(places - goal).T)
    nothing = np.full(len(places), np.nan)
    if scene is None:
        return straight, nothing
    mesh = scene.navigation_mesh
    rows, columns = (each // POOLED for each in mesh.data.shape)
    free = mesh.data[: rows * POOLED, : columns * POOLED] == FREE
    free = free.reshape(rows, POOLED, columns, POOLED).all(axis=(1, 3))
    cell = POOLED * mesh.resolution
    origin = (mesh.origin.x, mesh.origin.y)
    cells = np.floor((np.vstack((places, goal)) - origin) / cell).astype(np.int64)[:, ::-1]
    cells = np.clip(cells, 0, np.array(free.shape) - 1)
    # who stands beside free ground counts from the nearest of it
    nearest = ndimage.distance_transform_edt(~free, return_distances=False, return_indices=True)
    there = np.stack([each[cells[:, 0], cells[:, 1]] for each in nearest], axis=1)
    field = distance_field(free, there[-1])
    left = cell * field[there[:-1, 0], there[:-1, 1]].astype(np.float64)
    if not np.isfinite(left).all():  # a part of the ground from which no way leads to the goal
        left = straight
    room = ndimage.distance_transform_edt(free)[there[:-1, 0], there[:-1, 1]]
    return left, 2.0 * cell * room
