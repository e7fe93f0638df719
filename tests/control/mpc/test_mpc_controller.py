"""The jerk-limited MPC as a whole: against the analytic optimum, its limits, its stops."""

import math
from dataclasses import replace
from pathlib import Path as FilePath
from unittest.mock import Mock

import numpy as np
import pytest
from pytest import approx
from shapely import Point, Polygon, affinity

from navstack.control.controller import Surroundings
from navstack.control.mpc import stage_layout as at
from navstack.control.mpc.mpc_controller import JerkLimitedMpcController
from navstack.control.mpc.stop_profile import stop_after, stop_time
from navstack.errors import InvalidPathError, ParameterError
from navstack.params.extensions import algorithms
from navstack.params.mpc import MpcParams
from navstack.params.nav2_file.file import load_nav2
from navstack.params.nav2_file.views import read_controller
from navstack.types import Path, Pose2D, RobotState, Track, Twist2D

from ..given import DELIVERY_ROBOT, inflated, robot, straight
from .given import PERIOD, least_time

FREQUENCY = 30.0
PARAMS = MpcParams()
NAV2_FILE = FilePath(__file__).parents[3] / "params" / "nav2" / "mpc.yaml"
SURE = np.diag((0.01, 0.01, 0.01, 0.01))


def make(tolerance=0.25, **given):
    return JerkLimitedMpcController(replace(PARAMS, **given), DELIVERY_ROBOT, FREQUENCY, tolerance)


def costmap(*boxes):
    """48 x 24 m from (-12, -12) on, with boxes (x0, x1, y0, y1) in it."""
    return inflated(960, 480, (-12.0, -12.0), *boxes)


def line(length):
    """A straight plan with a pose every 5 cm."""
    return straight(length, count=max(2, round(length / 0.05) + 1))


FREE = Surroundings(costmap())


def drive(
    controller,
    plan,
    around,
    seconds,
    *pose,
):
    """Rows (time, x, y, yaw, v, omega, a, alpha) of a robot that does what it is told.

    They go on until it stands at the end.
    """
    state = np.zeros(7)
    state[:3] = pose or (0.0, 0.0, 0.0)
    rows = []
    controller.reset()
    for cycle in range(round(seconds * FREQUENCY)):
        time = cycle * PERIOD
        seen = around if isinstance(around, Surroundings) else around(time, state[0])
        believed = RobotState(Pose2D(*state[:3]), Twist2D(state[3], 0.0, state[4]), time)
        command = controller.compute_velocity(believed, plan, seen)
        assert command.linear_y == 0.0
        after = np.array((command.linear_x, command.angular_z, *controller._motion[2:]))
        way, turn = 0.5 * PERIOD * (state[3:5] + after[:2]) + PERIOD**2 / 12.0 * (
            state[5:] - after[2:]
        )
        yaw = state[2] + 0.5 * turn
        state[:3] += way * math.cos(yaw), way * math.sin(yaw), turn
        state[3:] = after
        rows.append((time + PERIOD, *state))
        if (
            math.hypot(state[0] - plan.poses[-1, 0], state[1] - plan.poses[-1, 1]) < 2e-3
            and abs(state[3]) < 2e-3
        ):
            break
    return np.array(rows)


def test_rest_to_rest_takes_the_least_time():
    controller = make(tolerance=0.01)
    for length in (0.1, 0.3, 1.0, 3.0, 8.0, 20.0):
        least = least_time(length)
        driven = drive(controller, line(length), FREE, least + 2.0)
        assert driven[-1, 1] == approx(length, abs=2e-3)
        assert driven[-1, 0] <= least + max(0.05 * least, 2.0 * PERIOD)
        # It counts as arrived within 2 mm at less than 2 mm/s, which takes at most sqrt(2 * 0.002 /
        # J) s less.
        assert driven[-1, 0] >= least - math.sqrt(2.0 * 2e-3 / PARAMS.max_jerk)
    assert controller.failures == 0


def check_limits(v, omega):
    """Commands (n,) from standstill on, by their differences."""
    for rate, low, high, slower, faster, jerk in (
        (
            v,
            0.0,
            PARAMS.max_speed,
            PARAMS.max_deceleration,
            PARAMS.max_acceleration,
            PARAMS.max_jerk,
        ),
        (
            omega,
            -PARAMS.max_yaw_rate,
            PARAMS.max_yaw_rate,
            PARAMS.max_yaw_acceleration,
            PARAMS.max_yaw_acceleration,
            PARAMS.max_yaw_jerk,
        ),
    ):
        rate = np.concatenate(((0.0, 0.0), rate))
        first = np.diff(rate) / PERIOD
        second = np.diff(rate, 2) / PERIOD**2
        assert rate.min() >= low - 1e-6
        assert rate.max() <= high + 1e-6
        assert first.min() >= -slower - 1e-6
        assert first.max() <= faster + 1e-6
        assert np.abs(second).max() <= jerk + 1e-6
    assert np.abs(v * omega).max() <= PARAMS.max_lateral_acceleration + 1e-3


def random_plan(rng):
    """A path of random curves, some too tight for the speed."""
    count = 240
    yaw = np.cumsum(np.repeat(rng.normal(scale=1.2, size=8), count // 8)) * 0.05 + rng.uniform(
        -3.0, 3.0
    )
    x = np.cumsum(np.cos(yaw)) * 0.05
    y = np.cumsum(np.sin(yaw)) * 0.05
    return Path(np.column_stack((x, y, yaw)))


def test_no_limit_is_exceeded_whatever_happens():
    controller = make()
    rng = np.random.default_rng(7)
    fastest = 0.0
    for _ in range(15):
        boxes = [(x, x + 0.3, y, y + 0.3) for x, y in rng.uniform(-6.0, 6.0, size=(6, 2))]
        field = costmap(*boxes)
        people = rng.uniform((-6.0, -6.0, -1.5, -1.5), (6.0, 6.0, 1.5, 1.5), size=(4, 4))

        def around(time, _, field=field, people=people):
            tracks = (
                Track(i, time, x + time * vx, y + time * vy, vx, vy, 0.3, SURE)
                for i, (x, y, vx, vy) in enumerate(people.tolist())
            )
            return Surroundings(field, tuple(tracks))

        driven = drive(controller, random_plan(rng), around, 3.0)
        check_limits(driven[:, 4], driven[:, 5])
        fastest = max(fastest, driven[:, 4].max())
    assert fastest > 1.5
    assert controller.failures == 0


def test_a_person_stepping_out_is_met_with_the_hardest_stop():
    controller = make()
    steps_out = 5.0  # [m] where the robot is then
    clear = costmap()
    blocked = costmap((steps_out + 1.1, steps_out + 1.7, -0.4, 0.4))

    def around(_, x):
        return Surroundings(blocked if x >= steps_out else clear)

    driven = drive(controller, line(15.0), around, 8.0)
    check_limits(driven[:, 4], driven[:, 5])
    seen = int(np.argmax(driven[:, 1] >= steps_out))
    v = driven[seen, 4]
    a = driven[seen, 6]
    whole = stop_time(v, a, PARAMS.max_deceleration, PARAMS.max_jerk)
    for row in driven[seen + 1 : seen + 1 + math.ceil(whole / PERIOD)]:
        _, expected, _ = stop_after(
            v, a, PARAMS.max_deceleration, PARAMS.max_jerk, row[0] - driven[seen, 0]
        )
        assert row[4] == approx(expected, abs=0.02)
    assert driven[-1, 4] == approx(0.0, abs=1e-6)
    assert np.abs(driven[seen:, 2]).max() < 0.05


@pytest.mark.parametrize(
    ("y", "vx", "vy"), [(0.0, -1.2, 0.0), (0.3, -1.2, 0.0), (-3.0, 0.0, 0.75), (0.0, 0.0, 0.0)]
)
def test_tracked_people_are_passed_without_touching_them(y, vx, vy):
    controller = make()
    x = 8.0 - 4.0 * vx

    def around(time, _):
        return Surroundings(
            free_map, (Track(1, time, x + time * vx, y + time * vy, vx, vy, 0.3, SURE),)
        )

    free_map = costmap()
    driven = drive(controller, line(15.0), around, 14.0)
    assert driven[-1, 1] == approx(15.0, abs=0.3)
    for time, rx, ry, yaw in driven[:, :4]:
        body = affinity.translate(
            affinity.rotate(Polygon(DELIVERY_ROBOT), yaw, (0, 0), use_radians=True), rx, ry
        )
        assert body.distance(Point(x + time * vx, y + time * vy)) > 0.3 + 0.1


def test_it_passes_a_narrow_place_and_keeps_off_the_walls():
    around = Surroundings(
        costmap((2.0, 6.0, 0.75, 1.0), (2.0, 6.0, -1.0, -0.75), (8.0, 8.3, -0.1, 0.6))
    )
    plan = line(12.0)
    plan.poses[:, 1] -= 0.8 * np.exp(-((plan.poses[:, 0] - 8.0) ** 2))
    driven = drive(make(), plan, around, 14.0)
    assert driven[-1, 1] == approx(12.0, abs=0.3)


def test_it_turns_on_the_spot_to_a_path_behind_it_and_to_the_goals_yaw():
    poses = line(4.0).poses * (-1.0, 1.0, 1.0)
    poses[:, 2] = math.pi
    poses[-1, 2] = math.pi / 2.0
    driven = drive(make(tolerance=0.5), Path(poses), FREE, 12.0, 0.0, 0.0, 0.3)
    turned = int(np.argmax(driven[:, 3] > 2.0))
    assert np.abs(driven[:turned, 1]).max() < 0.05
    check_limits(driven[:, 4], driven[:, 5])
    assert driven[-1, 3] % (2.0 * math.pi) == approx(math.pi / 2.0, abs=0.25)


@pytest.mark.parametrize(
    ("places", "is_there"),
    [
        ([1.74], False),
        ([1.76], True),  # within half the tolerance
        ([1.76, 1.51], True),  # from then on within the whole
        ([1.76, 1.49], False),
        ([1.51], False),
        ([2.6], True),  # past the line's end
    ],
)
def test_it_turns_to_the_goals_yaw_within_half_the_tolerance(places, is_there):
    controller = make(tolerance=0.5)
    plan = line(2.0)
    plan.poses[-1, 2] = 0.7
    controller.compute_velocity(robot(1.51), plan, FREE)
    for x in places:
        wishes = controller._wishes(np.array((x, 0.0, 0.0)), controller._line)
    expected = (0.7, True) if is_there else (math.nan, False)
    assert (wishes.heading, controller._at_goal) == approx(expected, nan_ok=True)


def test_it_begins_a_turn_on_the_spot_later_than_it_ends_it():
    # [rad] exact in binary
    controller = make(turn_threshold=0.75)
    plan = line(8.0)
    for share, turns in (
        (1.0, False),
        (1.1, True),
        (0.6, True),
        (0.5, False),
        (0.6, False),
        (-1.1, True),
    ):
        yaw = share * 0.75
        controller.compute_velocity(robot(yaw=yaw), plan, FREE)
        assert controller._turning == turns
        assert controller._wishes(np.array((0.0, 0.0, yaw)), controller._line).speed == (
            0.0 if turns else 2.0
        )


def test_a_failing_solver_brakes_within_the_limits_and_is_counted():
    controller = make()
    plan = line(10.0)
    state = robot()
    working = controller._solver
    rows = []
    for cycle in range(120):
        if cycle == 60:
            controller._solver = Mock(step=Mock(return_value=None))
        before = rows[-1] if rows else Twist2D()
        state = RobotState(Pose2D(state.pose.x + PERIOD * before.linear_x), before, cycle * PERIOD)
        rows.append(controller.compute_velocity(state, plan, FREE))
        assert controller.decision.status == ("solved" if cycle < 60 else "failed")
    check_limits(
        np.array([row.linear_x for row in rows]), np.array([row.angular_z for row in rows])
    )
    assert rows[59].linear_x == approx(2.0, abs=0.01)
    assert rows[-1].linear_x == 0.0
    assert controller.failures == 60
    assert controller.decision.total is None
    assert controller.decision.rejected == 1
    controller._solver = working
    assert (
        controller.compute_velocity(replace(state, stamp=120 * PERIOD), plan, FREE).linear_x > 0.0
    )


@pytest.mark.parametrize(("later", "steps"), [(0.4, 1), (0.5, 5)])
def test_a_solution_of_half_a_second_ago_is_of_no_use(later, steps):
    controller = make()
    controller.compute_velocity(robot(), line(8.0), FREE)
    controller._solver = counted = Mock(wraps=controller._solver)
    controller.compute_velocity(robot(stamp=later), line(8.0), FREE)
    assert counted.step.call_count == steps


def test_the_decision_tells_the_cost_terms():
    controller = make()
    assert controller.decision is None
    command = controller.compute_velocity(robot(0.0, 0.2, stamp=4.0), line(5.0), FREE)
    told = controller.decision
    assert told.stamp == 4.0
    assert told.decided_by == "JerkLimitedMPC"
    assert told.command == command
    assert told.status == "solved"
    assert tuple(score.critic for score in told.scores) == at.TERMS
    assert told.total == approx(sum(score.weighted for score in told.scores))
    assert told.scores[0].raw > 0.0
    controller.reset()
    assert controller.decision is None


def test_a_speed_limit_is_kept_and_lifted():
    controller = make()
    for limit, is_percentage, expected in ((50.0, True, 1.0), (0.6, False, 0.6), (0.0, False, 2.0)):
        controller.set_speed_limit(limit, is_percentage)
        driven = drive(controller, line(8.0), FREE, 6.0)
        assert driven[:, 4].max() == approx(expected, abs=0.02)


def test_it_believes_the_odometry_where_that_is_far_off():
    controller = make()
    drive(controller, line(8.0), FREE, 2.0)
    held = robot(2.0, stamp=2.0)  # something else stopped it
    assert controller.compute_velocity(held, line(8.0), FREE).linear_x < 0.1


def test_it_goes_on_from_the_odometry_after_it_was_not_asked():
    controller = make()
    drive(controller, line(8.0), FREE, 2.0)
    # less off than it takes to be believed otherwise
    slowed = robot(2.0, v=1.5, stamp=2.2)
    controller.resume()
    assert controller.compute_velocity(slowed, line(8.0), FREE).linear_x == approx(1.5, abs=0.06)


def test_odometry_that_is_not_finite_counts_as_rest():
    controller = make()
    blind = robot(v=math.nan, w=math.inf)
    command = controller.compute_velocity(blind, line(8.0), FREE)
    assert command == controller.decision.command
    assert controller.decision.status == "solved"
    assert 0.0 < command.linear_x < 0.1
    assert abs(command.angular_z) < 0.01


def test_an_empty_plan_is_refused_in_one_line():
    with pytest.raises(InvalidPathError, match="no poses"):
        make().compute_velocity(robot(), Path(np.empty((0, 3))), FREE)


@pytest.mark.parametrize(
    ("key", "value"),
    [("max_jerk", 0.0), ("solver", "numba"), ("horizon", 1), ("lag_weight", -1.0), ("step", 0.0)],
)
def test_parameters_out_of_range_are_refused(key, value):
    with pytest.raises(ParameterError, match=key):
        MpcParams(**{key: value})


def test_the_nav2_file_selects_it():
    plugin = read_controller(load_nav2(NAV2_FILE))
    assert plugin.type == "navstack::JerkLimitedMPC"
    assert isinstance(plugin.params, MpcParams)
    parts = {"footprint": DELIVERY_ROBOT, "control_frequency": FREQUENCY, "xy_goal_tolerance": 0.5}
    controller = algorithms("controllers")[plugin.type].create(plugin.params, parts=parts)
    assert isinstance(controller, JerkLimitedMpcController)
