import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest

from harness.storage.shipped import shipped
from harness.task.stack import load_stack
from harness.world.map.scene import Obstacle, Scene
from harness.world.map.shapes import Rect
from harness.world.physics.body_state import BodyState
from harness.world.sensors.ground_truth import GroundTruthLocalizer
from harness.world.sensors.lidar import SelfFilter
from harness.world.sensors.suite import SensorParams, SensorSuite
from harness.world.sensors.wheel_odometry import along_arc, wheel_motion
from navstack.clock import Clock
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.errors import ParameterError
from navstack.geometry import compose, relative_to
from navstack.params.strict import load_dataclass
from navstack.types import Belief, Observation, Pose2D

NOBODY = np.empty((0, 4))
PRESETS = ("rtk_good", "white_noise", "published", "published_seen", "rtk_urban", "consumer_gps")
NAMES = ("odometry", "imu", "gps", "lidar")


def preset(name):
    return load_dataclass(SensorParams, shipped("params") / "sensors" / f"{name}.yaml")


def generators(seed=0):
    children = np.random.SeedSequence(seed).spawn(len(NAMES))
    return {name: np.random.default_rng(child) for name, child in zip(NAMES, children, strict=True)}


AT_REST = BodyState()


def scene_of(data, obstacles=()):
    grid = OccupancyGrid(data, 0.1, Pose2D(-10.0, -10.0))
    return Scene("test", tuple(obstacles), (), grid, grid)


def make_suite(params, seed=0, body=AT_REST):
    data = np.zeros((200, 200), dtype=np.int8)
    data[:, 190] = 100
    suite = SensorSuite(params, scene_of(data), 0.3)
    suite.reset(body, generators(seed))
    return suite


def run(params, bodies, seed=0, dt=1 / 60):
    suite = make_suite(params, seed, bodies[0])
    return [suite.measure(body, NOBODY, k * dt) for k, body in enumerate(bodies)]


def circle_drive(n, speed=1.2, yaw_rate=0.5, dt=1 / 60):
    """Exact motion on a circle of constant speed."""
    radius = speed / yaw_rate
    yaws = yaw_rate * dt * np.arange(n)
    return [
        BodyState(radius * math.sin(a), radius * (1 - math.cos(a)), a, speed, 0.0, yaw_rate)
        for a in yaws
    ]


@pytest.mark.parametrize("name", PRESETS)
def test_presets_load_and_measure(name):
    observations = run(preset(name), [BodyState()] * 60)
    for field in ("odometry", "imu", "gps", "scan"):
        assert any(getattr(observation, field) is not None for observation in observations), field
    assert all(np.isfinite(o.scan.ranges).any() for o in observations if o.scan is not None)


def test_every_preset_value_states_its_unit():
    for name in PRESETS:
        text = (Path(shipped("params")) / "sensors" / f"{name}.yaml").read_text()
        for line in text.splitlines():
            if line.startswith("  ") and "beams" not in line:
                assert "# [" in line, line


def test_a_misspelt_or_impossible_value_is_an_error(tmp_path):
    text = (shipped("params") / "sensors" / "rtk_good.yaml").read_text()
    file = tmp_path / "sensors.yaml"
    for old, new, message in (
        ("position_std", "position_sd", "position_std"),
        ("position_std: 0.02", "position_std: -1", "position_std"),
        ("velocity_std: 0.02", "velocity_std: -1", "velocity_std"),
        ("rate: 30.0", "rate: 0", "rate 0"),
    ):
        file.write_text(text.replace(old, new))
        with pytest.raises(ParameterError, match=message):
            load_dataclass(SensorParams, file)


@pytest.mark.parametrize("rate", [1.0, 10.0, 20.0, 30.0, 40.0, 60.0, 120.0])
def test_a_rate_that_divides_the_steps_is_met_exactly(rate):
    clock = Clock(rate)
    fired = [k for k in range(120 * 300) if clock.is_due(k / 120)]
    assert fired == list(range(0, 120 * 300, int(120 / rate)))


def test_a_summed_clock_does_not_shift_the_periods():
    clock, stamp, fired = Clock(30.0), 0.0, []
    for k in range(120 * 300):
        if clock.is_due(stamp):
            fired.append(k)
        stamp += 1 / 120
    assert fired == list(range(0, 120 * 300, 4))


def test_other_rates_are_met_on_average_and_faster_ones_at_every_tick():
    clock = Clock(7.0)
    assert sum(clock.is_due(k / 60) for k in range(60 * 100)) == 700
    fast = Clock(500.0)
    assert all(fast.is_due(k / 60) for k in range(600))


def test_between_measurements_the_fields_are_empty():
    observations = run(preset("rtk_good"), [BodyState()] * 601)
    counts = {
        field: sum(getattr(o, field) is not None for o in observations)
        for field in ("odometry", "imu", "gps", "scan")
    }
    assert counts == {"odometry": 301, "imu": 301, "gps": 101, "scan": 101}
    assert all(o.gps.stamp == o.stamp for o in observations if o.gps is not None)


def with_latencies(params, **latencies):
    changes = {
        name: dataclasses.replace(getattr(params, name), latency=value)
        for name, value in latencies.items()
    }
    return dataclasses.replace(params, **changes)


def test_late_messages_are_those_of_the_past_with_their_own_stamps():
    bodies = circle_drive(300)
    prompt = run(preset("rtk_good"), bodies)
    late = run(
        with_latencies(preset("rtk_good"), gps=0.25, imu=0.1, odometry=0.05, lidar=0.05), bodies
    )
    for field, delay in (("gps", 15), ("imu", 6), ("odometry", 3), ("scan", 3)):
        for now, before in zip(late[delay:], prompt[:-delay], strict=True):
            given, expected = getattr(now, field), getattr(before, field)
            assert (given is None) == (expected is None)
            if given is not None:
                assert given.stamp == expected.stamp == pytest.approx(now.stamp - delay / 60)
                assert (
                    np.array_equal(given.ranges, expected.ranges)
                    if field == "scan"
                    else given == expected
                )
        assert all(getattr(o, field) is None for o in late[:delay])


def test_of_messages_that_arrive_together_the_newest_counts_and_none_outlives_its_episode():
    params = with_latencies(preset("rtk_good"), gps=0.3)
    suite = make_suite(params)
    for stamp in (0.0, 0.1, 0.2):
        assert suite.measure(BodyState(), NOBODY, stamp).gps is None
    # that of 0.0 came at the same tick
    assert suite.measure(BodyState(), NOBODY, 0.45).gps.stamp == 0.1
    assert suite.measure(BodyState(), NOBODY, 0.46).gps is None
    suite.reset(BodyState(), generators())
    assert suite.measure(BodyState(), NOBODY, 0.0).gps is None
    assert suite.measure(BodyState(), NOBODY, 0.3).gps.stamp == 0.0


def test_the_map_decides_where_satellites_are_hidden():
    params = dataclasses.replace(
        preset("rtk_urban"), gps=dataclasses.replace(preset("rtk_urban").gps, latency=0.0)
    )
    walls = [
        Obstacle("building_glass", Rect(x, -60.0, x + 5.0, 60.0).polygon, 20.0) for x in (-6.5, 1.5)
    ]
    grid = np.zeros((200, 200), dtype=np.int8)
    canyon = SensorSuite(params, scene_of(grid, walls), 0.3)
    open_sky = SensorSuite(params, scene_of(grid), 0.3)
    for suite, has_fix in ((canyon, False), (open_sky, True)):
        suite.reset(BodyState(), generators())
        fixes = [suite.measure(BodyState(), NOBODY, 0.1 * k).gps for k in range(50)]
        assert all((fix is not None) == has_fix for fix in fixes)


def test_noiseless_odometry_retraces_the_true_path():
    bodies = circle_drive(2000)
    last = [o.odometry for o in run(preset("published"), bodies) if o.odometry is not None][-1]
    start, end = (Pose2D(b.x, b.y, b.yaw) for b in (bodies[0], bodies[1998]))
    expected = relative_to(start, end)
    np.testing.assert_allclose(last.pose.as_array(), expected.as_array(), atol=1e-9)
    assert (last.twist.linear_x, last.twist.angular_z) == (1.2, 0.5)


def test_wheels_do_not_feel_a_push_from_the_side():
    pushed = BodyState(3.0, 1.0 + 0.5, 0.0)
    assert wheel_motion(BodyState(2.0, 1.0, 0.0), pushed) == (1.0, 0.0)
    backwards = wheel_motion(BodyState(0.0, 0.0, math.pi), BodyState(1.0, 0.0, math.pi))
    assert backwards == pytest.approx((-1.0, 0.0))


def test_an_arc_is_undone_by_the_wheels_across_the_angle_seam():
    start = Pose2D(1.0, 2.0, 3.0)
    end = compose(start, Pose2D(*along_arc(0.7, 0.5), 0.5))
    moved = wheel_motion(BodyState(start.x, start.y, start.yaw), BodyState(end.x, end.y, end.yaw))
    assert moved == pytest.approx((0.7, 0.5))


def test_odometry_errors_have_the_stated_size():
    """Straight drive of 10 m: the error of the distance is scale error and a random walk."""
    params = dataclasses.replace(
        preset("rtk_good").odometry,
        linear_scale_std=0.01,
        linear_noise=0.02,
        yaw_noise_per_distance=0.0,
    )
    params = dataclasses.replace(preset("rtk_good"), odometry=params)
    bodies = [BodyState(x=10.0 * k / 60, vx=10.0) for k in range(61)]
    errors = [
        [o.odometry for o in run(params, bodies, seed) if o.odometry is not None][-1].pose.x - 10.0
        for seed in range(300)
    ]
    expected = math.sqrt((0.01 * 10.0) ** 2 + 0.02**2 * 10.0)
    assert abs(np.mean(errors)) < 3.0 * expected / math.sqrt(300)
    assert abs(np.std(errors) - expected) < 3.0 * expected / math.sqrt(600)


def test_heading_drifts_with_the_root_of_the_distance():
    params = preset("white_noise")
    bodies = [BodyState(x=10.0 * k / 60, vx=10.0) for k in range(61)]
    yaws = [
        [o.odometry for o in run(params, bodies, seed) if o.odometry is not None][-1].pose.yaw
        for seed in range(300)
    ]
    expected = params.odometry.yaw_noise_per_distance * math.sqrt(10.0)
    assert abs(np.std(yaws) - expected) < 3.0 * expected / math.sqrt(600)


def test_white_noise_has_the_stated_deviations():
    params = preset("white_noise")
    body = BodyState(4.0, -3.0, 1.0, 0.7, 0.0, 0.2, 0.5, -0.4)
    observations = run(params, [body] * 6001)
    fixes = [o.gps for o in observations if o.gps is not None]
    imus = [o.imu for o in observations if o.imu is not None]
    odometry = [o.odometry for o in observations if o.odometry is not None]
    for values, mean, deviation in (
        ([f.x for f in fixes], 4.0, params.gps.position_std),
        ([f.y for f in fixes], -3.0, params.gps.position_std),
        ([i.yaw for i in imus], 1.0, params.imu.yaw_std),
        ([i.angular_velocity_z for i in imus], 0.2, params.imu.yaw_rate_std),
        ([i.linear_acceleration_x for i in imus], 0.5, params.imu.acceleration_std),
        ([i.linear_acceleration_y for i in imus], -0.4, params.imu.acceleration_std),
        ([o.twist.linear_x for o in odometry], 0.7, params.odometry.velocity_std),
        ([o.twist.angular_z for o in odometry], 0.2, params.odometry.yaw_rate_std),
    ):
        n = len(values)
        assert abs(np.mean(values) - mean) < 3.0 * deviation / math.sqrt(n)
        assert abs(np.std(values) - deviation) < 3.0 * deviation / math.sqrt(2 * n)
    assert {f.position_std for f in fixes} == {params.gps.position_std}


def test_yaw_stays_normalized():
    observations = run(preset("white_noise"), [BodyState(yaw=math.pi)] * 200)
    yaws = [o.imu.yaw for o in observations if o.imu is not None]
    assert all(-math.pi <= yaw < math.pi for yaw in yaws)
    assert min(yaws) < 0.0 < max(yaws)


def test_sensors_do_not_share_their_chance():
    """More lidar noise, other beams and another IMU rate leave fixes and odometry as they were."""
    base = preset("rtk_good")
    other = dataclasses.replace(
        base,
        lidar=dataclasses.replace(base.lidar, noise_std=0.5, beams=90, rate=30.0),
        imu=dataclasses.replace(base.imu, rate=60.0),
    )
    bodies = circle_drive(600)
    first, second = run(base, bodies), run(other, bodies)
    assert [o.gps for o in first] == [o.gps for o in second]
    assert [o.odometry for o in first] == [o.odometry for o in second]


def test_the_same_seed_gives_the_same_numbers_also_on_a_second_episode():
    bodies = circle_drive(300)
    suite = make_suite(preset("rtk_good"))

    def episode(seed):
        suite.reset(bodies[0], generators(seed))
        return [suite.measure(body, NOBODY, k / 60) for k, body in enumerate(bodies)]

    first, other, again = episode(1), episode(2), episode(1)
    assert [(o.odometry, o.imu, o.gps) for o in first] == [
        (o.odometry, o.imu, o.gps) for o in again
    ]
    assert first[0].gps != other[0].gps
    for a, b in zip(first, again, strict=True):
        assert (a.scan is None) == (b.scan is None)
        assert a.scan is None or np.array_equal(a.scan.ranges, b.scan.ranges)


def test_ground_truth_knows_the_pose():
    pose = Pose2D(1.0, 2.0, 3.0)
    localizer = GroundTruthLocalizer(lambda: pose)
    localizer.reset(Belief(Pose2D()), np.random.default_rng(0))
    belief = localizer.update(Observation(4.0))
    assert (belief.pose, belief.stamp) == (pose, 4.0)
    assert not belief.covariance.any()
    pose = Pose2D(5.0, 6.0, 0.5)
    assert localizer.update(Observation(5.0)).pose == pose


@pytest.mark.parametrize("localizer", ["gps", "amcl"])
def test_the_published_rows_come_with_and_without_people_in_the_scan(localizer):
    """Nothing else differs."""
    stacks = [load_stack(f"paper-{localizer}{variant}") for variant in ("", "-seen")]
    blind, seeing = (load_dataclass(SensorParams, Path(stack.sensors)) for stack in stacks)
    assert (blind.lidar.sees_people, seeing.lidar.sees_people) == (False, True)
    assert (
        dataclasses.replace(blind, lidar=dataclasses.replace(blind.lidar, sees_people=True))
        == seeing
    )
    same = [dataclasses.replace(stack, title="", name="", sensors="") for stack in stacks]
    assert same[0] == same[1]


def test_a_filter_that_holds_nothing_is_refused():
    lidar = preset("rtk_good").lidar
    with pytest.raises(ParameterError, match="holds nothing"):
        dataclasses.replace(lidar, self_filter=SelfFilter(1.0, -1.0, 0.0, 1.0))


def lasting_errors():
    """Errors that last, and no others."""
    params = preset("rtk_good")
    odometry = dataclasses.replace(params.odometry, linear_scale_std=0.1, velocity_std=0.0)
    imu = dataclasses.replace(params.imu, yaw_rate_bias_std=0.1, yaw_rate_std=0.0)
    imu = dataclasses.replace(imu, yaw_std=0.0, yaw_wander_std=0.2, yaw_wander_time=1e6)
    gps = dataclasses.replace(
        params.gps, position_std=0.0, drift_std=2.0, drift_time=100.0, reacquisition_time=1e6
    )
    return dataclasses.replace(params, odometry=odometry, imu=imu, gps=gps)


def errors_seen(suite):
    moving = BodyState(0.0, 0.0, 0.0, 1.0, 0.0, 0.5)
    seen = suite.measure(moving, NOBODY, 0.0)
    imu, fix = seen.imu, seen.gps
    return [seen.odometry.twist.linear_x, imu.angular_velocity_z, imu.yaw, fix.x, fix.y]


def test_lasting_errors_go_on_in_the_next_episode_and_fade_with_time():
    params = lasting_errors()
    before = make_suite(params, 0)
    seen, left = errors_seen(before), before.lasting(0.0)
    fresh = errors_seen(make_suite(params, 1))
    after = make_suite(params, 1)
    after.take_over(left, 0.0)
    assert errors_seen(after) == pytest.approx(seen)
    assert np.abs(np.subtract(fresh, seen)).min() > 1e-3
    later = make_suite(params, 1)
    later.take_over(left, 1e5)  # [s] a thousand times the drift's time
    found = errors_seen(later)
    assert found[:2] == pytest.approx(seen[:2]) and abs(found[3] - seen[3]) > 1e-3


def test_the_script_of_outages_goes_on_in_the_next_episode():
    params = lasting_errors()
    params = dataclasses.replace(
        params, gps=dataclasses.replace(params.gps, outages=((20.0, 30.0),))
    )
    for worked, age, has_fix in ((15.0, 4.0, True), (15.0, 6.0, False), (29.0, 2.0, True)):
        before, suite = make_suite(params), make_suite(params)
        suite.take_over(before.lasting(worked), age)
        assert (suite.measure(AT_REST, NOBODY, 0.0).gps is not None) == has_fix
        again = make_suite(params)
        again.take_over(suite.lasting(0.5), 0.0)
        is_over = worked + age + 0.5 >= 30.0 or worked + age + 0.5 < 20.0
        assert (again.measure(AT_REST, NOBODY, 0.0).gps is not None) == is_over


def test_a_receiver_without_a_fix_has_none_in_the_next_episode_either():
    params = lasting_errors()
    for silent, age, has_fix in ((math.inf, 50.0, False), (8.0, 5.0, False), (8.0, 9.0, True)):
        suite = make_suite(params)
        left = suite.lasting(0.0)
        suite.take_over({**left, "gps": (*left["gps"][:4], silent, 0.0)}, age)
        assert (suite.measure(AT_REST, NOBODY, 0.0).gps is not None) == has_fix
