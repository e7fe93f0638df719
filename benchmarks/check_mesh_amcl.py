"""How far does AMCL with the published parameters get on a drawn map, and is it the drawing or the world that decides?

Usage: python benchmarks/check_mesh_amcl.py [--count N] [--seed S] [--map NAME] [--stack NAME] [--sensors FILE]

The stack drives ``count`` deliveries with the position given (default: paper-gps). AMCL then listens to each of them:
exact odometry, scans cast anew from the same poses, and a map that differs from case to case. Nothing that it believes
acts on the robot, so every case sees the same drives.

Two things vary. What the scan sees: the solid things of the world, or walls along every edge of the navigation mesh,
which is the most that any world with this mesh could show. What the map says: everything beyond an edge is occupied
(filled, as the published map), or only a line of two cells along the edge (outlined, like a map that was recorded).

A delivery counts as lost where the believed position is more than 2 m wrong. ``metres per loss`` is all that was driven
until then, or to the end, over the number of the lost.
"""

import argparse
import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from check_amcl import drive
from scipy import ndimage

from harness.episode.factory import Parts, scene_of
from harness.statistics import wilson_interval
from harness.task.study import EpisodeTask, make_study
from harness.world.body_state import BodyState
from harness.world.lidar import Lidar, LidarParams
from harness.world.sensors import SensorParams
from navstack.costmap.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from navstack.localization.amcl import AmclLocalizer
from navstack.params.amcl import AmclParams
from navstack.params.nav2_file.views import read_amcl
from navstack.params.strict import load_dataclass
from navstack.types import Belief, FloatArray, Observation, Odometry, Pose2D, Twist2D

LOST = 2.0  # [m]
LINE = 2  # [cells] width of an outline
NOISE = ("alpha1", "alpha2", "alpha3", "alpha4")


@dataclass(frozen=True, slots=True)
class Case:
    """What the scan sees, what the map says, and how AMCL takes both."""

    name: str
    seen: OccupancyGrid
    drawn: OccupancyGrid
    rate: float  # [Hz] of the scan
    noise: float = 1.0  # factor on the published variances of the odometry's noise
    dropout: float = 0.0  # [-] share of the beams that return nothing


def poses_of(task: EpisodeTask) -> FloatArray:
    """Time [s] and true pose of the robot (N, 4) at every tick of a delivery."""
    return np.array([(observation.stamp, *truth.as_array()) for observation, truth, _ in drive(task)])


def outlined(grid: OccupancyGrid) -> OccupancyGrid:
    """The same map with only the rim of what is occupied."""
    solid = grid.data == OCCUPIED
    return drawn(solid & ~ndimage.binary_erosion(solid, iterations=LINE), grid)


def drawn(occupied: FloatArray, like: OccupancyGrid) -> OccupancyGrid:
    """A map of a mask (H, W)."""
    return OccupancyGrid(np.where(occupied, OCCUPIED, FREE).astype(np.int8), like.resolution, like.origin)


def cases(map_name: str, rate: float) -> Iterator[Case]:
    """What is compared."""
    scene = scene_of(map_name)
    world, mesh = scene.geometry, drawn(scene.navigation_mesh.data != FREE, scene.geometry)
    yield Case("as published: the world, mesh filled", world, mesh, rate)
    yield Case("the same, a scan in every frame", world, mesh, 30.0)
    yield Case("the same, half of the beams lost", world, mesh, rate, dropout=0.5)
    yield Case("walls along the mesh, mesh filled", mesh, mesh, rate)
    yield Case("the world, its own plan filled", world, world, rate)
    yield Case("the world, its own plan outlined", world, outlined(world), rate)
    yield Case("walls along the mesh, mesh outlined", outlined(mesh), outlined(mesh), rate)
    yield Case("the world, mesh outlined", world, outlined(mesh), rate)
    yield Case("the world, mesh filled, noise 1/4", world, mesh, rate, noise=0.25)
    yield Case("the world, mesh filled, noise 1/30", world, mesh, rate, noise=1.0 / 30.0)


def listen(case: Case, drives: list[FloatArray], params: AmclParams, lidar: LidarParams, seed: int) -> list[FloatArray]:
    """Way driven [m], error of the position [m] and of the heading [rad] (N, 3) at every tick of each drive."""
    scaled = {key: case.noise * getattr(params, key) for key in NOISE}
    localizer = AmclLocalizer(dataclasses.replace(params, **scaled), case.drawn)
    sensor = Lidar(dataclasses.replace(lidar, rate=case.rate, dropout=case.dropout), case.seen, 0.0)
    found = []
    for number, poses in enumerate(drives):
        localizer.reset(Belief(Pose2D(*poses[0, 1:])), np.random.default_rng((seed, number)))
        sensor.reset(body_at(poses[0]), np.random.default_rng((seed, number, 1)))
        due, errors = poses[0, 0], []
        for row in poses:
            odometry = Odometry(row[0], Pose2D(*row[1:]), Twist2D())
            scan = None
            if row[0] >= due - 1e-6:
                scan, due = sensor.measure(body_at(row), np.empty((0, 2)), row[0]), due + 1.0 / case.rate
            believed = localizer.update(Observation(row[0], odometry=odometry, scan=scan)).pose.as_array()
            errors.append(believed - row[1:])
        x, y, yaw = np.array(errors).T
        way = np.concatenate(((0.0,), np.cumsum(np.hypot(*np.diff(poses[:, 1:3], axis=0).T))))
        found.append(np.column_stack((way, np.hypot(x, y), np.abs((yaw + np.pi) % (2.0 * np.pi) - np.pi))))
    return found


def body_at(row: FloatArray) -> BodyState:
    """A body that stands at a pose (time, x, y, yaw)."""
    return BodyState(*row[1:])


def line(case: Case, found: list[FloatArray]) -> str:
    """A row of the table."""
    lost, way = 0, 0.0
    for each in found:
        beyond = np.flatnonzero(each[:, 1] > LOST)
        lost += len(beyond) > 0
        way += each[beyond[0] if len(beyond) else -1, 0]
    share, pooled = wilson_interval(lost, len(found)), np.concatenate(found)
    per_loss = f"{way / lost:.0f}" if lost else f"more than {way:.0f}"
    return (
        f"| {case.name} | {np.median(pooled[:, 1]):.2f} | {np.median(pooled[:, 2]):.3f} "
        f"| {lost} of {len(found)} [{share.low:.2f}, {share.high:.2f}] | {per_loss} |"
    )


def main() -> None:
    """Read the arguments, drive and listen."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=24)
    parser.add_argument("--seed", type=int, default=1000)
    parser.add_argument("--map", default="sidewalk")
    parser.add_argument("--stack", default="paper-gps", help="which drives, and whose AMCL parameters listen")
    asked = parser.parse_args()
    study = make_study(stacks=[asked.stack], map_name=asked.map, episodes=asked.count, seed=asked.seed)
    tasks = list(study.tasks())
    drives = [poses_of(task) for task in tasks]
    lidar = load_dataclass(SensorParams, Path(tasks[0].stack.sensors)).lidar
    params = read_amcl(Parts(tasks[0]).nav2)
    way = sum(float(np.hypot(*np.diff(each[:, 1:3], axis=0).T).sum()) for each in drives)
    print(f"{len(drives)} deliveries of {asked.stack} on {asked.map}, seed {asked.seed}, {way:.0f} m\n")
    print("| the scan sees, the map says | median error [m] | of the heading [rad] | lost | metres per loss |")
    print("| --- | --- | --- | --- | --- |")
    for case in cases(asked.map, lidar.rate):
        print(line(case, listen(case, drives, params, lidar, asked.seed)), flush=True)


if __name__ == "__main__":
    main()
