"""What every planner of the name table does."""

import numpy as np
import pytest
from numpy.random import default_rng
from numpy.testing import assert_allclose, assert_array_equal

from navstack.costmap.costmap import Costmap
from navstack.errors import GoalOutsideMapError, NoPathFoundError, StartOutsideMapError
from navstack.params.extensions import algorithms
from navstack.params.planners import (
    IncrementalNavfnParams,
    NavfnParams,
    OmplParams,
    ThetaStarParams,
)
from navstack.params.smac import Smac2DParams, SmacHybridParams, SmacLatticeParams
from navstack.planning.planner import Planner
from navstack.types import Pose2D

from .given import step_lengths

PARAMS = {
    "nav2_navfn_planner::NavfnPlanner": NavfnParams(),
    "nav2_smac_planner::SmacPlanner2D": Smac2DParams(),
    "nav2_smac_planner::SmacPlannerHybrid": SmacHybridParams(),
    "nav2_smac_planner::SmacPlannerLattice": SmacLatticeParams(),
    "nav2_theta_star_planner::ThetaStarPlanner": ThetaStarParams(),
    "navstack::IncrementalNavfn": IncrementalNavfnParams(),
    "navstack::OmplPlanner": OmplParams(max_iterations=2000),
}
START = Pose2D(-1.0, 2.0, 0.3)
GOAL = Pose2D(5.0, 2.5, 1.1)


def room():
    costs = np.zeros((60, 80), dtype=np.uint8)
    costs[:50, 40] = 254
    return Costmap(costs, 0.1, -2.0, 1.0)


@pytest.fixture(params=sorted(algorithms("planners")))
def make(request):
    def planner() -> Planner:
        made = algorithms("planners")[request.param].create(
            PARAMS[request.param], parts={"robot_shape": None}
        )
        made.reset(default_rng(4))
        return made

    return planner


def test_every_name_has_parameters():
    assert set(PARAMS) == set(algorithms("planners"))


def test_path_joins_start_and_goal_through_free_cells(make):
    costmap = room()
    path = make().plan(START, GOAL, costmap, stamp=2.5)
    assert path.stamp == 2.5
    assert path.poses.dtype == np.float64
    assert path.poses.shape[1] == 3
    assert np.isfinite(path.poses).all()
    assert np.hypot(*(path.poses[0, :2] - (START.x, START.y))) <= costmap.resolution
    assert_allclose(path.poses[-1], GOAL.as_array())
    assert step_lengths(path.poses).max() < 2.0 * costmap.resolution
    assert path.poses[:, 1].max() > 5.9  # over the wall's end, not through it


def test_new_plan_is_a_new_object_and_repeatable(make):
    costmap = room()
    one = make()
    other = make()
    first = one.plan(START, GOAL, costmap)
    second = one.plan(START, GOAL, costmap)
    assert first is not second
    assert not np.shares_memory(first.poses, second.poses)
    assert_array_equal(other.plan(START, GOAL, costmap).poses, first.poses)
    assert_array_equal(other.plan(START, GOAL, costmap).poses, second.poses)


def test_reset_forgets_what_came_before(make):
    used = make()
    costmap = room()
    detour = room()
    detour.data[10:50, 20] = 254
    used.plan(START, GOAL, detour)
    used.plan(GOAL, START, costmap)
    used.reset(default_rng(4))
    assert_array_equal(
        used.plan(START, GOAL, costmap).poses, make().plan(START, GOAL, costmap).poses
    )


def test_costmap_is_only_read(make):
    costmap = room()
    before = costmap.data.copy()
    make().plan(START, GOAL, costmap)
    assert_array_equal(costmap.data, before)


def test_start_at_the_goal(make):
    path = make().plan(START, Pose2D(START.x, START.y, 1.0), room())
    assert_array_equal(path.poses, [[START.x, START.y, 1.0]])


def test_errors(make):
    costmap = room()
    planner = make()
    with pytest.raises(StartOutsideMapError):
        planner.plan(Pose2D(-50.0, 0.0), GOAL, costmap)
    with pytest.raises(GoalOutsideMapError):
        planner.plan(START, Pose2D(0.0, float("inf")), costmap)
    costmap.data[:, 40] = 254
    with pytest.raises(NoPathFoundError):
        planner.plan(START, GOAL, costmap)


def test_recovers_after_an_error(make):
    planner = make()
    closed = room()
    closed.data[:, 40] = 254
    with pytest.raises(NoPathFoundError):
        planner.plan(START, GOAL, closed)
    assert len(planner.plan(START, GOAL, room())) > 10
