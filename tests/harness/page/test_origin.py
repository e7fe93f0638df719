"""Pages of maps whose coordinates are large, such as those of UTM."""

from types import SimpleNamespace

import numpy as np
import pytest

from harness.economics.accountings import COUNTED
from harness.metrics.replay_log import _compact
from harness.report.page.deliveries import contacts, ends_of, trajectory
from harness.report.page.origin import ZERO, page_origin, shifted
from harness.report.page.scenery import draw
from harness.world.map.scene import Scene
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.types import Pose2D

ROW = {"duration_s": 30.0, "start_x_m": -5.0, "start_y_m": 2.0, "goal_x_m": 30.0, "goal_y_m": 40.0}
UTM = (500_000.0, 4_200_000.0)  # [m]


@pytest.mark.parametrize(
    ("place", "origin"),
    [
        ((-67.9, 4999.0), (0.0, 0.0)),
        ((499_998.5, 4_200_005.25), UTM),
        ((-1e8, -12_000.0), (-1e8, -10_000.0)),
    ],
)
def test_a_page_counts_from_a_round_place_near_the_map(place, origin):
    assert page_origin(*place) == origin


def test_a_recording_far_away_is_shown_as_one_near_zero(make_arrays):
    near = make_arrays(ROW)
    near["plan_xy"] = near["plan_xy"].astype(np.float64)
    far = {name: array.copy() for name, array in near.items()}
    far["trace"][:, 1:3] += UTM
    far["trace"][:, 6:8] += UTM
    far["tracks"] = far["tracks"].astype(np.float64)
    far["tracks"][:, 1:3] += UTM
    for name in ("crowd", "plan_xy", "option_xy"):
        far[name] = far[name] + np.array(UTM)
    shown = shifted(far, UTM)
    for name, array in near.items():
        np.testing.assert_allclose(shown[name], array, atol=1e-8)
    ways = [
        np.cumsum(trajectory(trace, at))
        for trace, at in ((far["trace"], UTM), (near["trace"], ZERO))
    ]
    np.testing.assert_allclose(*ways, atol=1)  # [cm]


def test_map_missions_and_contacts_share_the_origin():
    cells = np.zeros((20, 40), dtype=np.int8)
    cells[5, 7] = 100
    grids = [
        OccupancyGrid(cells, 0.5, Pose2D(x, y)) for x, y in ((1.0, 2.0), (500001.0, 4200002.0))
    ]
    near, far = (Scene("hall", (), (), grid, grid) for grid in grids)
    assert draw(far, UTM) == draw(near, ZERO)
    row = {"start_x_m": 500_001.5, "start_y_m": 4_200_002.5, "goal_x_m": None, "goal_y_m": None}
    assert ends_of(SimpleNamespace(origin=UTM), row) == [1.5, 2.5, None, None]
    contact = {"x_m": 500_003.0, "y_m": 4_200_004.0, "stamp_s": 7.0, "kind": "pedestrian"}
    event = contact | {"impulse_ns": 60.0, "cost_usd": 37.0, "type": COUNTED}
    event |= {"partner": "pedestrian", "partner_id": 1}
    ((x, y, when, *_),) = contacts([event], UTM)
    assert (x, y, when) == (3.0, 4.0, 7.0)


@pytest.mark.parametrize(("largest", "size"), [(16_000.0, 4), (4_200_005.25, 8)])
def test_a_recording_keeps_the_millimetres(largest, size):
    places = np.array(((largest, 0.001), (np.nan, -largest)))
    kept = _compact(places)
    assert kept.dtype.itemsize == size
    np.testing.assert_allclose(kept, places, atol=1e-3, equal_nan=True)
