"""The parts of MPPI's kernels, each by its numbers."""

import math
from dataclasses import replace

import numpy as np
import pytest
from pytest import approx

from navstack.control.mppi.body import _cover, _least_distances
from navstack.control.mppi.obstacle_kernels import _add_costs
from navstack.control.mppi.path_critics import MppiPathAngleCritic
from navstack.control.mppi.path_kernels import free_points
from navstack.control.mppi.rollouts import _SMALL_TURN, _small_cosine_sine
from navstack.costmap.costmap import Costmap
from navstack.params.mppi import MppiParams
from navstack.params.mppi_critics import AS_THE_PATH, EITHER, FORWARD, PathAngleParams

from ..given import LAYER

FLOAT = np.float32


@pytest.mark.parametrize("turned", [False, True])
def test_eight_circles_cover_a_body(turned):
    """Of 1.6 m by 0.4 m: parts of 0.4 m by 0.2 m, four along the longer side."""
    box = np.array(((1.0, 0.3), (1.0, -0.1), (-0.6, -0.1), (-0.6, 0.3)))
    centres, radius = _cover(box[:, ::-1] if turned else box)
    expected = [(x, y) for x in (-0.4, 0.0, 0.4, 0.8) for y in (0.0, 0.2)]
    assert (
        sorted(map(tuple, (centres[:, ::-1] if turned else centres).round(9).tolist())) == expected
    )
    assert radius == approx(0.5 * math.hypot(0.4, 0.2))


@pytest.mark.parametrize("scaling", [3.0, 0.0])
def test_costs_tell_how_far_obstacles_are_at_least(scaling):
    """The distance at which the next higher cost begins.

    Without a slope all costs are those of the inner circle.
    """
    found = _least_distances(replace(LAYER, cost_scaling_factor=scaling), 0.19)
    falling = [min(1.5, 0.19 - math.log((cost + 1) / 252.0) / 3.0) for cost in range(252)]
    expected = (
        [*falling, max(0.0, 0.19 - math.log(253.0 / 252.0) / 3.0)]
        if scaling
        else [1.5] + [0.19] * 252
    )
    np.testing.assert_allclose(found, [*expected, 0.0, 0.0, 0.0], atol=1e-12)


def test_costs_near_a_collision_are_critical():
    scores = np.full(4, 2.0, dtype=FLOAT)
    _add_costs.py_func(
        np.array((0, 100, 253, 254), dtype=np.uint8), FLOAT(253.0), FLOAT(300.0), FLOAT(0.5), scores
    )
    assert scores.tolist() == [2.0, 52.0, 302.0, 302.0]


@pytest.mark.parametrize("share", [-1.0, -0.4, 0.0, 0.7, 1.0])
def test_small_turns_have_the_sine_and_cosine_of_single_precision(share):
    angle = FLOAT(share * _SMALL_TURN)
    found = _small_cosine_sine.py_func(angle)
    assert found == approx((math.cos(angle), math.sin(angle)), abs=1.2e-7)


@pytest.mark.parametrize(
    ("least", "mode", "expected"),
    [
        (-0.3, EITHER, EITHER),
        (-1e-6, EITHER, EITHER),
        (-9e-7, EITHER, FORWARD),  # as good as no reversing
        (0.0, EITHER, FORWARD),
        (0.2, EITHER, FORWARD),
        (0.0, AS_THE_PATH, AS_THE_PATH),
        (-0.3, FORWARD, FORWARD),
    ],
)
def test_only_who_reverses_may_look_away(least, mode, expected):
    params = MppiParams(
        critics=("PathAngleCritic",),
        vx_min=least,
        PathAngleCritic=PathAngleParams(mode=mode),
    )
    assert MppiPathAngleCritic("PathAngleCritic", params)._mode == expected


@pytest.mark.parametrize("count", [0, 1, 2, 400])
@pytest.mark.parametrize("tracks_unknown", [False, True])
def test_all_points_but_the_last_are_free_where_a_robots_centre_may_be(tracks_unknown, count):
    rng = np.random.default_rng(count)
    costmap = Costmap(
        rng.choice(np.array((0, 252, 253, 254, 255), dtype=np.uint8), (20, 30)), 0.25, -1.0, 0.5
    )
    x, y = rng.uniform((-2.0, -0.5), (7.5, 6.5), (count, 2)).astype(FLOAT).T.copy()
    allowed = (0, 252, 255) if tracks_unknown else (0, 252)
    expected = []
    for place in zip(x[:-1].tolist(), y[:-1].tolist(), strict=True):
        mx, my = costmap.world_to_map(*place)
        expected.append(costmap.contains(mx, my) and int(costmap.data[my, mx]) in allowed)
    assert free_points(x, y, costmap.data, costmap.grid, tracks_unknown).tolist() == expected
    assert count < 3 or 50 < sum(expected) < 350


@pytest.mark.parametrize(
    ("mode", "bearing", "path_yaw", "error"),
    [
        (FORWARD, 2.5, 0.0, 2.0),
        (EITHER, 2.5, 0.0, math.pi - 2.0),
        (EITHER, 1.0, 0.0, 0.5),
        (AS_THE_PATH, 2.5, 0.9, math.pi - 2.0),  # the path leads back
        (AS_THE_PATH, 2.5, 1.0, 2.0),
        (AS_THE_PATH, 1.0, 0.0, 0.5),
    ],
)
def test_how_far_the_robot_looks_away_depends_on_the_mode(mode, bearing, path_yaw, error):
    params = MppiParams(
        critics=("PathAngleCritic",),
        vx_min=-0.3,
        PathAngleCritic=PathAngleParams(mode=mode),
    )
    assert MppiPathAngleCritic("PathAngleCritic", params)._error_now(
        0.5, bearing, path_yaw
    ) == approx(error)
