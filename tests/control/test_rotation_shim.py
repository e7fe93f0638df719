"""The branches of the rotation shim that no recorded rollout takes."""

import math
from dataclasses import replace

import numpy as np
import pytest

from navstack.control.controller import Controller, Surroundings
from navstack.control.rotation_shim import RotationShimController
from navstack.costmap.costmap import LETHAL_OBSTACLE, Costmap
from navstack.params.rotation_shim import RotationShimParams
from navstack.types import Path, Pose2D, RobotState, Twist2D

FOOTPRINT = np.array(((0.19, 0.3), (0.19, -0.3), (-0.657, -0.3), (-0.657, 0.3)))
PRIMARY = Twist2D(99.0, 0.0, 0.25)
PARAMS = RotationShimParams(
    angular_dist_threshold=1.0472,
    angular_disengage_threshold=0.1745,
    forward_sampling_distance=1.0,
    rotate_to_heading_angular_vel=1.0,
    max_angular_accel=2.5,
    simulate_ahead_time=1.5,
    closed_loop=False,
)


class Primary(Controller):
    """Always the same command."""

    def __init__(self) -> None:
        self.resets = self.resumed = 0

    def reset(self) -> None:
        self.resets += 1

    def resume(self) -> None:
        self.resumed += 1

    def compute_velocity(
        self, state: RobotState, plan: Path, surroundings: Surroundings
    ) -> Twist2D:
        return PRIMARY


def make(params: RotationShimParams = PARAMS, frequency: float = 30.0) -> RotationShimController:
    return RotationShimController(params, Primary(), FOOTPRINT, frequency, xy_goal_tolerance=0.25)


def surroundings(obstacle: tuple[float, float] | None = None) -> Surroundings:
    costmap = Costmap(np.zeros((120, 120), dtype=np.uint8), 0.05, -3.0, -3.0)
    if obstacle is not None:
        mx, my = costmap.world_to_map(*obstacle)
        costmap.data[my, mx] = LETHAL_OBSTACLE
    return Surroundings(costmap)


def ahead(length: float = 3.0) -> Path:
    poses = np.zeros((61, 3))
    poses[:, 0] = np.linspace(0.0, length, 61)
    return Path(poses)


def test_a_predicted_collision_hands_over_until_the_next_plan() -> None:
    shim, state = make(), RobotState(Pose2D(yaw=-2.0), Twist2D())
    blocked = surroundings(obstacle=(0.42, 0.57))  # the tail sweeps over it
    plan = ahead()
    assert shim.compute_velocity(state, plan, surroundings()).linear_x == 0.0
    shim.reset()
    assert shim.compute_velocity(state, plan, surroundings(obstacle=(0.5, 2.0))).linear_x == 0.0
    shim.reset()
    turning = RobotState(Pose2D(yaw=-2.0), Twist2D(angular_z=1.0))
    closed = make(replace(PARAMS, closed_loop=True))
    assert closed.compute_velocity(turning, plan, blocked) == PRIMARY
    # the same plan is not looked at again
    assert closed.compute_velocity(turning, plan, surroundings()) == PRIMARY
    assert closed.compute_velocity(turning, ahead(), surroundings()).angular_z == 1.0


def test_open_loop_accelerates_from_its_last_command_and_closed_loop_from_the_measurement() -> None:
    still = RobotState(Pose2D(yaw=2.0), Twist2D())
    step = 2.5 / 30.0
    for closed_loop, expected in (
        (False, [-step, -2 * step, -3 * step]),
        (True, [-step, -step, -step]),
    ):
        shim, plan = make(replace(PARAMS, closed_loop=closed_loop)), ahead()
        rates = [shim.compute_velocity(still, plan, surroundings()).angular_z for _ in range(3)]
        assert rates == pytest.approx(expected)


def test_it_turns_to_the_goals_heading_within_the_tolerance_and_stays_at_it() -> None:
    poses = ahead(1.0).poses.copy()
    poses[-1, 2] = 1.5
    shim, plan = make(replace(PARAMS, rotate_to_goal_heading=True)), Path(poses)
    far, near = Pose2D(0.7, 0.0, 0.0), Pose2D(0.8, 0.0, 0.0)
    assert shim.compute_velocity(RobotState(far, Twist2D()), plan, surroundings()) == PRIMARY
    turn = shim.compute_velocity(RobotState(near, Twist2D()), plan, surroundings())
    assert (turn.linear_x, turn.angular_z > 0.0) == (0.0, True)
    drifted = shim.compute_velocity(RobotState(far, Twist2D()), plan, surroundings())
    assert drifted.linear_x == 0.0
    # not asked for
    assert make().compute_velocity(RobotState(near, Twist2D()), plan, surroundings()) == PRIMARY


def test_rotate_to_heading_once_looks_again_only_for_another_goal() -> None:
    once = make(replace(PARAMS, rotate_to_heading_once=True))
    along, across = RobotState(Pose2D(), Twist2D()), RobotState(Pose2D(yaw=2.0), Twist2D())
    assert once.compute_velocity(along, ahead(), surroundings()) == PRIMARY
    assert once.compute_velocity(across, ahead(), surroundings()) == PRIMARY
    assert once.compute_velocity(across, ahead(2.0), surroundings()).linear_x == 0.0
    assert make().compute_velocity(across, ahead(), surroundings()).linear_x == 0.0


def test_a_turn_begins_at_rest_after_a_time_in_which_it_was_not_asked() -> None:
    shim, plan, state = make(), ahead(), RobotState(Pose2D(yaw=-2.0), Twist2D())
    rates = [shim.compute_velocity(state, plan, surroundings()).angular_z for _ in range(3)]
    shim.resume()
    assert shim.compute_velocity(state, plan, surroundings()).angular_z == rates[0]


def test_a_turn_goes_on_in_the_next_attempt_and_ends_with_the_navigation() -> None:
    shim, plan = make(), ahead()
    assert (
        shim.compute_velocity(
            RobotState(Pose2D(yaw=-2.0), Twist2D()), plan, surroundings()
        ).linear_x
        == 0.0
    )
    near = RobotState(Pose2D(yaw=-0.6), Twist2D())  # between the thresholds
    shim.reset()
    assert shim.compute_velocity(near, plan, surroundings()).linear_x == 0.0
    shim.seed(np.random.default_rng(0))
    shim.reset()
    assert shim.compute_velocity(near, plan, surroundings()) == PRIMARY


def test_rotate_to_heading_once_does_not_turn_again_in_the_next_attempt_to_the_same_goal() -> None:
    once = make(replace(PARAMS, rotate_to_heading_once=True))
    along, across = RobotState(Pose2D(), Twist2D()), RobotState(Pose2D(yaw=2.0), Twist2D())
    assert once.compute_velocity(along, ahead(), surroundings()) == PRIMARY
    once.reset()
    assert once.compute_velocity(across, ahead(), surroundings()) == PRIMARY
    once.seed(np.random.default_rng(0))
    once.reset()
    assert once.compute_velocity(across, ahead(), surroundings()).linear_x == 0.0


def test_path_orientations_may_give_the_heading() -> None:
    poses = ahead().poses.copy()
    poses[:, 2] = math.pi / 2.0
    state, plan = RobotState(Pose2D(), Twist2D()), Path(poses)
    assert make().compute_velocity(state, plan, surroundings()) == PRIMARY
    by_orientation = make(replace(PARAMS, use_path_orientations=True))
    assert by_orientation.compute_velocity(state, plan, surroundings()).angular_z > 0.0


def test_a_plan_shorter_than_the_sampling_distance_is_looked_at_its_end() -> None:
    plan = Path(np.array(((0.0, 0.0, 0.0), (0.1, 0.0, 0.0), (0.1, 0.1, 0.0))))
    assert make()._heading_error(Pose2D(0.0, 0.0, 0.2), plan) == pytest.approx(math.pi / 4.0 - 0.2)


def test_a_plan_is_looked_at_its_first_point_at_the_sampling_distance() -> None:
    plan = Path(np.array(((0.0, 0.0, 0.0), (0.5, 0.0, 0.0), (0.0, 1.0, 0.0), (-1.5, 0.0, 0.0))))
    assert make()._heading_error(Pose2D(0.0, 0.0, 0.2), plan) == pytest.approx(math.pi / 2.0 - 0.2)


@pytest.mark.parametrize(
    ("error", "last", "yaw_rate"),
    [
        (1.5, 0.0, 0.1),
        (1.5, 0.95, 1.0),
        (-1.5, 0.0, -0.1),
        (-1.5, 0.5, 0.4),
        (1.5, -0.5, -0.4),
        (0.06, 0.9, 0.6),  # as fast as it can still stop
    ],
)
def test_turns_keep_to_the_acceleration_and_can_be_stopped_in_time(
    error: float, last: float, yaw_rate: float
) -> None:
    params = replace(
        PARAMS, rotate_to_heading_angular_vel=1.0, max_angular_accel=3.0, closed_loop=False
    )
    shim = make(params, 30.0)
    shim._last_yaw_rate = last
    command = shim._safe_turn(error, RobotState(Pose2D(), Twist2D()), surroundings().costmap)
    assert command == Twist2D(angular_z=pytest.approx(yaw_rate))


def test_a_plan_of_one_pose_reset_and_resume_reach_the_primary() -> None:
    primary = Primary()
    shim = RotationShimController(PARAMS, primary, FOOTPRINT, 30.0, 0.25)
    state = RobotState(Pose2D(yaw=2.0), Twist2D())
    assert shim.compute_velocity(state, Path(np.zeros((1, 3))), surroundings()) == PRIMARY
    before = primary.resets
    shim.reset()
    shim.resume()
    assert (primary.resets, primary.resumed) == (before + 1, 1)
