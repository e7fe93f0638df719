"""How often people and a robot that avoids nobody touch: a check of the random walk against published figures.

Usage: python benchmarks/pedestrian_encounters.py [--runs N] [--speed M/S] [--seed S]

Nothing is pushed: people and robot are shapes that pass through each other. A blind robot follows the shortest path of
a mission at 1.26 m/s; a parked one stands for 172 s somewhere on such a path. On the published map, with 60 shared
goals and people of 1.1 m/s, 1000 runs gave the figures printed beside.
"""

import argparse
import dataclasses
from dataclasses import dataclass

import numpy as np

from harness.statistics import bootstrap_mean
from harness.storage.shipped import shipped
from harness.task.mission import Mission, MissionSampler
from harness.world.pedestrian_params import PedestrianParams
from harness.world.pedestrian_routes import WalkingNetwork
from harness.world.pedestrians import RandomWalkPedestrians
from harness.world.robot import RobotParams
from harness.world.scene_io import load_scene
from navstack.params.strict import load_dataclass
from navstack.types import FloatArray, Pose2D

STEP = 0.05  # [s]
BLIND_SPEED = 1.26  # [m/s] published average
PARKED_TIME = 172.0  # [s]
HARD = 1.0  # [m/s] closing speed from which a contact counts
PUBLISHED = {"blind": (0.63, 0.46, 1.9), "parked": (1.1, 0.8, None)}  # touches, hard ones, median closing speed [m/s]


@dataclass(frozen=True, slots=True)
class Run:
    """One run's touches."""

    closing_speeds: FloatArray  # [m/s] at first touch, one per touch
    duration: float  # [s]


def drive(route: FloatArray, speed: float) -> FloatArray:
    """Poses (T, 3) x, y [m], yaw [rad] every STEP along corners (M, 2) [m] at constant speed [m/s]."""
    legs = np.diff(route, axis=0)
    ends = np.concatenate(([0.0], np.cumsum(np.hypot(*legs.T))))
    covered = np.arange(0.0, ends[-1], speed * STEP)
    leg = np.minimum(np.searchsorted(ends, covered, side="right") - 1, len(legs) - 1)
    yaws = np.arctan2(legs[:, 1], legs[:, 0])[leg]
    return np.column_stack((np.interp(covered, ends, route[:, 0]), np.interp(covered, ends, route[:, 1]), yaws))


def touches(poses: FloatArray, speed: float, people: FloatArray, robot: RobotParams, radius: float) -> FloatArray:
    """Closing speeds [m/s] at the beginning of every touch.

    Args:
        poses: (T, 3) of the robot's body centre.
        speed: [m/s] of the robot.
        people: (T, n, 4) states.
        robot: its body.
        radius: [m] of a person.
    """
    cos, sin = np.cos(poses[:, 2:]), np.sin(poses[:, 2:])
    dx, dy = people[..., 0] - poses[:, :1], people[..., 1] - poses[:, 1:2]
    along, across = cos * dx + sin * dy, -sin * dx + cos * dy
    length, width = robot.half_size
    nx, ny = along - np.clip(along, -length, length), across - np.clip(across, -width, width)
    distance = np.hypot(nx, ny)
    touching = distance < radius
    begins = touching & ~np.vstack((touching[:1], touching[:-1]))
    vx, vy = cos * people[..., 2] + sin * people[..., 3], -sin * people[..., 2] + cos * people[..., 3]
    with np.errstate(invalid="ignore"):
        closing: FloatArray = ((speed - vx) * nx - vy * ny) / distance
    return closing[begins]


def watch(crowd: RandomWalkPedestrians, poses: FloatArray, rng: np.random.Generator) -> FloatArray:
    """States (T, n, 4) of people around a robot that takes ``poses``."""
    crowd.reset(rng, Pose2D(*poses[0].tolist()))
    states = [crowd.states]
    for _ in range(len(poses) - 1):
        crowd.step(STEP)
        states.append(crowd.states)
    return np.array(states)


def report(kind: str, runs: list[Run]) -> None:
    """Print one line with 95 % intervals."""
    speeds = np.concatenate([run.closing_speeds for run in runs])
    all_of, hard_of, median = PUBLISHED[kind]
    duration = np.mean([run.duration for run in runs])
    print(f"{kind}: {len(runs)} runs of {duration:.0f} s on average")
    counts = (
        ("touches per run", [len(run.closing_speeds) for run in runs], all_of),
        (f"with >= {HARD:.0f} m/s", [int((run.closing_speeds >= HARD).sum()) for run in runs], hard_of),
    )
    for name, values, published in counts:
        mean = bootstrap_mean(np.array(values, dtype=float), np.random.default_rng(0), 10_000)
        print(f"  {name:18} {mean.value:.2f} [{mean.low:.2f}, {mean.high:.2f}]   published map: {published}")
    if len(speeds):
        print(f"  {'median speed':18} {np.median(speeds):.2f} m/s   published map: {median or 'not given'}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=1000)
    parser.add_argument("--speed", type=float, default=1.1, help="of all people [m/s]")
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    mesh = load_scene("sidewalk").navigation_mesh
    params = dataclasses.replace(PedestrianParams(), speed=arguments.speed, speed_std=0.0)
    robot = load_dataclass(RobotParams, shipped("params") / "robots" / "segway_e1.yaml")
    crowd, sampler = RandomWalkPedestrians(params, mesh), MissionSampler(mesh)
    network = WalkingNetwork(mesh, params.agent_radius)
    runs: dict[str, list[Run]] = {"blind": [], "parked": []}
    lengths = []
    for rng in np.random.default_rng(arguments.seed).spawn(arguments.runs):
        mission: Mission = sampler.sample(rng)
        start, goal = (network.nearest_cell(pose.x, pose.y) for pose in (mission.start, mission.goal))
        poses = drive(network.route(start, goal), BLIND_SPEED)
        lengths.append(mission.shortest_path)
        place = poses[rng.integers(len(poses))]
        for kind, way, speed in (
            ("blind", poses, BLIND_SPEED),
            ("parked", np.tile(place, (round(PARKED_TIME / STEP), 1)), 0.0),
        ):
            people = watch(crowd, way, rng)
            runs[kind].append(Run(touches(way, speed, people, robot, params.radius), len(way) * STEP))
    print(f"{params.count} people of {params.speed} m/s; mean shortest path {np.mean(lengths):.0f} m")
    for kind, of_kind in runs.items():
        report(kind, of_kind)


if __name__ == "__main__":
    main()
