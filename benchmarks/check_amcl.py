"""Does AMCL hold its position, and does it find itself? On a real building's scans, and in our world.

Usage: python benchmarks/check_amcl.py missions|kidnapped|demo [--count N] [--seed S] [--workers N]

``missions``: deliveries of the stack nav2-amcl, AMCL in the loop. The error is that of the believed position at every
tick; a delivery is lost if it ends more than 2 m wrong.

``kidnapped``: AMCL listens while a robot that knows where it is makes a delivery. After 8 m AMCL is made to believe in
another pose, anywhere free on the map, as if somebody had carried it; recovery is on. It has found itself when it ends
within 0.5 m of the truth. Deliveries of less than 40 m after that do not count. With ``--uniform`` random particles are
drawn from anywhere, as in Nav2.

``demo`` (needs NAVSTACK_DATA): MRPT's localization demo. The map is drawn from scans at known poses; the robot starts
anywhere in x -10..10 m, y -15..-5 m, with any heading, and drives 13 m along a corridor. It has found itself when it
ends within 0.5 (m and rad together) of the known end.
"""

import argparse
import dataclasses
import os
from collections.abc import Iterator
from functools import lru_cache, partial
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from harness.execution import Workers
from harness.setup import build_brain, build_world, mission_of, nav2_of, rules_of, scene_of
from harness.statistics import wilson_interval
from harness.study import EpisodeTask, make_study
from navstack.costmap.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from navstack.geometry import compose, normalize_angle
from navstack.localization.amcl import AmclLocalizer
from navstack.localization.free_space import FreeSpace
from navstack.params.amcl import AmclParams
from navstack.params.nav2_views import read_amcl
from navstack.types import Belief, LaserScan, Observation, Odometry, Pose2D, Twist2D

NEAR = 0.5  # [m] of the truth: it has found itself
LOST = 2.0  # [m] from the truth
BEFORE, AFTER = 8.0, 40.0  # [m] that a robot drives until it is kidnapped, and at least from then on
CANDIDATES = 100_000  # poses of which a scan picks the random particles

RESOLUTION = 0.05  # [m/cell] of the demo's map
START = (-10.0, 10.0, -15.0, -5.0)  # [m] x and y between which the demo's robot starts
NO_RETURN = 80.0  # [m] from which on the demo's scanner has seen nothing
DEMO = AmclParams(
    **{f"alpha{i}": 0.05 for i in range(1, 5)},
    laser_max_range=NO_RETURN,
    min_particles=2000,
    max_particles=20_000,
    update_min_d=0.0,
    update_min_a=0.0,
)


def drive(task: EpisodeTask) -> Iterator[tuple[Observation, Pose2D, Pose2D]]:
    """Drive a delivery: what the brain saw at every tick, where the robot was and where it believed to be."""
    generators = task.generators()
    mission, rules = mission_of(task, generators["mission"]), rules_of(task.rules)
    world = build_world(task)
    brain = build_brain(task, world)
    observation = world.reset(mission, generators)
    brain.reset(mission.goal, Belief(mission.start), generators["planner"], generators["localizer"])
    while rules.judge(world.truth, mission.goal) is None:
        command, truth = brain.tick(observation), world.truth.pose
        assert brain.belief is not None
        yield observation, truth, brain.belief.pose
        observation = world.step(command)
    world.close_episode()


def errors_of(task: EpisodeTask) -> np.ndarray:
    """The error of the believed position [m] at every tick of a delivery."""
    return np.array([distance(truth, believed) for _, truth, believed in drive(task)])


def missions(count: int, seed: int, workers: int) -> None:
    """Print how well AMCL knows where it is."""
    study = make_study(stacks=["nav2-amcl"], episodes=count, seed=seed)
    errors = []
    with Workers(workers) as pool:
        for finished in pool.run(errors_of, study.tasks()):
            if finished.result is None:
                print(f"delivery {finished.task.episode}: {finished.error}", flush=True)
                continue
            errors.append(finished.result)
            print(summary(errors), flush=True)


def summary(errors: list[np.ndarray]) -> str:
    """The errors of deliveries in one line."""
    pooled, lost = np.concatenate(errors), sum(each[-1] > LOST for each in errors)
    low, high = bootstrap(errors)
    return (
        f"{len(errors)} deliveries: median error {np.median(pooled):.3f} m, 95th percentile "
        f"{np.percentile(pooled, 95):.3f} [{low:.3f}, {high:.3f}] m, greatest {pooled.max():.2f} m, lost {lost}"
    )


def bootstrap(errors: list[np.ndarray]) -> tuple[float, float]:
    """95 % interval of the 95th percentile, deliveries drawn anew."""
    rng, found = np.random.default_rng(0), []
    thinned = [each[::30] for each in errors]
    for _ in range(500):
        chosen = rng.integers(len(errors), size=len(errors))
        found.append(np.percentile(np.concatenate([thinned[i] for i in chosen]), 95))
    return float(np.percentile(found, 2.5)), float(np.percentile(found, 97.5))


@lru_cache(maxsize=1)
def listener(params: AmclParams, map_name: str) -> AmclLocalizer:
    """An AMCL that only listens; made once per process."""
    return AmclLocalizer(params, scene_of(map_name).mapped_geometry)


@lru_cache(maxsize=1)
def free_space(map_name: str) -> FreeSpace:
    """Where on a map a robot may be set down."""
    return FreeSpace(scene_of(map_name).mapped_geometry)


def carry_away(localizer: AmclLocalizer, truth: Pose2D, there: np.ndarray) -> None:
    """Move the particles as one, so that what stood at the truth stands at another pose (3,)."""
    poses = localizer.particles.poses
    turn = there[2] - truth.yaw
    x, y = poses[:, 0] - truth.x, poses[:, 1] - truth.y
    poses[:, 0] = there[0] + np.cos(turn) * x - np.sin(turn) * y
    poses[:, 1] = there[1] + np.sin(turn) * x + np.cos(turn) * y
    poses[:, 2] += turn


def final_error(task: EpisodeTask, candidates: int) -> float | None:
    """The error [m] at the end of a delivery on the way of which AMCL was kidnapped; None: it is too short."""
    recovery = {"recovery_alpha_slow": 0.001, "recovery_alpha_fast": 0.1, "recovery_candidates": candidates}
    localizer = listener(dataclasses.replace(read_amcl(nav2_of(task)), **recovery), task.map_name)
    rng = np.random.default_rng((task.seed, task.episode))
    driven, before, kidnapped_at, believed = 0.0, None, None, Pose2D()
    for observation, truth, _ in drive(task):
        if before is None:
            localizer.reset(Belief(truth), rng)
        driven += distance(truth, before or truth)
        before = truth
        if kidnapped_at is None and driven > BEFORE:
            kidnapped_at = driven
            carry_away(localizer, truth, free_space(task.map_name).draw(1, rng)[0])
        believed = localizer.update(observation).pose
    if before is None or kidnapped_at is None or driven - kidnapped_at < AFTER:
        return None
    return distance(before, believed)


class Demo:
    """The demo's data as observations, and its map."""

    def __init__(self, folder: Path) -> None:
        self._data = np.load(folder / "mrpt_localization" / "localization_demo.npz")
        self.end = Pose2D(*self._data["expected_final"])
        self._sensor = Pose2D(*self._data["sensor_pose"][:2], self._data["sensor_pose"][3])

    def observations(self) -> Iterator[Observation]:
        """Odometry and a scan for each increment, a second apart."""
        pose = Pose2D()
        for i, (increment, ranges) in enumerate(zip(self._data["odom_increment"], self._data["ranges"], strict=True)):
            pose = compose(pose, Pose2D(*increment))
            yield Observation(float(i), Odometry(float(i), pose, Twist2D()), scan=self._scan(float(i), ranges))

    def _scan(self, stamp: float, ranges: np.ndarray) -> LaserScan:
        angles = self._data["angles"]
        increment = float(angles[1] - angles[0])
        return LaserScan(stamp, ranges.astype(float), float(angles[0]), increment, 0.0, NO_RETURN, self._sensor)

    def map(self) -> OccupancyGrid:
        """Occupied where beams ended, free where they passed, unknown elsewhere and where the robot does not start."""
        scans = []
        for pose, ranges in zip(self._data["map_pose"], self._data["map_ranges"], strict=True):
            sensor, returned = compose(Pose2D(*pose), self._sensor), ranges < NO_RETURN
            angles = sensor.yaw + self._data["angles"][returned]
            directions = np.column_stack((np.cos(angles), np.sin(angles)))
            scans.append((sensor.x, sensor.y) + np.vstack((np.zeros(2), ranges[returned, None] * directions)))
        hits = np.concatenate([scan[1:] for scan in scans])
        origin = hits.min(axis=0) - 1.0
        width, height = np.ceil((hits.max(axis=0) + 1.0 - origin) / RESOLUTION).astype(int)
        image = Image.new("1", (int(width), int(height)))
        for scan in scans:
            ImageDraw.Draw(image).polygon([tuple(point) for point in (scan - origin) / RESOLUTION], fill=1)
        x, y = (origin[i] + RESOLUTION * np.arange(size) for i, size in enumerate((width, height)))
        starts = ((y > START[2]) & (y < START[3]))[:, None] & (x > START[0]) & (x < START[1])
        grid = np.where(np.array(image) & starts, np.int8(FREE), np.int8(UNKNOWN))
        columns, rows = np.rint((hits - origin) / RESOLUTION).astype(int).T  # cells as AMCL takes them
        grid[rows, columns] = OCCUPIED
        return OccupancyGrid(grid, RESOLUTION, Pose2D(*origin))


def finds_itself(localizer: AmclLocalizer, demo: Demo, seed: int) -> bool:
    """Localize globally with a seed."""
    localizer.reset(Belief(Pose2D()), np.random.default_rng(seed))
    localizer.localize_globally()
    for observation in demo.observations():
        believed = localizer.update(observation).pose
    wrong = (believed.x - demo.end.x, believed.y - demo.end.y, normalize_angle(believed.yaw - demo.end.yaw))
    return float(np.linalg.norm(wrong)) < NEAR


def distance(a: Pose2D, b: Pose2D) -> float:
    """[m] between two poses."""
    return float(np.hypot(a.x - b.x, a.y - b.y))


def found(successes: int, count: int) -> str:
    """A share in words."""
    share = wilson_interval(successes, count)
    return f"found itself in {successes} of {count} ({share.value:.2f} [{share.low:.2f}, {share.high:.2f}])"


def kidnapped(count: int, seed: int, workers: int, candidates: int) -> None:
    """Print how often AMCL finds itself after it was carried away."""
    study = make_study(stacks=["nav2-gps"], localizer="ground_truth", episodes=4 * count, seed=seed)
    errors: list[float] = []
    with Workers(workers) as pool:
        for finished in pool.run(partial(final_error, candidates=candidates), study.tasks()):
            if finished.error:
                print(f"delivery {finished.task.episode}: {finished.error}", flush=True)
            if finished.result is None:
                continue
            errors.append(finished.result)
            share = found(sum(error < NEAR for error in errors), len(errors))
            print(f"delivery {finished.task.episode}: {errors[-1]:.2f} m wrong; {share}", flush=True)
            if len(errors) == count:
                return


def global_localization(count: int, seed: int) -> None:
    """Print how often AMCL finds itself in the demo's building."""
    demo = Demo(Path(os.environ["NAVSTACK_DATA"]))
    localizer = AmclLocalizer(DEMO, demo.map())
    successes = sum(finds_itself(localizer, demo, seed + i) for i in range(count))
    print(found(successes, count))


def main() -> None:
    """Read the arguments and check."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("missions", "kidnapped", "demo"))
    parser.add_argument("--count", type=int, default=50)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--uniform", action="store_true", help="random particles from anywhere, as in Nav2")
    arguments = parser.parse_args()
    if arguments.what == "missions":
        missions(arguments.count, arguments.seed, arguments.workers)
    elif arguments.what == "kidnapped":
        kidnapped(arguments.count, arguments.seed, arguments.workers, 0 if arguments.uniform else CANDIDATES)
    else:
        global_localization(arguments.count, arguments.seed)


if __name__ == "__main__":
    main()
