"""A recorded drive as a page: its costs, its events, and its replay on the map."""

import dataclasses
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from harness.economics.cost_terms import COST_LABELS
from harness.identify.drive_cost import DriveCost
from harness.identify.drive_events import DriveEvent, People
from harness.metrics.replay_log import TRACE_PERIOD, millimetres
from harness.recorded.drive_log import DriveLog
from harness.report.blocks import Block, Text
from harness.report.markdown import markdown_text
from harness.report.page.deliveries import rounded
from harness.report.page.document import page_text
from harness.report.page.markdown_blocks import sections
from harness.report.page.origin import Place, page_origin, shifted
from harness.report.page.recording_code import FINE, encode
from harness.report.page.scenery import draw
from harness.report.priced_log import event_line
from harness.world.map.scene import Scene
from harness.world.physics.robot import RobotParams
from navstack.errors import InputError
from navstack.types import FloatArray, IntArray

Json = dict[str, Any]

MOST_ROWS = 36_000  # of a replay: an hour
LEDE = (
    "The robot where its localizer believed it to be, with its scans and who was tracked; N jumps "
    "to the next event."
)


def log_page(
    blocks: Sequence[Block],
    log: DriveLog,
    cost: DriveCost,
    scene: Scene,
    robot: RobotParams,
    person_radius: float,
    date: str,
) -> str:
    """The page of a log.

    Args:
        blocks: what the screen shows.
        log: the drive; see :func:`require_shown`.
        cost: its events.
        scene: the map.
        robot: that drove.
        person_radius: [m]
        date: of today, as the page says it.
    """
    lines = [Text(each.text.strip()) if isinstance(each, Text) else each for each in blocks]
    text = markdown_text([Text("What the drive cost", "heading"), *lines])
    _, parts = sections(text, Path())
    label = Path(log.files).name or log.files
    shown = _replay(log, cost, scene, robot, person_radius)
    more = {"sections": parts, "lede": LEDE, "made": version("navbench")}
    return page_text(
        "study",
        label,
        date,
        [label],
        [shown],
        scenery={scene.name: draw(scene, _origin(scene))},
        **more,
    )


def require_shown(log: DriveLog) -> None:
    """Refuse a log that no page can show.

    Raises:
        InputError: it has no poses, or too many.
    """
    if len(log.poses) < 2:
        raise InputError(
            f"'{log.files}' has no poses of a localizer, so that it cannot be shown on the map; "
            "record /amcl_pose as well, or leave out --html"
        )
    seconds = float(log.poses[-1, 0] - log.poses[0, 0])
    if not 2.0 * TRACE_PERIOD < seconds < MOST_ROWS * TRACE_PERIOD:
        raise InputError(
            f"'{log.files}' has {seconds:.0f} s with poses; a page shows at most "
            f"{MOST_ROWS * TRACE_PERIOD:.0f} s; leave out --html"
        )


def _replay(
    log: DriveLog,
    cost: DriveCost,
    scene: Scene,
    robot: RobotParams,
    person_radius: float,
) -> Json:
    origin = _origin(scene)
    arrays = shifted(_arrays(log, cost), origin)
    trace = arrays["trace"]
    first, start, goal = float(log.poses[0, 0]), trace[0, 1:3].tolist(), trace[-1, 1:3].tolist()
    return {
        "entry": 0,
        "episode": 0,
        "map": scene.name,
        "outcome": "end_of_the_log",
        "duration": rounded(float(trace[-1, 0])),
        "start": start,
        "goal": goal,
        "pieces": None,
        "footprint": robot.polygon.tolist(),
        "personRadius": person_radius,
        "contacts": [
            _contact(each, first, origin)
            for each in cost.events
            if each.kind == "contact" and each.stamp >= first
        ],
        "money": dict.fromkeys(("revenue", "opex", "contribution_margin", *COST_LABELS))
        | {term: rounded(value, 4) for term, value in cost.terms.items()},
        "reasons": [_reason(each, first) for each in cost.events if each.stamp >= first],
        "history": "",
        "data": encode(arrays, FINE),
    }


def _origin(scene: Scene) -> Place:
    """From where the page counts."""
    return page_origin(scene.geometry.origin.x, scene.geometry.origin.y)


def _contact(event: DriveEvent, first: float, origin: Place) -> list[Any]:
    """Place [m], time [s], kind, impulse [N s], cost [USD], and whether it is counted."""
    place = [0.0, 0.0]
    if event.x is not None and event.y is not None:
        place = [rounded(event.x - origin[0], 2), rounded(event.y - origin[1], 2)]
    what = event.what.replace("person", "pedestrian")
    paid = event.cost or 0.0
    when = rounded(event.stamp - first, 2)
    return [*place, when, what, rounded(event.size, 1), rounded(paid, 2), paid > 0.0]


def _reason(event: DriveEvent, first: float) -> Json:
    """An event in words, by the replay's clock, which begins with the first pose."""
    shown = dataclasses.replace(event, stamp=event.stamp - first)
    return {
        "time": rounded(shown.stamp, 2),
        "cost": event.cost or 0.0,
        "words": event_line(shown),
    }


def _arrays(log: DriveLog, cost: DriveCost) -> Json:
    """The drive as a recording; what nobody knows is empty, zero or not a number."""
    first, last = float(log.poses[0, 0]), float(log.poses[-1, 0])
    stamps = np.arange(first, last, TRACE_PERIOD)
    rows = len(stamps)
    trace = np.full((rows, 11), np.nan)
    trace[:, 0] = stamps - first
    trace[:, 1:4] = _between(stamps, log.poses, (1, 2, 3))
    trace[:, 4:6] = _between(stamps, log.odometry, (4, 5))
    trace[:, 9:11] = 0.0
    if len(log.commands):
        latest = np.searchsorted(log.commands[:, 0], stamps, side="right") - 1
        trace[:, 9:11] = np.where(latest[:, None] >= 0, log.commands[latest.clip(0), 1:3], 0.0)
    counts, tracks = _tracks(cost.people, stamps)
    empty = np.zeros(0, dtype=np.int32)
    return {
        "trace": trace,
        "crowd": np.empty((rows, 0, 2)),
        "pieces_lost": np.zeros(rows, dtype=np.int32),
        "motion_energy_j": np.interp(stamps, log.stamps, cost.energy_joules),
        "belief_covariance": np.zeros((rows, 3)),
        "track_count": counts,
        "tracks": tracks,
        "option_count": np.zeros(rows, dtype=np.int32),
        "option_total": np.empty(0),
        "option_size": empty,
        "option_xy": np.empty((0, 2)),
        "plan_stamp": np.empty(0),
        "plan_size": empty,
        "plan_xy": np.empty((0, 2)),
        **_scans(log, first, last),
    }


def _between(stamps: FloatArray, rows: FloatArray, columns: Sequence[int]) -> FloatArray:
    """Columns of rows at other times; the yaw of a pose has no jumps."""
    table = [rows[:, column] for column in columns]
    if len(columns) == 3:
        table[2] = np.unwrap(table[2])
    return np.column_stack([np.interp(stamps, rows[:, 0], column) for column in table])


def _tracks(people: People, stamps: FloatArray) -> tuple[IntArray, FloatArray]:
    """How many tracks each moment has, and all of them: id, x, y [m], vx, vy [m/s], radius [m]."""
    times = np.array([stamp for stamp, _, _ in people])
    nobody = np.empty((0, 5))
    parts = []
    for looks in np.searchsorted(times, stamps, side="right").tolist():  # so many so far
        parts.append(people[looks - 1][2] if looks else nobody)
    joined = np.concatenate([nobody, *parts])
    counts = np.array([len(part) for part in parts], dtype=np.int64)
    return counts, np.column_stack((joined, np.zeros(len(joined))))


def _scans(log: DriveLog, first: float, last: float) -> Json:
    """Those that have as many beams as the first one."""
    scans = [each for each in log.scans if first <= each.stamp <= last]
    if not scans:
        return {
            "scan_stamp": np.empty(0),
            "scan_mm": np.empty((0, 0), dtype=np.uint16),
            "scan_geometry": np.zeros(7),
        }
    one = scans[0]
    alike = [each for each in scans if len(each.ranges) == len(one.ranges)]
    mount = one.sensor_pose
    geometry = (one.angle_min, one.angle_increment, one.range_min, min(one.range_max, 1e4))
    return {
        "scan_stamp": np.array([each.stamp - first for each in alike]),
        "scan_mm": np.array([millimetres(each.ranges) for each in alike]),
        "scan_geometry": np.array((*geometry, mount.x, mount.y, mount.yaw)),
    }
