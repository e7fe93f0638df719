"""The steps of AMCL against the recorded C++, on the recording's own map and on the shipped sidewalk map.

Usage: python benchmarks/bench_amcl.py

A sensor update comprises choosing the beams, their ends, the likelihood of every particle, and the new weights.
"""

import json
import os
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from navstack.costmap.map_io import load_map
from navstack.costmap.occupancy_grid import OCCUPIED, OccupancyGrid
from navstack.localization.amcl_sensor_models import SENSOR_MODELS
from navstack.localization.free_space import FreeSpace
from navstack.localization.likelihood_field import LikelihoodField, farthest_code, squared_distances
from navstack.localization.motion_model import motion_model_of
from navstack.localization.particle_filter import ParticleFilter
from navstack.params.amcl import AmclParams
from navstack.types import LaserScan, Pose2D

ROUNDS = 200
SIDEWALK = Path(__file__).parents[1] / "maps" / "sidewalk.yaml"
FIELD_CPP_MS = 2510.0  # recorded (2510 to 2614) on the published map of 4020 x 4020 cells, whose like the sidewalk is
COVARIANCE = np.diag((0.01, 0.01, 0.001))  # of particles that have converged


def median_ms(step: Callable[[], object], rounds: int = ROUNDS) -> float:
    """Median time of a step; the first, which may compile, does not count."""
    step()
    times = []
    for _ in range(rounds):
        began = time.perf_counter()
        step()
        times.append(time.perf_counter() - began)
    return 1e3 * float(np.median(times))


def particles_of(count: int, grid: OccupancyGrid, pose: Pose2D) -> ParticleFilter:
    """So many particles about a pose."""
    particles = ParticleFilter(AmclParams(min_particles=count, max_particles=count), FreeSpace(grid))
    particles.spread_normal(pose, COVARIANCE, np.random.default_rng(0))
    return particles


def sensor_update_ms(grid: OccupancyGrid, pose: Pose2D, ranges: np.ndarray, count: int, beams: int) -> float:
    """One sensor update with so many particles and beams."""
    params = AmclParams(max_beams=beams)
    model = SENSOR_MODELS[params.laser_model_type](params, grid, LikelihoodField.of_map(grid, 2.0))
    particles = particles_of(count, grid, pose)
    scan = LaserScan(0.0, ranges, -np.pi, 2.0 * np.pi / len(ranges), 0.0, 30.0)

    def update() -> None:
        particles.weigh(*model.match(particles.poses, scan, False))

    return median_ms(update)


def motion_update_ms(grid: OccupancyGrid, count: int) -> float:
    """One motion update with so many particles, random numbers included."""
    particles, rng = particles_of(count, grid, Pose2D()), np.random.default_rng(0)
    model = motion_model_of(AmclParams())

    def move() -> None:
        model.move(particles.poses, Pose2D(), Pose2D(0.25, 0.0, 0.05), rng.standard_normal((count, 3)))

    return median_ms(move)


def resample_ms(grid: OccupancyGrid, count: int) -> float:
    """One resampling of so many particles, random numbers and clusters included."""
    particles, rng = particles_of(count, grid, Pose2D()), np.random.default_rng(0)

    def draw() -> None:
        particles.resample(rng, lambda count, rng: np.empty((count, 3)))
        particles.clusters()

    return median_ms(draw)


def row(title: str, ours: float, recorded: float) -> None:
    """Print one comparison."""
    print(f"{title:58s} {ours:9.3f} {recorded:10.3f} {ours / recorded:8.3f}")


def main() -> None:
    """Print all comparisons."""
    golden = np.load(Path(os.environ.get("NAVSTACK_GOLDEN", "tests/golden")) / "amcl.npz")
    recorded = {name: facts["median"] for name, facts in json.loads(str(golden["meta_json"]))["timing_ms"].items()}
    small = OccupancyGrid(golden["map_occ"], 0.05, Pose2D(-2.0, -3.0))
    big = load_map(SIDEWALK)
    ranges = golden["n720_b360_ranges"].astype(float)
    print(f"{'':58s} {'ours ms':>9s} {'C++ ms':>10s} {'ratio':>8s}")
    for name, grid, pose in (("smallmap", small, Pose2D(1.0, 0.5, 0.4)), ("bigmap", big, Pose2D(-42.8, -8.8, 1.67))):
        for count in (500, 2000):
            for beams, step in ((60, 12), (360, 2)):
                ours = sensor_update_ms(grid, pose, ranges[::step], count, beams)
                title = f"sensor update, {count} particles x {beams} beams, {name}"
                row(title, ours, recorded[f"sensor_update_{count}p_{beams}beams_{name}"])
    for count in (500, 2000):
        row(f"motion update, {count} particles", motion_update_ms(small, count), recorded[f"motion_{count}p"])
        row(f"resampling with clusters, {count} particles", resample_ms(small, count), recorded[f"resample_{count}p"])
    occupied = big.data >= OCCUPIED
    farthest = farthest_code(2.0, big.resolution)
    ours = median_ms(lambda: squared_distances(occupied, farthest), 5)
    row("likelihood field, 4000 x 4000 (C++: 4020 x 4020)", ours, FIELD_CPP_MS)


if __name__ == "__main__":
    main()
