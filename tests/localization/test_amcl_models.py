"""AMCL's sensor models, motion models by name, and the particle filter, against the formulas."""

import math
from dataclasses import replace

import numpy as np
import pytest

from navstack.costmap.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from navstack.errors import MapError, ParameterError
from navstack.localization import amcl_recovery
from navstack.localization.amcl_recovery import ScanGuide
from navstack.localization.amcl_sensor_models import (
    SENSOR_MODELS,
    BeamModel,
    LikelihoodFieldProbModel,
)
from navstack.localization.free_space import FreeSpace
from navstack.localization.likelihood_field import LikelihoodField, farthest_code
from navstack.localization.motion_model import motion_model_of, move_differential, move_omni
from navstack.localization.particle_filter import (
    LEAST_FALL,
    ParticleFilter,
    cluster_particles,
    stand_close,
)
from navstack.params.amcl import LASER_MODELS, AmclParams
from navstack.types import LaserScan, Pose2D

WALL = 8.0  # [m] x of the wall's cells, as AMCL takes them
MOUNT = Pose2D(0.2, 0.0, 0.0)


@pytest.fixture
def grid():
    """Free ground with a wall at x = WALL, a corner of it unknown."""
    cells = np.full((100, 200), FREE, dtype=np.int8)
    cells[:, 160] = OCCUPIED
    cells[90:, :10] = UNKNOWN
    return OccupancyGrid(cells, 0.05, Pose2D())


def scan(ranges, increment=0.01, range_max=30.0):
    ranges = np.array(ranges, dtype=float)
    return LaserScan(
        0.0,
        ranges,
        -0.5 * increment * (len(ranges) - 1),
        increment,
        0.1,
        range_max,
        MOUNT,
    )


def model_of(name, grid, **params):
    given = AmclParams(laser_model_type=name, **params)
    return SENSOR_MODELS[name](
        given, grid, LikelihoodField.of_map(grid, given.laser_likelihood_max_dist)
    )


def test_every_model_that_parameters_may_name_exists(grid):
    assert set(SENSOR_MODELS) == set(LASER_MODELS)
    at_wall, off = np.array([[4.0, 2.5, 0.0]]), np.array([[3.0, 2.5, 0.0]])
    for name in SENSOR_MODELS:
        model = model_of(name, grid)
        likelihoods = model.likelihoods(
            np.concatenate((at_wall, off)), scan([WALL - 4.0 - MOUNT.x] * 5), False
        )
        assert likelihoods.shape == (2,)
        assert likelihoods[0] > likelihoods[1]


def test_beams_that_count(grid):
    ranges = [0.05, 3.0, np.nan, np.inf, 29.0, 12.0, 5.0]
    beams = model_of("likelihood_field", grid, max_beams=7, laser_max_range=20.0).beams(
        scan(ranges)
    )
    assert beams.range_max == 20.0
    # the first is too near
    np.testing.assert_array_equal(beams.ranges, [20.0, 3.0, np.inf, 29.0, 12.0, 5.0])
    np.testing.assert_allclose(beams.bearings, np.array((-3, -2, 0, 1, 2, 3)) * 0.01)
    returned = beams.ends()
    assert len(returned) == 3
    np.testing.assert_allclose(returned[0], (0.2 + 3.0 * math.cos(0.02), -3.0 * math.sin(0.02)))


def test_beams_are_thinned_as_nav2_does(grid):
    many = scan(np.arange(720) + 1.0)
    for name, step in (("likelihood_field", 2), ("beam", 2), ("likelihood_field_prob", 2)):
        beams = model_of(name, grid, max_beams=360).beams(many)
        np.testing.assert_array_equal(beams.ranges[:3], 1.0 + step * np.arange(3))
    # 719 // 99 = 7
    assert len(model_of("likelihood_field", grid, max_beams=100).beams(many).ranges) == 103
    # ceil(720 / 100) = 8
    assert len(model_of("likelihood_field_prob", grid, max_beams=100).beams(many).ranges) == 90


def pz(distance, range_max=30.0):
    return 0.5 * math.exp(-(distance**2) / (2.0 * 0.2**2)) + 0.5 / range_max


def test_a_field_sums_cubes_and_its_sibling_multiplies(grid):
    ahead = scan([3.8, 3.5, np.inf], increment=1e-9)
    pose = np.array([[4.0, 2.5, 0.0]])
    expected = pz(0.0), pz(0.3)
    found = model_of("likelihood_field", grid).likelihoods(pose, ahead, False)
    np.testing.assert_allclose(found, 1.0 + sum(p**3 for p in expected))
    found = model_of("likelihood_field_prob", grid).likelihoods(pose, ahead, False)
    np.testing.assert_allclose(found, math.prod(expected))


def test_beams_off_the_map_that_most_particles_see_are_skipped(grid):
    wall, somebody = WALL - 4.0 - MOUNT.x, 1.5
    poses = np.column_stack((np.linspace(3.9, 4.1, 21), np.full(21, 2.5), np.zeros(21)))
    seen = scan([wall, somebody, wall, wall], increment=1e-9)
    given = AmclParams(do_beamskip=True, max_beams=4)
    model = LikelihoodFieldProbModel(given, LikelihoodField.of_map(grid, 2.0))
    without = LikelihoodFieldProbModel(
        replace(given, do_beamskip=False), LikelihoodField.of_map(grid, 2.0)
    )
    plain = without.likelihoods(poses, scan([wall] * 3, increment=1e-9), False)
    np.testing.assert_allclose(model.likelihoods(poses, seen, True), plain)
    # not before it has converged
    np.testing.assert_allclose(model.likelihoods(poses, seen, False), plain * pz(2.0))
    ignoring, all_four = model.match(poses, seen, True), model.match(poses, seen, False)
    # what is ignored does not count for the best either
    assert ignoring.best == pytest.approx(pz(0.0) ** 3)
    assert all_four.best == pytest.approx(pz(0.0) ** 4)
    assert ignoring.likelihoods.max() <= ignoring.best
    lost = scan([somebody] * 4, increment=1e-9)
    # too many to skip
    np.testing.assert_allclose(model.likelihoods(poses, lost, True), np.full(21, pz(2.0) ** 4))


@pytest.mark.parametrize(
    ("distance", "end", "counts"),
    [
        (0.5, 3.5, False),
        (0.500001, 3.5, True),
        (2.0, 1.0, False),
        (2.1, 1.0, True),
        (2.1, 8.0, False),
    ],
)
def test_beams_agree_with_the_map_nearer_than_a_distance(distance, end, counts):
    """One of three beams ends in the cell before the wall, farther before it, or off the map.

    Off the map, none agrees.
    """
    cells = np.full((9, 20), FREE, dtype=np.int8)
    cells[:, 16] = OCCUPIED
    given = AmclParams(do_beamskip=True, max_beams=3, beam_skip_distance=distance)
    model = LikelihoodFieldProbModel(
        given, LikelihoodField.of_map(OccupancyGrid(cells, 0.5, Pose2D()), 2.0)
    )
    ahead = scan([4.0 - MOUNT.x, 4.0 - MOUNT.x, end - MOUNT.x], increment=1e-9)
    expected = pz(0.0) ** 2 * (pz(min(4.0 - end, 2.0)) if counts else 1.0)
    np.testing.assert_allclose(
        model.likelihoods(np.array([[4.0, 2.0, 0.0]]), ahead, True), expected
    )


def test_the_candidates_that_fit_best_are_followed_up(grid, monkeypatch):
    guide = ScanGuide(
        FreeSpace(grid), LikelihoodField.of_map(grid, 2.0), model_of("likelihood_field", grid), 400
    )
    monkeypatch.setattr(amcl_recovery, "STEPS", ())
    poses = np.column_stack((np.linspace(0.5, 7.5, 400), np.full((400, 2), (2.5, 0.0))))
    ahead = scan([WALL - 4.0 - MOUNT.x] * 5)
    best = guide.pick(poses, 250, ahead, np.random.default_rng(0))
    expected = np.sort(guide._coarse_fit(poses, ahead))[-100:]
    np.testing.assert_array_equal(np.sort(guide._coarse_fit(best[:100].copy(), ahead)), expected)
    assert len({*best[:100, 0]}) == 100
    np.testing.assert_array_equal(best[100:], np.tile(best[:100], (2, 1))[:150])


def test_the_beam_model_compares_with_the_range_on_the_map(grid):
    given = AmclParams(laser_model_type="beam", z_short=0.3, z_max=0.1)
    model = BeamModel(given, grid)
    pose = np.array([[4.0, 2.5, 0.0]])
    truth = WALL - 4.0 - MOUNT.x
    cases = {
        truth + 1e-9: 0.5 + 0.5 / 30.0,
        truth - 0.5: 0.5 * math.exp(-(0.5**2) / 0.08)
        + 0.3 * 0.1 * math.exp(-0.1 * (truth - 0.5))
        + 0.5 / 30.0,
        truth + 0.4: 0.5 * math.exp(-(0.4**2) / 0.08) + 0.5 / 30.0,
        math.inf: 0.5 * math.exp(-((30.0 - truth) ** 2) / 0.08) + 0.1,
    }
    for measured, likelihood in cases.items():
        found = model.likelihoods(pose, scan([measured, measured], increment=1e-9), False)
        np.testing.assert_allclose(found, 1.0 + 2.0 * likelihood**3, rtol=1e-6)
    off_map = model.likelihoods(np.array([[40.0, 2.5, 0.0]]), scan([1.0, 1.0]), False)
    assert off_map < 1.01


def test_the_beam_model_sees_to_its_range_on_open_ground_of_any_size():
    open_ground = OccupancyGrid(np.full((760, 760), FREE, dtype=np.int8), 0.05, Pose2D())
    model = BeamModel(AmclParams(laser_model_type="beam", laser_max_range=5.0), open_ground)
    poses = np.column_stack((np.arange(6.0, 19.0, 0.05), np.full(260, 19.0), np.zeros(260)))
    found = model.likelihoods(poses, scan([np.inf, np.inf]), False)
    np.testing.assert_allclose(found, 1.0 + 2.0 * (0.5 + 0.05) ** 3)


def test_rotated_maps_are_refused(grid):
    rotated = replace(grid, origin=Pose2D(0.0, 0.0, 0.3))
    with pytest.raises(MapError, match="rotated"):
        LikelihoodField.of_map(rotated, 2.0)
    with pytest.raises(MapError, match="rotated"):
        BeamModel(AmclParams(), rotated)


@pytest.mark.parametrize(
    ("name", "kernel"),
    [
        ("nav2_amcl::DifferentialMotionModel", move_differential),
        ("differential", move_differential),
        ("nav2_amcl::OmniMotionModel", move_omni),
        ("omnidirectional", move_omni),
    ],
)
def test_motion_models_by_name(name, kernel):
    params = AmclParams(
        robot_model_type=name,
        alpha1=0.1,
        alpha2=0.2,
        alpha3=0.3,
        alpha4=0.4,
        alpha5=0.5,
    )
    draws = np.random.default_rng(1).standard_normal((4, 3))
    poses = np.tile((1.0, 2.0, math.pi / 2), (4, 1))
    expected = poses.copy()
    kernel(expected, 0.1, 1.0, -0.3, 0.2, (0.1, 0.2, 0.3, 0.4, 0.5), draws)
    motion_model_of(params)(poses, Pose2D(5.0, 5.0, 0.1), Pose2D(6.0, 4.7, 0.2), draws)
    np.testing.assert_allclose(poses, expected, atol=1e-12)


def test_ranges_may_be_infinite_and_steps_negative():
    """As Nav2 reads them: the scan's own range, and every scan counts."""
    given = {"laser_max_range": math.inf, "laser_min_range": -math.inf, "update_min_d": -1.0}
    params = AmclParams(**given)
    assert (params.laser_max_range, params.laser_min_range) == (math.inf, -math.inf)
    assert params.update_min_d == -1.0


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"max_beams": 1}, "max_beams 1 must be 2 or more"),
        ({"sigma_hit": 0.0}, "sigma_hit 0.0 must be 0.0001 to 1000"),
        ({"alpha3": -0.1}, r"alpha3 -0\.1 must be 0 to 1e\+06"),
        (
            {"laser_model_type": "laser"},
            "must be one of beam, likelihood_field, likelihood_field_prob",
        ),
        ({"robot_model_type": "diff"}, "nav2_amcl::OmniMotionModel, differential"),
        ({"laser_likelihood_max_dist": 1e9}, "max_dist 1000000000.0 must be more than 0 to 1000"),
        ({"laser_likelihood_max_dist": math.inf}, "max_dist inf must be a finite number"),
        ({"max_particles": 10**9}, "max_particles 1000000000 must be 0 to 1e.06"),
        ({"min_particles": 10**12}, "min_particles 1000000000000 must be 0 to 1e.06"),
        ({"min_particles": 0, "max_particles": 0}, "max_particles 0 must be 1 or more without"),
        ({"recovery_candidates": 10**12}, "recovery_candidates 1000000000000 must be 0 to 1e.06"),
        ({"sigma_hit": 1e-300}, "sigma_hit 1e-300 must be 0.0001 to 1000"),
        ({"z_rand": 1e300}, r"z_rand 1e\+300 must be 0 to 100"),
        ({"alpha1": math.inf}, "alpha1 inf must be a finite number"),
        ({"laser_max_range": 1e-300}, r"laser_max_range 1e-300 must be 0 or less \(the scan's own"),
    ],
)
def test_parameters_out_of_range_are_refused(given, message):
    with pytest.raises(ParameterError, match=message):
        AmclParams(**given)


@pytest.mark.parametrize(
    ("name", "given", "taken"),
    [
        ("resample_interval", 0, 1),
        ("resample_interval", -2, 1),
        ("resample_interval", 3, 3),
        ("min_particles", -1, 500),
        ("min_particles", 0, 0),
        ("max_particles", -5, 2000),
        ("laser_likelihood_max_dist", -1.0, 2.0),
        ("laser_likelihood_max_dist", 0.3, 0.3),
    ],
)
def test_what_nav2_replaces_after_a_warning_is_replaced(name, given, taken):
    assert getattr(AmclParams(**{name: given}), name) == taken


@pytest.mark.parametrize(("resolution", "farthest"), [(0.05, 200.0), (0.0001, 0.4), (0.25, 1000.0)])
def test_a_field_has_so_many_distances_and_no_more(resolution: float, farthest: float) -> None:
    assert farthest_code(farthest, resolution) == 4000**2
    cells = OccupancyGrid(np.zeros((4, 4), dtype=np.int8), resolution, Pose2D())
    for more in (1.01 * farthest, 1e9, 1e300, math.inf, math.nan):
        with pytest.raises(ParameterError, match="0 to 4000 cells can be told apart") as told:
            LikelihoodField.of_map(cells, more)
        assert "\n" not in str(told.value)


def filter_of(grid, **params):
    return ParticleFilter(AmclParams(**params), FreeSpace(grid))


def test_particles_spread_as_told(grid):
    particles = filter_of(grid, max_particles=20_000)
    covariance = np.array(((0.3, 0.1, 0.02), (0.1, 0.2, 0.0), (0.02, 0.0, 0.05)))
    particles.spread_normal(Pose2D(3.0, -2.0, 1.0), covariance, np.random.default_rng(0))
    np.testing.assert_allclose(particles.poses.mean(axis=0), (3.0, -2.0, 1.0), atol=0.02)
    np.testing.assert_allclose(np.cov(particles.poses.T), covariance, atol=0.01)
    overall = particles.overall()
    np.testing.assert_allclose(overall.covariance[:2, :2], covariance[:2, :2], atol=0.01)
    assert overall.covariance[2, 2] == pytest.approx(0.05, abs=0.003)
    assert not stand_close(particles.poses)
    assert filter_of(grid, min_particles=3000)._params.most_particles == 3000


def strays_at(place):
    return lambda count, rng: np.tile(place, (count, 1))


def test_weights_multiply_until_particles_are_drawn_anew(grid):
    particles = filter_of(grid, min_particles=10, max_particles=4000)
    rng = np.random.default_rng(0)
    particles.poses = np.array(((0.0, 0.0, 0.0), (5.0, 0.0, 0.0)))
    particles.weights = np.array((0.5, 0.5))
    for _ in range(2):
        particles.weigh(np.array((1.0, 3.0)), 3.0)
    np.testing.assert_allclose(particles.weights, (0.1, 0.9))
    particles.resample(rng, strays_at((9.0, 9.0, 0.0)))
    # no stray without recovery
    assert set(map(tuple, particles.poses)) == {(0.0, 0.0, 0.0), (5.0, 0.0, 0.0)}
    assert np.ptp(particles.weights) == 0.0
    particles.weigh(np.zeros(len(particles.poses)), 3.0)
    np.testing.assert_allclose(particles.weights.sum(), 1.0)  # nothing fits: all alike
    assert particles.multiply(np.zeros(len(particles.poses))) == 0.0
    assert particles.multiply(np.full(len(particles.poses), 3.0)) == pytest.approx(3.0)


def test_strays_are_asked_for_only_where_there_are_some(grid):
    particles = filter_of(grid, min_particles=2000, max_particles=2000)
    rng, asked = np.random.default_rng(0), []

    def draw(count, rng):
        asked.append(count)
        return np.full((count, 3), 9.0)

    for share, some in ((0.0, False), (1e-9, False), (0.1, True)):
        particles.resample(rng, draw, share)
        assert bool(asked) == some
    assert (particles.poses[:, 0] == 9.0).sum() == asked[0]
    assert asked[0] / 2000 == pytest.approx(0.1, abs=0.03)


RECOVERY = {"recovery_alpha_slow": 0.001, "recovery_alpha_fast": 0.1}


def test_a_fall_of_the_weights_brings_strays_once(grid):
    particles = filter_of(grid, min_particles=4000, max_particles=4000, **RECOVERY)
    rng = np.random.default_rng(0)
    particles.spread_normal(Pose2D(), np.eye(3) * 1e-4, rng)
    for likelihood in (30.0, 30.0, 10.0):
        particles.weigh(np.full(4000, likelihood), 45.0)
    slow, fast = 30.0 - 0.001 * 20.0, 30.0 - 0.1 * 20.0
    assert particles.share_of_strays == pytest.approx(1.0 - fast / slow)
    particles.resample(rng, strays_at((9.0, 9.0, 0.0)))
    share = (particles.poses[:, 0] == 9.0).mean()
    assert share == pytest.approx(1.0 - fast / slow, abs=0.02)
    assert not particles.has_converged
    particles.weigh(np.full(4000, 10.0), 45.0)
    assert particles.share_of_strays == 0.0  # the averages have started over


def test_strays_that_the_scan_picks_come_as_long_as_it_fits_badly(grid):
    particles = filter_of(
        grid,
        min_particles=4,
        max_particles=4,
        recovery_candidates=10,
        **RECOVERY,
    )
    rng = np.random.default_rng(0)
    particles.spread_normal(Pose2D(), np.eye(3) * 1e-4, rng)
    for likelihood in (10.0, 30.0, 20.0):
        particles.weigh(np.full(4, likelihood), 40.0)
    assert particles.share_of_strays == 0.0  # both averages are plain means so far
    for _ in range(20):
        particles.weigh(np.full(4, 4.0), 40.0)
    fits = np.array([10.0, 30.0, 20.0] + 20 * [4.0]) / 40.0
    fast = fits[:10].mean() * 0.9**13 + fits[10] * (1.0 - 0.9**13)
    before = particles.share_of_strays
    assert before == pytest.approx(1.0 - fast / fits.mean())
    particles.resample(rng, strays_at((9.0, 9.0, 0.0)))
    assert particles.share_of_strays == before > 0.1
    for _ in range(200):
        particles.weigh(np.array((1.0, 1.0, 1.0, 40.0)), 40.0)
    assert particles.share_of_strays == 0.0  # one that fits is enough
    for _ in range(100):
        particles.weigh(np.full(4, 35.0), 40.0)
    slow, fast = particles._averages._averages
    assert 0.0 < 1.0 - fast / slow < LEAST_FALL
    assert particles.share_of_strays == 0.0  # a fall as small as chance


def test_clusters_have_weights_means_and_spreads():
    poses = np.array(
        ((0.1, 0.1, 3.1), (0.3, 0.3, 3.1), (9.0, 0.0, 0.0), (9.2, 0.0, 0.0), (9.2, 0.0, 0.1))
    )
    weights = np.array((0.1, 0.1, 0.2, 0.4, 0.2))
    first, second = cluster_particles(poses, weights)
    assert (first.weight, second.weight) == pytest.approx((0.2, 0.8))
    assert (first.pose.x, first.pose.y, first.pose.yaw) == pytest.approx((0.2, 0.2, 3.1))
    assert second.pose.x == pytest.approx(9.15)
    np.testing.assert_allclose(first.covariance[:2, :2], np.full((2, 2), 0.01))
    # Nav2's: the resultant of a light cluster
    assert first.covariance[2, 2] == pytest.approx(-2.0 * math.log(0.2))
