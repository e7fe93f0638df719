"""What the collision monitor does with commands: actions, zones, sources, parameters."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from navstack.errors import ParameterError, UnknownNameError
from navstack.params.collision_monitor import (
    CollisionMonitorParams,
    MonitorSourceParams,
    PolygonParams,
    VelocityPolygonParams,
)
from navstack.params.nav2_file.file import Nav2File, load_nav2
from navstack.params.nav2_file.views import read_collision_monitor
from navstack.safety.collision_monitor import CollisionMonitor, MonitorAction
from navstack.safety.monitor_kernels import are_inside, collision_time, is_inside, within_reach
from navstack.types import LaserScan, Pose2D, Twist2D

FOOTPRINT = np.array(((0.2, 0.3), (0.2, -0.3), (-0.6, -0.3), (-0.6, 0.3)))
BOX = "[[1.0, 0.5], [1.0, -0.5], [-1.0, -0.5], [-1.0, 0.5]]"
FORWARD = Twist2D(1.0, 0.0, 0.4)
STANDSTILL = Twist2D()
SCAN = {"scan": MonitorSourceParams()}


def scan_of(
    *points: tuple[float, float],
    stamp: float = 0.0,
    mount: Pose2D | None = None,
) -> LaserScan:
    """Four beams at right angles; each point must lie on one of them."""
    ranges = np.full(4, math.inf)
    for x, y in points:
        ranges[round(math.atan2(y, x) / (math.pi / 2.0)) % 4] = math.hypot(x, y)
    return LaserScan(stamp, ranges, 0.0, math.pi / 2.0, 0.05, 30.0, mount or Pose2D())


def zone(action: str, **given: object) -> PolygonParams:
    values = {"type": "polygon", "points": BOX, "min_points": 1} | given
    return PolygonParams(action_type=action, **values)  # type: ignore[arg-type]


def monitor(
    sources: dict[str, MonitorSourceParams] = SCAN, **zones: PolygonParams
) -> CollisionMonitor:
    params = CollisionMonitorParams(
        polygons=tuple(zones),
        observation_sources=tuple(sources),
        zones=zones,
        sources=sources,
    )
    return CollisionMonitor(params, FOOTPRINT)


def process(
    made: CollisionMonitor,
    *points: tuple[float, float],
    command: Twist2D = FORWARD,
) -> Twist2D:
    made.receive(scan_of(*points))
    return made.process(command, 0.0)


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        (zone("stop"), STANDSTILL),
        (zone("slowdown", slowdown_ratio=0.3), Twist2D(0.3, 0.0, 0.12)),
        (zone("limit", linear_limit=0.5, angular_limit=0.3), Twist2D(0.5, 0.0, 0.2)),
        (
            zone("limit", linear_limit=0.5, angular_limit=0.3, limit_keeps_curvature=False),
            Twist2D(0.5, 0.0, 0.3),
        ),
        (zone("approach", time_before_collision=2.0, simulation_time_step=0.1), STANDSTILL),
    ],
)
def test_each_action(given: PolygonParams, expected: Twist2D) -> None:
    made = monitor(zone=given)
    driven = process(made, (0.9, 0.0))
    assert_allclose(
        (driven.linear_x, driven.linear_y, driven.angular_z),
        (expected.linear_x, 0.0, expected.angular_z),
    )
    assert made.action == MonitorAction(given.action_type, "zone")
    assert process(made, (1.1, 0.0)) == FORWARD or given.action_type == "approach"
    assert process(made, (5.0, 0.0)) == FORWARD
    assert made.action == MonitorAction("none", "")


def test_none_does_nothing() -> None:
    assert process(monitor(zone=zone("none")), (0.5, 0.0)) == FORWARD


def test_approach_keeps_the_time_to_the_collision_with_the_footprint() -> None:
    made = monitor(
        near=zone("approach", points=None, time_before_collision=2.0, simulation_time_step=0.1)
    )
    driven = process(made, (1.25, 0.0), command=Twist2D(1.0))
    # the front, 0.2 m ahead, is past 1.25 m after eleven steps, so that the collision is put at ten
    assert driven.linear_x == pytest.approx(1.0 / 2.0)
    assert process(made, (1.25, 0.0), command=Twist2D(-1.0)) == Twist2D(-1.0)


def test_the_slowest_outcome_wins_and_a_stop_ends_the_search() -> None:
    zones = {
        "half": zone("slowdown", slowdown_ratio=0.5),
        "tenth": zone("slowdown", slowdown_ratio=0.1),
    }
    assert process(made := monitor(**zones), (0.5, 0.0)) == Twist2D(0.1, 0.0, pytest.approx(0.04))
    assert made.action.polygon == "tenth"
    zones = dict(reversed(zones.items()))
    process(made := monitor(**zones), (0.5, 0.0))
    assert made.action.polygon == "tenth"
    assert (
        process(made := monitor(**zones, stop=zone("stop"), later=zone("stop")), (0.5, 0.0))
        == STANDSTILL
    )
    assert made.action == MonitorAction("stop", "stop")


def test_turning_on_the_spot_counts_as_moving() -> None:
    turn = Twist2D(angular_z=1.0)
    assert process(monitor(zone=zone("slowdown")), (0.5, 0.0), command=turn) == Twist2D(
        angular_z=0.5
    )
    assert (
        process(made := monitor(zone=zone("slowdown")), (0.5, 0.0), command=STANDSTILL)
        == STANDSTILL
    )
    assert made.action == MonitorAction("none", "")


def test_min_points_are_enough_and_max_points_one_too_few() -> None:
    two = ((0.5, 0.0), (0.0, 0.4))
    assert process(monitor(zone=zone("stop", min_points=2)), *two) == STANDSTILL
    assert process(monitor(zone=zone("stop", min_points=3)), *two) == FORWARD
    assert process(monitor(zone=zone("stop", min_points=1, max_points=2)), *two) == FORWARD
    assert process(monitor(zone=zone("stop", max_points=1)), *two) == STANDSTILL
    # negative in 32 bits
    assert process(monitor(zone=zone("stop", min_points=3_000_000_000))) == STANDSTILL


def test_circles_and_disabled_zones() -> None:
    circle = zone("stop", type="circle", points=None, radius=0.5)
    assert process(monitor(zone=circle), (0.49, 0.0)) == STANDSTILL
    assert process(monitor(zone=circle), (0.5, 0.0)) == FORWARD
    assert process(monitor(zone=replace(circle, enabled=False)), (0.1, 0.0)) == FORWARD
    near = replace(circle, action_type="approach", time_before_collision=1.0)
    assert process(monitor(zone=near), (1.05, 0.0), command=Twist2D(1.0)).linear_x == pytest.approx(
        0.5
    )


def test_a_limit_is_half_a_metre_and_half_a_radian_per_second_if_none_is_given() -> None:
    for command, limited in (
        (Twist2D(1.0, 0.0, -0.9), Twist2D(0.5, 0.0, -0.45)),
        (Twist2D(0.6, 0.0, -1.0), Twist2D(0.3, 0.0, -0.5)),
    ):
        assert process(monitor(zone=zone("limit")), (0.9, 0.0), command=command) == limited


def test_a_velocity_polygon_without_polygons_is_refused() -> None:
    with pytest.raises(
        ParameterError, match=r"velocity_polygons \(\) must be the names of one polygon or more"
    ):
        zone("stop", type="velocity_polygon", points=None)


def test_velocity_polygons_follow_the_command_and_the_last_one_stays() -> None:
    far = "[[3.0, 0.5], [3.0, -0.5], [-0.5, -0.5], [-0.5, 0.5]]"
    shapes = {
        "fast": VelocityPolygonParams(far, 0.5, 2.0, -1.0, 1.0),
        "slow": VelocityPolygonParams(BOX, -0.5, 0.5, -1.0, 1.0),
    }
    made = monitor(
        zone=zone(
            "stop",
            type="velocity_polygon",
            points=None,
            velocity_polygons=("slow", "fast"),
            shapes=shapes,
        )
    )
    assert process(made, (2.0, 0.0), command=Twist2D(3.0)) == Twist2D(3.0)  # no polygon yet
    assert process(made, (2.0, 0.0), command=Twist2D(1.0)) == STANDSTILL
    assert process(made, (2.0, 0.0), command=Twist2D(3.0)) == STANDSTILL  # the fast one stays
    assert process(made, (2.0, 0.0), command=Twist2D(0.2)) == Twist2D(0.2)
    made.reset()
    # nothing is left of what was driven before
    assert process(made, (0.0, 0.0), command=Twist2D(3.0)) == Twist2D(3.0)


@pytest.mark.parametrize(
    ("start", "end", "y", "covered"),
    [
        (-0.5, 0.5, 0.0, True),
        (-0.5, 0.5, 0.6, False),
        (2.0, -2.0, 0.0, False),
        (0.5, -0.5, 0.6, True),
    ],
)
def test_holonomic_robots_are_asked_for_their_direction(
    start: float,
    end: float,
    y: float,
    covered: bool,
) -> None:
    params = VelocityPolygonParams(BOX, 0.0, 1.0, -1.0, 1.0, start, end)
    assert params.covers(0.5, y, 0.0, is_holonomic=True) is covered
    assert params.covers(0.5, y, 0.0, is_holonomic=False)


def test_a_zone_for_driving_backwards_holds_for_holonomic_robots() -> None:
    """Whose ranges are of the speed, not of its part along x."""
    params = VelocityPolygonParams(BOX, 0.0, 1.0, -1.0, 1.0, 2.5, -2.5)
    assert params.covers(-0.3, 0.0, 0.0, is_holonomic=True)
    assert not params.covers(-1.2, 0.0, 0.0, is_holonomic=True)
    assert not params.covers(-0.3, 0.0, 0.0, is_holonomic=False)


def test_a_stale_or_absent_scan_stops_the_robot_whatever_the_zones_say() -> None:
    made = monitor(zone=zone("none"))
    assert made.process(FORWARD, 0.0) == STANDSTILL
    assert made.action == MonitorAction("stop", "invalid source")
    made.receive(scan_of(stamp=1.0))
    assert made.process(FORWARD, 3.0) == FORWARD
    assert made.process(FORWARD, 3.01) == STANDSTILL
    made.receive(scan_of(stamp=3.0))
    assert made.process(FORWARD, 3.01) == FORWARD
    made.reset()
    assert made.action == MonitorAction("none", "")
    assert made.process(FORWARD, 3.01) == STANDSTILL


def test_a_source_may_have_a_timeout_of_its_own_or_none() -> None:
    never = {"scan": MonitorSourceParams(source_timeout=0.0)}
    assert monitor(never, zone=zone("stop")).process(FORWARD, 9.0) == FORWARD
    soon = {"scan": MonitorSourceParams(source_timeout=0.1)}
    made = monitor(soon, zone=zone("stop"))
    made.receive(scan_of())
    assert made.process(FORWARD, 0.2) == STANDSTILL


def test_which_sources_see_the_scan() -> None:
    off = {"scan": MonitorSourceParams(enabled=False)}
    assert process(monitor(off, zone=zone("stop")), (0.5, 0.0)) == FORWARD
    blind = {"sonar": MonitorSourceParams("range")}
    assert process(monitor(blind, zone=zone("stop")), (0.5, 0.0)) == FORWARD
    both = SCAN | {"cloud": MonitorSourceParams("pointcloud")} | blind
    # counted once
    assert process(monitor(both, zone=zone("stop", min_points=2)), (0.5, 0.0)) == FORWARD
    assert (
        process(monitor(both, zone=zone("stop", sources_names=("cloud",))), (0.5, 0.0))
        == STANDSTILL
    )
    assert (
        process(monitor(both, zone=zone("stop", sources_names=("sonar",))), (0.5, 0.0)) == FORWARD
    )
    with pytest.raises(UnknownNameError, match="sonra"):
        monitor(both, zone=zone("stop", sources_names=("sonra",)))


def test_points_stand_in_the_base_frame_and_move_with_the_odometry() -> None:
    made = monitor(zone=zone("stop"))
    mounted = Pose2D(-0.5, 0.0, math.pi)  # looks backwards
    for x, driven in ((1.4, FORWARD), (0.4, STANDSTILL)):
        made.receive(scan_of((x, 0.0), mount=mounted))
        assert made.process(FORWARD, 0.0) == driven
    scan = scan_of((1.2, 0.0))
    before = Pose2D(5.0, 1.0, 0.5)
    after = Pose2D(5.0 + 0.3 * math.cos(0.5), 1.3, 0.5)
    made.receive(scan, before)
    assert made.process(FORWARD, 0.0, before) == FORWARD
    assert made.process(FORWARD, 0.1, after) == STANDSTILL
    params = CollisionMonitorParams(
        False,
        2.0,
        False,
        ("zone",),
        ("scan",),
        {"zone": zone("stop")},
        SCAN,
    )
    unmoved = CollisionMonitor(replace(params, enabled=True), FOOTPRINT)
    unmoved.receive(scan, before)
    assert unmoved.process(FORWARD, 0.1, after) == FORWARD
    assert process(CollisionMonitor(params, FOOTPRINT), (0.5, 0.0)) == FORWARD  # disabled


def slow_collision_time(points, vertices, enough, velocity, horizon, step):
    """Every point, every step, in numpy."""
    x = y = yaw = 0.0
    vx, vy, w = velocity

    def count():
        c = math.cos(yaw)
        s = math.sin(yaw)
        seen = [((px - x) * c + (py - y) * s, -(px - x) * s + (py - y) * c) for px, py in points]
        return sum(is_inside(*point, vertices) for point in seen)

    if count() >= enough:
        return 0.0
    time = 0.0
    while time <= horizon:
        x = x + vx * step
        y = y + vy * step
        yaw = yaw + w * step
        c = math.cos(w * step)
        s = math.sin(w * step)
        vx, vy = vx * c - vy * s, vx * s + vy * c
        if count() >= enough:
            return time
        time += step
    return -1.0


def test_kernel_equals_slow_twin() -> None:
    rng = np.random.default_rng(8)
    seen = set()
    for _ in range(60):
        points = rng.uniform(-3.0, 3.0, (rng.integers(0, 40), 2))
        velocity = rng.uniform((-2.0, -0.5, -1.5), (3.0, 0.5, 1.5))
        enough = int(rng.integers(1, 4))
        ours = collision_time(points, FOOTPRINT, 0.0, enough, *velocity, 1.5, 0.05)
        assert ours == slow_collision_time(points, FOOTPRINT, enough, velocity, 1.5, 0.05)
        seen.add(ours)
    assert {-1.0, 0.0} < seen
    assert len(seen) > 5


def test_the_points_within_reach_come_first() -> None:
    points = np.vstack(
        (
            np.random.default_rng(3).uniform(-8.0, 8.0, (60, 2)),
            ((3.0, -4.0), (-3.0, 4.01), (0.0, 5.0)),
        )
    )
    near, count = within_reach(points, 5.0)
    assert_array_equal(near[:count], points[np.hypot(*points.T) <= 5.0])
    assert 10 < count < 50


def test_counting_stops_at_enough() -> None:
    points = np.zeros((5, 2))
    assert are_inside(points, 5, 0.0, 0.0, 0.0, FOOTPRINT, 0.0, 5)
    assert not are_inside(points, 4, 0.0, 0.0, 0.0, FOOTPRINT, 0.0, 5)


FILE = """
collision_monitor:
  ros__parameters:
    source_timeout: 0.5
    polygons: ["Near", "Speed"]
    observation_sources: ["scan", "depth", "sonar"]
    Near: {type: circle, radius: 0.4, action_type: stop, max_points: 2}
    Speed:
      type: velocity_polygon
      action_type: slowdown
      velocity_polygons: ["ahead"]
      ahead:
        points: "[[1.1, 0.5], [1.1, -0.5], [0.0, -0.5], [0.0, 0.5]]"
        linear_min: 0.0
        linear_max: 1.0
        theta_min: -1.0
        theta_max: 1.0
    scan: {type: scan, topic: /scan}
    depth: {type: pointcloud, topic: /depth}
    sonar: {type: range, topic: /sonar, source_timeout: 0.1}
"""


def load(tmp_path: Path, text: str) -> Nav2File:
    path = tmp_path / "robot.yaml"
    path.write_text(text)
    return load_nav2(path)


def test_a_file_is_read(tmp_path: Path) -> None:
    file = load(tmp_path, FILE)
    params = read_collision_monitor(file)
    assert params.polygons == ("Near", "Speed")
    assert params.zones["Near"].trigger_count == 3
    assert params.zones["Speed"].shapes["ahead"].linear_max == 1.0
    assert [params.timeout_of(source) for source in params.sources.values()] == [0.5, 0.5, 0.1]
    assert process(CollisionMonitor(params, FOOTPRINT), (0.0, 0.3)) == FORWARD
    assert (
        sum(
            "depth: a pointcloud runs on the robot's planar scan" in warning
            for warning in file.warnings
        )
        == 1
    )
    assert (
        sum(
            "sonar: there is no sensor of type 'range' here" in warning for warning in file.warnings
        )
        == 1
    )
    again = load(tmp_path, file.dump_merged())
    assert read_collision_monitor(again) == params


@pytest.mark.parametrize(
    "zone_text",
    [
        "{type: circle, radius: -0.4, action_type: stop, max_points: 2}",  # Nav2 squares it
        # read for other actions only
        "{type: circle, radius: 0.4, action_type: stop, max_points: 2, slowdown_ratio: -0.1, "
        "linear_limit: -1.0, time_before_collision: 0.0, simulation_time_step: 0.0}",
    ],
)
def test_what_nav2_does_not_read_of_a_zone_may_be_anything(tmp_path: Path, zone_text: str) -> None:
    given = "{type: circle, radius: 0.4, action_type: stop, max_points: 2}"
    assert FILE.count(given) == 1
    monitor = CollisionMonitor(
        read_collision_monitor(load(tmp_path, FILE.replace(given, zone_text))), FOOTPRINT
    )
    assert process(monitor, (0.39, 0.0), (0.0, 0.39), (-0.39, 0.0)) == STANDSTILL
    assert process(monitor, (0.41, 0.0), (0.0, 0.41), (-0.41, 0.0)) == FORWARD


def test_a_zone_that_is_off_needs_no_shape(tmp_path: Path) -> None:
    text = FILE.replace("radius: 0.4,", "polygon_sub_topic: /size, enabled: false,")
    monitor = CollisionMonitor(read_collision_monitor(load(tmp_path, text)), FOOTPRINT)
    assert process(monitor, (0.1, 0.0), (0.0, 0.1), (-0.1, 0.0)) == FORWARD


def test_a_file_without_a_monitor_has_no_zones(tmp_path: Path) -> None:
    file = load(tmp_path, "planner_server: {ros__parameters: {use_sim_time: true}}")
    assert read_collision_monitor(file) == CollisionMonitorParams()


@pytest.mark.parametrize(
    ("wrong", "right", "message"),
    [
        ("circle", "square", "type square must be one of"),
        ("action_type: stop", "action_type: halt", "action_type halt must be one of"),
        ("radius: 0.4", "polygon_sub_topic: /size", "given for a circle: no topic publishes"),
        ("stop, max", "slowdown, slowdown_ratio: -0.1, max", "slowdown_ratio -0.1 must be 0 or"),
        ("stop, max", "limit, angular_limit: -1.0, max", "angular_limit -1.0 must be 0 or more"),
        ("stop, max", "approach, simulation_time_step: 0.0, max", "0.0 must be more than 0"),
        ("stop, max", "approach, time_before_collision: 1001.0, max", "at least time_before"),
        ("type: circle", "type: polygon", "'points' are absent"),
        ("[1.1, 0.5], ", "", "at least 4 pairs"),
        ("type: range", "type: radar", "type radar must be one of"),
        ("max_points: 2", "max_pionts: 2", "did you mean 'max_points'"),
        ('["Near", "Speed"]', '["Near", "Speed", "Far"]', "Far"),
    ],
)
def test_mistakes_in_a_file_are_refused(
    tmp_path: Path,
    wrong: str,
    right: str,
    message: str,
) -> None:
    assert FILE.count(wrong) == 1
    with pytest.raises(ParameterError, match=message):
        load(tmp_path, FILE.replace(wrong, right))
