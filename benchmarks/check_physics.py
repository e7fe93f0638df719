"""The physical world held against mechanics: impacts, tipping, driving, energy and curbs, theory beside simulation.

Usage: python benchmarks/check_physics.py [--robot NAME ...]

Impacts are plastic and central: the impulse is the speed times the reduced mass. Tipping has no closed formula here
(the robot strikes, pitches and slides at once): its reference is the same world at 960 Hz.
"""

import dataclasses
import math
from pathlib import Path

import numpy as np
from laboratory import (
    bollard,
    collide,
    drive,
    fling,
    laboratory,
    mechanical_energy,
    restart,
    stepping_at,
    tipping_speed,
    wall,
)
from options import parsed

from harness.episode.factory import robot_of, world_params
from harness.storage import shipped as resources
from harness.world.robot import RobotParams
from harness.world.scene import Obstacle, Zone
from harness.world.shapes import Rect, box
from harness.world.world_params import WorldParams
from navstack.types import Pose2D

SPEEDS = (0.5, 1.0, 1.5, 2.0, 2.5)  # [m/s]
OFFSETS = (0.0, 0.003, 0.007, 0.011)  # [m] by which the target is moved: where within a step it is hit
CURB = (Zone("road", Rect(-30, -30, 30, 30).polygon, -0.12), Zone("sidewalk", Rect(-20, -20, 1, 20).polygon))


def targets(params: WorldParams, kind: str, offset: float):
    """World, obstacles, people and the mass [kg] that the partner lends to an impact."""
    if kind in ("kinematic", "dynamic"):
        bodies = dataclasses.replace(params.pedestrian_bodies, kind=kind, push_force=1e-6, friction=0.0)
        mass = bodies.mass if kind == "dynamic" else math.inf
        return dataclasses.replace(params, pedestrian_bodies=bodies), (), ((1.3 + offset, 0.0, 0.0, 0.0),), mass
    furniture = Obstacle("mailbox", box(1.25 + offset, 0.0, 0.0, 0.5, 0.5), 1.2)
    return params, ((wall(1.0 + offset) if kind == "wall" else furniture),), (), math.inf


def impacts(robot: RobotParams, params: WorldParams) -> None:
    print("\nimpact at        speed    theory   simulated at 120 Hz        halving the step")
    for kind in ("kinematic", "dynamic", "wall", "furniture"):
        for speed in SPEEDS:
            impulses = {}
            for rate in (120.0, 240.0):
                found = []
                for offset in OFFSETS:
                    world, obstacles, people, mass = targets(params, kind, offset)
                    found.append(collide(robot, stepping_at(world, rate), speed, obstacles, people).impulse)
                impulses[rate] = np.array(found)
            theory = speed / (1.0 / robot.mass + 1.0 / mass)
            off = 100.0 * (impulses[120.0] / theory - 1.0)
            halved = 100.0 * np.abs(impulses[240.0] / impulses[120.0] - 1.0).max()
            print(
                f"{kind:<15}{speed:>4.1f} m/s{theory:>7.1f} N s{impulses[120.0].mean():>8.1f} N s "
                f"({off.min():+.1f} to {off.max():+.1f} %){halved:>12.1f} % at most"
            )


def tipping(robot: RobotParams, params: WorldParams) -> None:
    print("\nspeed that tips it (0.5 rad) over    120 Hz     960 Hz")
    low = (("a bollard of 0.15 m", bollard(1.0, 0.15)), ("a bollard of 0.3 m", bollard(1.0, 0.3)))
    for name, obstacle in (*low, ("a ledge of 0.12 m", wall(1.0, 0.12))):
        coarse, fine = (tipping_speed(robot, stepping_at(params, rate), obstacle) for rate in (120.0, 960.0))
        deviation = f"{100.0 * (coarse / fine - 1.0):+.1f} %" if math.isfinite(coarse) else "does not tip below 5 m/s"
        print(f"{name:<34}{coarse:>6.2f} m/s{fine:>7.2f} m/s   {deviation}")


def driving(robot: RobotParams, params: WorldParams) -> None:
    gravity = params.physics.gravity
    friction = robot.wheel_friction * gravity
    brake, lag = robot.max_deceleration, robot.servo_time_constant
    params = stepping_at(params, 120.0)
    with laboratory(robot, params) as world:
        first = drive(world, 1, robot.max_speed)[-1]
        top = drive(world, 480, robot.max_speed)[-1]
        stop = drive(world, 300)[-1]
    speed = top.twist.linear_x
    distance = (speed**2 - (brake * lag) ** 2) / (2.0 * brake) + brake * lag**2  # the servo ends exponentially
    with laboratory(robot, params) as world:
        truth = drive(world, 600, 1.5)[-1]
    rolling = robot.rolling_resistance * robot.mass * gravity
    rows = (
        ("acceleration", "m/s2", min(friction, robot.max_acceleration), first.twist.linear_x * params.physics.rate),
        ("top speed", "m/s", robot.max_speed, speed),
        ("braking distance from it", "m", distance, stop.pose.x - top.pose.x),
        ("energy of 5 s at 1.5 m/s", "J", 0.5 * robot.mass * 1.5**2 + rolling * truth.pose.x, truth.motion_energy),
    )
    print("\ndriving                     theory  simulated")
    for name, unit, theory, simulated in rows:
        print(f"{name:<26}{theory:>8.2f}{simulated:>11.2f} {unit}")


def energy(robot: RobotParams, params: WorldParams) -> None:
    """The most that the mechanical energy changes upwards, without motors."""
    rng = np.random.default_rng(0)
    unpowered = dataclasses.replace(robot, max_wheel_torque=1e-9)
    print("\nenergy without motors, of 50 throws")
    for rate in (120.0, 480.0):
        growth, total = 0.0, -math.inf
        with laboratory(unpowered, stepping_at(params, rate)) as world:
            for _ in range(50):
                restart(world, Pose2D())
                fling(world, *rng.normal(0.0, 1.0, 2), (0.0, 0.0, rng.normal(0.0, 1.0)))
                energies = [mechanical_energy(world, robot, params.physics.gravity)]
                for _ in range(round(0.5 * rate)):
                    drive(world, 1, *rng.normal(0.0, 2.0, 2))
                    energies.append(mechanical_energy(world, robot, params.physics.gravity))
                thrown = energies[0] - robot.mass * params.physics.gravity * robot.center_of_mass_height
                growth, total = max(growth, np.diff(energies).max()), max(total, (energies[-1] - energies[0]) / thrown)
        print(f"  {rate:.0f} Hz: at most {growth:+.3f} J in a step, {100.0 * total:+.2f} % in half a second")


def curbs(robot: RobotParams, params: WorldParams) -> None:
    print("\noff a curb of 0.12 m, straight: where it is after 5 s and how far it leaned")
    for speed in (0.3, 0.5, 0.8, 1.26, 2.0, 3.0):
        with laboratory(robot, stepping_at(params, 120.0), zones=CURB) as world:
            truths = drive(world, 600, speed)
        last, lean = truths[-1], max(truth.tilt for truth in truths)
        end = "has fallen over" if last.tilt > 1.0 else "hangs on the curb" if last.pose.x < 1.2 else "drives on"
        print(f"  {speed:.2f} m/s: {end}, leaned by {lean:.2f} rad")
    with laboratory(robot, stepping_at(params, 120.0), zones=CURB, start=Pose2D(2.5, 0.0, math.pi)) as world:
        print(f"  up at 1.0 m/s: stands at {drive(world, 600, 1.0)[-1].pose.x - 1.0:.2f} m before the curb")


def main() -> None:
    files: Path = resources.shipped("params")
    params = world_params(str(files / "worlds" / "easy.yaml"), None)
    for name in parsed(__doc__, robot=["segway_e1", "nova_carter"]).robot:
        robot = robot_of(str(files / "robots" / f"{name}.yaml"))
        print(f"\n=== {name}: {robot.mass:.0f} kg")
        for check in (impacts, tipping, driving, energy, curbs):
            check(robot, params)


if __name__ == "__main__":
    main()
