"""The velocity smoother while commands come and cease.

The collision monitor: times to collision, points inside.
"""

import re
from collections.abc import Iterator

import numpy as np

from navstack.params.collision_monitor import PolygonParams
from navstack.params.safety import VelocitySmootherParams
from navstack.params.strict import from_mapping
from navstack.safety.monitor_zones import MonitorZone
from navstack.safety.velocity_smoother import VelocitySmoother
from navstack.types import Twist2D
from tools.parity.comparison import Comparison
from tools.parity.golden import GoldenFile
from tools.parity.part import Case, Shape

SMOOTHED_TOLERANCE = 1e-9  # [m/s, rad/s]
# share of what was sent that the recorded odometry measures in the next cycle
MEASURED = (0.8, 0.8, 0.9)
NOT_OURS = ("odom_duration",)  # the odometry given to navstack is smoothed already


FACTS = "collision_approach"
POLYGON = "cm_polygon"
TOLERANCE = 1e-5  # [s]
OVERFLOW = re.compile(r".*min_points_(\d+)")
NO_COLLISION = -1.0  # recorded where there is none
PARAMETERS = ("min_points", "simulation_time_step", "time_before_collision")
# points on and beside the edges of the polygon, and whether they count as inside
EDGES = Shape(("{}_edge_pts", "{}_edge_inside", POLYGON), (), (), None, "{}_edge")
# commands, cycles, and what was sent (NaN: nothing)
SMOOTHED = Shape(
    ("vs_{}_cmds_t_x_y_w", "vs_{}_out", "vs_{}_t"),
    (),
    ("velocity_smoother", "{}"),
    "params",
    "vs_{}",
)


def check_smoother(case: Case, comparison: Comparison) -> None:
    """Every cycle; where Nav2 sends nothing, navstack sends the standstill that Nav2 sent last."""
    given = dict(case.facts["params"])
    for key in NOT_OURS:
        given.pop(key, None)
    smoother = VelocitySmoother(from_mapping(VelocitySmootherParams, given, case.title))
    commands = list(case["cmds_t_x_y_w"])
    measured, ours = Twist2D(), []
    for stamp in case["t"]:
        while commands and commands[0][0] <= stamp:
            t, x, y, w = commands.pop(0)
            smoother.receive(Twist2D(x, y, w), t)
        sent = smoother.smooth(None, measured, stamp)
        ours.append((sent.linear_x, sent.linear_y, sent.angular_z))
        measured = Twist2D(
            *(share * value for share, value in zip(MEASURED, ours[-1], strict=True))
        )
    comparison.near("velocities", ours, np.nan_to_num(case["out"]), SMOOTHED_TOLERANCE)


def find_times(file: GoldenFile) -> Iterator[Case]:
    """Tables ``cm_time_<case>`` of clouds ``cm_cloud_<i>`` by velocities ``cm_vels``."""
    inputs = _inputs(file)
    for base in file.bases("", prefix="cm_time_"):
        if inputs <= file.names and file.facts(FACTS, base):
            yield Case(f"cm_time_{base}", file, frozenset((*inputs, f"cm_time_{base}")))


def check_times(case: Case, comparison: Comparison) -> None:
    """Every entry of a table."""
    facts = case.file.facts(FACTS, case.name.removeprefix("cm_time_"))
    zone = _zone(case.file, **{name: facts[name] for name in PARAMETERS})
    comparison.near("times to collision", _times(zone, case.file), case.file[case.name], TOLERANCE)


def find_overflows(file: GoldenFile) -> Iterator[Case]:
    """Facts ``<...>min_points_<n>`` of a number beyond 32 bits, with ``times`` in them."""
    inputs = _inputs(file)
    for key, facts in file.facts(FACTS).items():
        if inputs <= file.names and OVERFLOW.fullmatch(key) and "stored_int" in facts:
            yield Case(f"cm_{key}", file, inputs)


def check_overflow(case: Case, comparison: Comparison) -> None:
    """The number of points that is left of it, and the times with that many."""
    facts = case.file.facts(FACTS, case.name.removeprefix("cm_"))
    (min_points,) = case.settings(OVERFLOW)
    zone = _zone(case.file, min_points=int(min_points))
    comparison.equal("points that trigger", zone.params.trigger_count, facts["stored_int"])
    comparison.near(
        "times to collision",
        _times(zone, case.file)[: len(facts["times"])],
        facts["times"],
        TOLERANCE,
    )


def check_edges(case: Case, comparison: Comparison) -> None:
    """Each point by itself."""
    zone = _zone(case.file, min_points=1)
    ours = [zone.is_triggered(point[None, :]) for point in case["pts"]]
    comparison.equal("points inside", np.array(ours, dtype=np.int64), case["inside"])


def _inputs(file: GoldenFile) -> frozenset[str]:
    return frozenset((POLYGON, "cm_vels", *_clouds(file)))


def _times(zone: MonitorZone, file: GoldenFile) -> list[list[float]]:
    """Time to collision [s] of each cloud (row) with each velocity (column)."""
    velocities = [Twist2D(*velocity) for velocity in file["cm_vels"]]
    table = [
        [zone.collision_time(file[cloud], velocity) for velocity in velocities]
        for cloud in _clouds(file)
    ]
    return [[NO_COLLISION if time is None else time for time in row] for row in table]


def _clouds(file: GoldenFile) -> list[str]:
    return [
        f"cm_cloud_{i}"
        for i in sorted(int(base) for base in file.bases("", "cm_cloud_") if base.isdigit())
    ]


def _zone(file: GoldenFile, **recorded: float) -> MonitorZone:
    given = {"type": "polygon", "action_type": "approach", **recorded}
    params = from_mapping(PolygonParams, given, str(file.path))
    return MonitorZone(POLYGON, params, file[POLYGON])
