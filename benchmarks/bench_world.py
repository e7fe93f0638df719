"""How much faster than real time the world alone steps on one core, while nothing collides.

Usage: python benchmarks/bench_world.py [--seconds 60] [--runs 7]

A robot circles on an open plaza of a map without obstacles near it, with 20 people walking elsewhere, a 360-beam
lidar at 30 Hz and popcorn in its bucket; the world is stepped at 30 Hz, physics at 120 Hz. Each part is then left out
in turn, in the same run, so that the ratios hold on a noisy machine. The program has one thread and waits for nothing,
so its processor time is what it takes on a core of its own, whatever else the machine does.
"""

import argparse
import dataclasses
import time
from pathlib import Path

import numpy as np

from harness.episode.factory import robot_of, scene_of, world_params
from harness.task.mission import Mission
from harness.task.study import CONSUMERS, make_study
from harness.world.pedestrians import RandomWalkPedestrians
from harness.world.pybullet_world import PyBulletWorld
from harness.world.sensors import SensorParams, SensorSuite
from navstack.params.strict import load_dataclass
from navstack.types import Pose2D, Twist2D

STEPS_PER_TICK = 4  # physics steps: 30 Hz
LIDAR_RATE, BEAMS = 30.0, 360


def make_world(people: int, with_cargo: bool, with_lidar: bool) -> PyBulletWorld:
    """A world of the shipped map with parts left out."""
    task = next(make_study(stacks=["nav2-gps"], episodes=1).tasks())
    scene, params = scene_of(task.map_name), world_params(task.world, people)
    cargo = params.cargo if with_cargo else dataclasses.replace(params.cargo, pieces=0)
    params = dataclasses.replace(params, cargo=cargo)
    sensors = load_dataclass(SensorParams, Path(task.stack.sensors))
    rate = LIDAR_RATE if with_lidar else 1e-3
    sensors = dataclasses.replace(sensors, lidar=dataclasses.replace(sensors.lidar, rate=rate, beams=BEAMS))
    return PyBulletWorld(
        scene,
        robot_of(task.stack.robot),
        params,
        RandomWalkPedestrians(params.people, scene.walkable),
        SensorSuite(sensors, scene, params.people.radius),
        STEPS_PER_TICK,
    )


def open_place() -> Pose2D:
    """The place of the shipped map that is farthest from everything."""
    from scipy import ndimage

    scene = scene_of("sidewalk")
    grid = scene.geometry
    clearance = ndimage.distance_transform_edt((grid.data == 0) & (scene.walkable.data == 0))
    row, column = np.unravel_index(int(np.argmax(clearance)), clearance.shape)
    return Pose2D(
        grid.origin.x + (float(column) + 0.5) * grid.resolution, grid.origin.y + (float(row) + 0.5) * grid.resolution
    )


def factor(world: PyBulletWorld, place: Pose2D, seconds: float, seed: int) -> float | None:
    """Simulated seconds over those of the processor in one run; None: something collided."""
    generators = {name: np.random.default_rng((seed, number)) for number, name in enumerate(CONSUMERS)}
    world.reset(Mission(place, place, 0.0), generators)
    command = Twist2D(0.6, 0.0, 0.6)
    for _ in range(30):
        world.step(command)
    began = time.process_time()
    for _ in range(round(seconds * 30)):
        world.step(command)
    used = time.process_time() - began
    truth = world.close_episode()
    return None if truth.contacts or truth.counted_contacts else seconds / used


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--runs", type=int, default=7)
    arguments = parser.parse_args()
    place = open_place()
    worlds = {
        "everything": make_world(20, True, True),
        "without cargo": make_world(20, False, True),
        "without people": make_world(0, True, True),
        "without lidar": make_world(20, True, False),
        "robot alone": make_world(0, False, False),
    }
    measured: dict[str, list[float]] = {name: [] for name in worlds}
    collided = 0
    for seed in range(arguments.runs + 1):
        for name, world in worlds.items():
            value = factor(world, place, arguments.seconds if seed else 1.0, seed)
            collided += value is None
            if seed and value is not None:  # the first run compiles
                measured[name].append(value)
    print(f"{'world':<16}{'median':>8}{'least':>8}{'most':>8}   x real time per core; {collided} runs collided")
    for name, values in measured.items():
        print(f"{name:<16}{np.median(values):>8.0f}{min(values):>8.0f}{max(values):>8.0f}   n = {len(values)}")


if __name__ == "__main__":
    main()
