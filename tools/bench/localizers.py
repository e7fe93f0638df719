"""The steps of AMCL, the likelihood field of a map, and the lidar that they look through."""

from collections.abc import Sequence
from functools import lru_cache, partial

import numpy as np
from scipy import ndimage

from harness.world.sensors.lidar_kernels import cast_grid, clearance_field
from navstack.costmap.distances import squared_distances
from navstack.costmap.occupancy_grid import OCCUPIED
from navstack.localization.amcl_sensor_models import SENSOR_MODELS
from navstack.localization.free_space import FreeSpace
from navstack.localization.likelihood_field import LikelihoodField, farthest_code
from navstack.localization.motion_model import motion_model_of
from navstack.localization.particle_filter import ParticleFilter
from navstack.params.amcl import AmclParams
from navstack.types import FloatArray, LaserScan, Pose2D
from tools.bench import twins
from tools.bench.component import Component, Prepared, golden, require_agreement, shipped_map

START = Pose2D(-42.8, -8.8, 1.67)  # on the sidewalk map
COVARIANCE = np.diag((0.01, 0.01, 0.001))  # of particles that have converged
MOTION = (Pose2D(), Pose2D(0.25, 0.0, 0.05))  # odometry before and after
FARTHEST = 2.0  # [m] of the likelihood field
BEAMS = 360  # of the lidar
REACH = 30.0  # [m]


def particles_of(count: int) -> ParticleFilter:
    """So many particles about a pose."""
    params = AmclParams(min_particles=count, max_particles=count)
    particles = ParticleFilter(params, FreeSpace(shipped_map("sidewalk")))
    particles.spread_normal(START, COVARIANCE, np.random.default_rng(0))
    return particles


@lru_cache(maxsize=1)
def distances_to_obstacles() -> FloatArray:
    """Of every cell of the shipped map, in [m], up to the farthest."""
    grid = shipped_map("sidewalk")
    cells: FloatArray = ndimage.distance_transform_edt(grid.data < OCCUPIED)
    return np.minimum(cells * grid.resolution, FARTHEST)


def sensor_update(count: int, beams: int) -> Prepared:
    """Choosing the beams, where they end, the likelihood of every particle, the new weights.

    A field of 4000 x 4000.
    """
    grid = shipped_map("sidewalk")
    field = LikelihoodField.of_map(grid, FARTHEST)
    params = AmclParams(max_beams=beams)
    model = SENSOR_MODELS["likelihood_field"](params, grid, field)
    particles = particles_of(count)
    ranges = golden("amcl")["n720_b360_ranges"].astype(float)[:: 720 // beams]
    scan = LaserScan(0.0, ranges, -np.pi, 2.0 * np.pi / beams, 0.0, 30.0)
    distances = distances_to_obstacles()
    plain = np.full(count, 1.0 / count)

    def ours() -> None:
        particles.weigh(*model.match(particles.poses, scan, False))

    def twin() -> None:
        nonlocal plain
        plain = plain * likelihoods()
        plain = plain / plain.sum()

    def likelihoods() -> FloatArray:
        angles = scan.angle_min + np.arange(beams) * scan.angle_increment
        returned = ranges < scan.range_max
        ends = ranges[returned, None] * twins.unit(angles)[returned]
        origin = (grid.origin.x, grid.origin.y)
        given = (params.sigma_hit, params.z_hit, params.z_rand, scan.range_max, FARTHEST)
        return twins.likelihoods(distances, origin, grid.resolution, particles.poses, ends, *given)

    name = f"AMCL sensor update, {count} x {beams}"
    ours()
    require_agreement(
        name, model.match(particles.poses, scan, False).likelihoods, likelihoods(), 1e-9
    )
    return Prepared(ours, twin)


def motion_update(count: int) -> Prepared:
    """Moving every particle, random numbers included."""
    params, poses, plain = AmclParams(), particles_of(count).poses, particles_of(count).poses
    model, rng = motion_model_of(params), np.random.default_rng(0)
    alphas = (params.alpha1, params.alpha2, params.alpha3, params.alpha4)
    draws = rng.standard_normal((count, 3))
    motion = (0.0, MOTION[1].x, MOTION[1].yaw)
    model(poses, *MOTION, draws)
    twins.move_differential(plain, motion, alphas, draws)
    require_agreement("AMCL motion update", poses, plain, 1e-12)
    return Prepared(
        lambda: model(poses, *MOTION, rng.standard_normal((count, 3))),
        lambda: twins.move_differential(plain, motion, alphas, rng.standard_normal((count, 3))),
    )


def resampling(count: int) -> Prepared:
    """A resampling, random numbers and clusters included.

    Numpy has no twin of its draw-by-draw stop.
    """
    particles, rng = particles_of(count), np.random.default_rng(0)

    def ours() -> None:
        particles.resample(rng, lambda strays, _: np.empty((strays, 3)))
        particles.clusters()

    ours()
    return Prepared(ours)


def field() -> Prepared:
    """The squared distances of the shipped map, not from the disk."""
    grid = shipped_map("sidewalk")
    occupied, farthest = grid.data >= OCCUPIED, farthest_code(FARTHEST, grid.resolution)

    def twin() -> FloatArray:
        cells: FloatArray = ndimage.distance_transform_edt(~occupied)
        return np.minimum(np.rint(cells**2), farthest + 1)

    require_agreement("likelihood field", squared_distances(occupied, farthest), twin())
    return Prepared(lambda: squared_distances(occupied, farthest), twin)


def scan() -> Prepared:
    """The rays of one scan on the shipped map, without people and noise."""
    grid = shipped_map("sidewalk")
    occupied = grid.data >= OCCUPIED
    field = clearance_field(occupied)
    x, y = (START.x - grid.origin.x) / grid.resolution, (START.y - grid.origin.y) / grid.resolution
    angles = -np.pi + np.arange(BEAMS) * (2.0 * np.pi / BEAMS) + 0.001
    directions, reach = twins.unit(angles), REACH / grid.resolution
    ranges = np.empty(BEAMS)

    def ours() -> None:
        cast_grid(field, x, y, 1.0, 0.0, directions, reach, ranges)

    ours()
    require_agreement("lidar", ranges, twins.cast(occupied, x, y, directions, reach), 1e-9)
    return Prepared(ours, lambda: twins.cast(occupied, x, y, directions, reach))


COMPONENTS: Sequence[Component] = (
    *(
        Component(
            f"AMCL sensor update, {count} x {beams}",
            partial(sensor_update, count, beams),
            recorded_ms,
            target,
        )
        for count, beams, recorded_ms, target in (
            (500, 60, 0.95, 0.1),
            (500, 360, 4.82, None),
            (2000, 60, 3.83, None),
            (2000, 360, 19.1, 0.05),
        )
    ),
    *(
        Component(f"AMCL {what}, {count}", partial(make, count), recorded_ms)
        for what, make, count, recorded_ms in (
            ("motion update", motion_update, 500, 0.086),
            ("motion update", motion_update, 2000, 0.33),
            ("resampling", resampling, 500, 0.23),
            ("resampling", resampling, 2000, 1.15),
        )
    ),
    Component("likelihood field, 4000 x 4000", field, 2510.0, 0.5),  # 2510 to 2614
    Component("lidar, 360 beams, 30 m", scan),
)
