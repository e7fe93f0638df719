import math

import numpy as np
import pytest

from harness.world.map.scene import Obstacle
from harness.world.map.shapes import box, fill_convex
from harness.world.physics.body_state import BodyState
from harness.world.sensors.glass import _distinct, _edges, _incidence, see_through
from harness.world.sensors.lidar import Lidar, LidarParams, SelfFilter
from harness.world.sensors.lidar_kernels import clearance_field
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.types import Pose2D

NOBODY = np.empty((0, 4))
SCANS = 400
FRONT = box(6.0, 0.0, 0.0, 2.0, 16.0)  # its face is x = 5 m
BACK = box(9.0, 0.0, 0.0, 1.0, 18.0)  # its face is x = 8.5 m


def make_lidar(glass=(FRONT,), solid=(BACK,), seed=0, **changes):
    grid = OccupancyGrid(np.zeros((400, 400), dtype=np.int8), 0.05, Pose2D(-10.0, -10.0))
    for polygon in (*glass, *solid):
        mask = np.zeros(grid.data.shape, dtype=bool)
        fill_convex(mask, polygon, True, 0.05, -10.0, -10.0)
        grid.data[mask] = 100
    obstacles = [Obstacle("building_glass", polygon, 9.0) for polygon in glass]
    obstacles += [Obstacle("fence", polygon, 2.0) for polygon in solid]
    values = {
        "rate": 10.0,
        "beams": 360,
        "field_of_view": 2.0 * math.pi,
        "range_min": 0.05,
        "range_max": 30.0,
        "noise_std": 0.0,
        "mount": Pose2D(),
        "self_filter": SelfFilter(9.0, 9.0, 9.0, 9.0),
    }
    lidar = Lidar(LidarParams(**(values | changes)), grid, 0.3, obstacles)
    lidar.reset(BodyState(), np.random.default_rng(seed))
    return lidar


def scans(lidar, body=None, people=NOBODY, n=SCANS):
    return np.array([lidar.measure(body or BodyState(), people, 0.1 * k).ranges for k in range(n)])


def angles():
    return -math.pi + np.arange(360) * 2.0 * math.pi / 360


def assert_share(hits, trials, expected):
    """A binomial count within four standard errors."""
    assert abs(hits / trials - expected) < 4.0 * math.sqrt(expected * (1.0 - expected) / trials), (
        hits / trials
    )


@pytest.mark.parametrize("transmission", [0.4, 0.9])
def test_oblique_beams_pass_with_the_stated_probability_and_square_ones_never(transmission):
    lidar = make_lidar(glass_transmission=transmission, glass_visible_angle=0.2)
    found, exact = scans(lidar), lidar.exact_ranges(Pose2D(), NOBODY)
    on_face = np.abs(np.tan(angles())) * 8.5 < 8.5  # the beam meets the back, too
    on_face &= np.cos(angles()) > 0.0
    square = on_face & (np.abs(angles()) < 0.199)
    oblique = on_face & (np.abs(angles()) > 0.201)
    assert (found[:, square] == exact[square]).all()
    behind = 8.5 / np.cos(angles())
    passed = np.isclose(found, behind, atol=1e-6)
    assert (np.isclose(found, exact) | passed)[:, oblique].all()
    assert_share(passed[:, oblique].sum(), passed[:, oblique].size, transmission)
    per_beam = passed[:, oblique].mean(axis=0)
    assert per_beam.min() > 0.0
    assert per_beam.max() < 1.0


def test_the_incidence_counts_from_the_pane_that_stands_askew():
    askew = box(6.0, 0.0, math.radians(30.0), 2.0, 14.0)  # its face looks back along 210 degrees
    lidar = make_lidar(glass=(askew,), glass_transmission=1.0, glass_visible_angle=0.1)
    exact, found = lidar.exact_ranges(Pose2D(), NOBODY), scans(lidar, n=1)[0]
    off = np.abs(angles() - math.radians(30.0))
    assert (found[off < 0.099] == exact[off < 0.099]).all()
    around = (off > 0.101) & (off < 0.4)
    assert (found[around] > exact[around] + 1.0).all()


def test_without_anything_behind_a_passing_beam_returns_nothing():
    lidar = make_lidar(solid=(), glass_transmission=1.0, glass_visible_angle=0.05)
    found = scans(lidar, n=1)[0]
    assert np.isfinite(found[180])
    assert np.isinf(found[150])
    assert np.isfinite(lidar.exact_ranges(Pose2D(), NOBODY)[150])  # the map still shows the pane


@pytest.mark.parametrize("side", [0.0, 0.5, 1.0, 1.5])
def test_a_pane_at_the_maps_edge_lets_beams_through_too(side):
    cos, sin = math.cos(side * math.pi), math.sin(side * math.pi)
    # within the outermost row or column
    pane = box(9.975 * cos, 9.975 * sin, side * math.pi, 0.03, 16.0)
    lidar = make_lidar(glass=(pane,), solid=(), glass_transmission=1.0, glass_visible_angle=0.2)
    off = np.abs((angles() - side * math.pi + math.pi) % (2.0 * math.pi) - math.pi)
    exact, found = lidar.exact_ranges(Pose2D(), NOBODY), scans(lidar, n=1)[0]
    assert np.isfinite(exact[off < 0.6]).all() and np.isfinite(found[off < 0.199]).all()
    assert np.isinf(found[(off > 0.201) & (off < 0.6)]).all()


def test_what_stands_before_the_glass_is_always_seen_and_so_are_people_behind_it():
    post = box(3.0, -1.5, 0.0, 0.2, 0.2)
    lidar = make_lidar(solid=(BACK, post), glass_transmission=1.0, glass_visible_angle=0.05)
    toward_post = int(round((math.atan2(-1.5, 3.0) + math.pi) / (2.0 * math.pi / 360)))
    somebody = np.array([[8.0, 4.0, 0.0, 0.0]])
    toward_person = int(round((math.atan2(4.0, 8.0) + math.pi) / (2.0 * math.pi / 360)))
    found = scans(lidar, people=somebody, n=1)[0]
    assert found[toward_post] == pytest.approx(math.hypot(1.5, 3.0), abs=0.2)
    assert found[toward_person] == pytest.approx(math.hypot(8.0, 4.0) - 0.3, abs=0.05)


def test_beams_that_meet_nothing_or_pass_no_glass_stay_as_they_are():
    """Not compiled, where the cell of an infinite range is an error."""
    numbers, behind = (
        np.ones((4, 40), dtype=np.int64),
        clearance_field(np.zeros((4, 40), dtype=np.bool_)),
    )
    pane, edges = np.array((0, 2)), np.array(((-1.0, 0.0, 0.0), (1.0, 0.0, 40.0)))
    ranges, limits = np.array((math.inf, 1.0)), np.array((0.5, -1.0))
    sensor, directions = (0.0, 0.1, 1.0, 0.0), np.tile((1.0, 0.0), (2, 1))
    see_through.py_func(numbers, pane, edges, behind, sensor, directions, ranges, limits, 9.0, 0.05)
    assert ranges.tolist() == [math.inf, 1.0]


@pytest.mark.parametrize(
    ("place", "edges", "cosine"),
    [
        ((1.01, 1.0), (0, 4), 0.6),  # just inside the left one
        ((2.0, 0.01), (0, 4), 0.8),
        ((4.99, 1.0), (0, 4), -0.6),
        ((2.0, 2.01), (0, 4), -0.8),
        ((1.5, 0.5), (0, 4), 0.8),  # of two as near the first
        ((4.5, 1.5), (0, 4), -0.6),
        ((2.0, 0.01), (1, 3), -0.8),  # among some of them
        ((2.0, 0.01), (3, 4), 0.6),
    ],
)
def test_a_beam_meets_the_edge_whose_line_is_nearest(place, edges, cosine):
    """Of a pane from (1, 0) to (5, 2), one of whose corners is there twice.

    The beam goes along (0.6, 0.8).
    """
    corners = np.array(((1.0, 0.0), (5.0, 0.0), (5.0, 0.0), (5.0, 2.0), (1.0, 2.0)))
    lines = _edges(_distinct(corners))
    assert lines.tolist() == [[0.0, -1.0, 0.0], [1.0, 0.0, 5.0], [0.0, 1.0, 2.0], [-1.0, 0.0, -1.0]]
    assert _incidence.py_func(*place, 0.6, 0.8, *edges, lines) == cosine


def test_glass_is_solid_for_a_lidar_that_does_not_see_through():
    exact = make_lidar().exact_ranges(Pose2D(), NOBODY)
    assert (scans(make_lidar(), n=3) == exact).all()


def test_beams_are_lost_with_the_stated_probability_and_the_noise_of_the_others_stays():
    whole = scans(make_lidar(noise_std=0.02))
    lidar = make_lidar(noise_std=0.02, dropout=0.03)
    found = scans(lidar)
    seen = np.isfinite(whole)
    lost = seen & np.isinf(found)
    assert_share(lost.sum(), seen.sum(), 0.03)
    assert np.array_equal(found[seen & ~lost], whole[seen & ~lost])
    assert np.isinf(found[~seen]).all()
    passing = scans(make_lidar(noise_std=0.02, glass_transmission=0.5, glass_visible_angle=0.1))
    same = np.isfinite(passing) & np.isfinite(whole) & np.isclose(passing, whole, atol=1.0)
    assert np.array_equal(passing[same], whole[same])
