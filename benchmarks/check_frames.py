"""What a walking person does to the robot: smooth as in world version 1, and frame by frame as in version 2.

    python benchmarks/check_frames.py

One person at a time walks at 1 m/s into a robot that stands, or that drives at a speed, from 40 directions and
offsets; the robot has its drive and no cargo. The table of docs/physics.md.
"""

import dataclasses
import math
from pathlib import Path

import numpy as np
from laboratory import Person, laboratory

from harness.storage.shipped import shipped
from harness.world.robot import RobotParams
from harness.world.world_params import WorldParams
from navstack.params.strict import load_dataclass
from navstack.types import Twist2D

HITS, WALK, SECONDS = 40, 1.0, 5.0
SPEEDS = (0.0, 1.26, 1.75)  # [m/s] of the robot: standing, the published mean, that of version 1
TIPPED = 0.5  # [rad]


def main() -> None:
    """Print the table."""
    params = shipped("params")
    robot = load_dataclass(RobotParams, params / "robots" / "segway_e1.yaml")
    old, new = (_world(params / "worlds" / f"{name}.yaml") for name in ("easy", "published_2"))
    bodies = new.pedestrian_bodies
    worlds = {
        "smooth, points of a partner together": old,
        "smooth, single points": dataclasses.replace(old, contacts=new.contacts),
        "frames, single points": _with(new, max_contact_impulse=0.0, max_depenetration_speed=0.0),
        "and at most 100 N s a point": _with(new, max_depenetration_speed=0.0),
        "and parting at 1 m/s at most (version 2)": _with(new, frame_steps=bodies.frame_steps),
    }
    print("| world | robot [m/s] | counted of 40 | contacts per hit | median [N s] | largest [N s] | tipped |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for name, world in worlds.items():
        for speed in SPEEDS:
            print(f"| {name} | {speed:g} | {_row(robot, world, speed)} |")


def _world(path: Path) -> WorldParams:
    world = load_dataclass(WorldParams, path)
    return dataclasses.replace(world, cargo=dataclasses.replace(world.cargo, pieces=0))


def _with(world: WorldParams, **changes: float) -> WorldParams:
    return dataclasses.replace(world, pedestrian_bodies=dataclasses.replace(world.pedestrian_bodies, **changes))


def _row(robot: RobotParams, world: WorldParams, speed: float) -> str:
    rng, counted, impulses, tipped = np.random.default_rng(0), 0, list[float](), 0
    numbers: list[int] = []
    for _ in range(HITS):
        with laboratory(robot, world, people=[_person(rng, speed, robot)]) as there:
            is_tipped = False
            for _ in range(round(SECONDS * world.physics.rate)):
                there.step(Twist2D(speed))
                is_tipped = is_tipped or there.truth.tilt > TIPPED
            contacts = there.close_episode().counted_contacts
        counted += bool(contacts)
        tipped += is_tipped
        numbers += [len(contacts)] if contacts else []
        impulses += [contact.impulse for contact in contacts]
    if not impulses:
        return f"0 | - | - | - | {tipped}"
    return f"{counted} | {np.mean(numbers):.2f} | {np.median(impulses):.0f} | {max(impulses):.0f} | {tipped}"


def _person(rng: np.random.Generator, speed: float, robot: RobotParams) -> Person:
    """Somebody who meets the robot: from anywhere where it stands, from ahead where it drives."""
    offset, slack = rng.uniform(-0.5, 0.5), rng.uniform(0.0, 0.1)
    if speed > 0.0:
        return (6.0 + slack, offset, -WALK, 0.0)
    angle, (x, y) = rng.uniform(-math.pi, math.pi), robot.center
    cos, sin, away = math.cos(angle), math.sin(angle), 2.0 + slack
    return (x + away * cos - offset * sin, y + away * sin + offset * cos, -WALK * cos, -WALK * sin)


if __name__ == "__main__":
    main()
