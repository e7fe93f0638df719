"""Experiments in an empty place.

The physical world without a city, sensors, popcorn or people with plans.
"""

import dataclasses
import math
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager

import numpy as np

from harness.task.mission import Mission
from harness.world.map.scene import Obstacle, Scene, Zone
from harness.world.map.shapes import box, octagon
from harness.world.people.pedestrians import PedestrianModel
from harness.world.physics.body_state import BodyState
from harness.world.physics.engine import bullet
from harness.world.physics.robot import RobotParams
from harness.world.pybullet_world import PyBulletWorld
from harness.world.sensors.suite import SensorSuite
from harness.world.truth import Contact, Truth
from harness.world.world_params import WorldParams
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.types import FloatArray, Observation, Pose2D, Twist2D

Person = tuple[float, float, float, float]  # x, y [m], vx, vy [m/s]
STOP = Twist2D()


def wall(x: float, yaw: float = 0.0, height: float = 1.5) -> Obstacle:
    """A glass wall whose face is ``x`` [m] ahead."""
    middle = x + 0.5 * math.cos(yaw), 0.5 * math.sin(yaw)
    return Obstacle("building_glass", box(*middle, yaw, 1.0, 4.0), height)


def post(x: float, y: float = 0.0, height: float = 0.9, radius: float = 0.1) -> Obstacle:
    """A bollard."""
    return Obstacle("bollard", octagon(x, y, radius), height)


class Marchers(PedestrianModel):
    """People who walk straight on for ever."""

    def __init__(self, people: Iterable[Person]) -> None:
        self._start = np.array(list(people), dtype=float).reshape(-1, 4)
        self._states = self._start

    def reset(self, rng: np.random.Generator, robot: Pose2D) -> None:
        """See :class:`PedestrianModel`."""
        self._states = self._start

    def step(self, dt: float) -> None:
        """See :class:`PedestrianModel`."""
        states = self._states.copy()
        states[:, :2] += dt * states[:, 2:]
        self._states = states

    @property
    def states(self) -> FloatArray:
        """See :class:`PedestrianModel`."""
        return self._states


class NoSensors(SensorSuite):
    """Delivers nothing."""

    def __init__(self) -> None:
        """Nothing to mount."""

    def reset(self, body: BodyState, generators: Mapping[str, np.random.Generator]) -> None:
        """Nothing to prepare."""

    def measure(self, body: BodyState, pedestrians: FloatArray, stamp: float) -> Observation:
        """An observation of nothing."""
        return Observation(stamp)


@contextmanager
def laboratory(
    robot: RobotParams,
    params: WorldParams,
    obstacles: Iterable[Obstacle] = (),
    people: Iterable[Person] = (),
    zones: Iterable[Zone] = (),
    steps_per_tick: int = 1,
    start: Pose2D | None = None,
) -> Iterator[PyBulletWorld]:
    """A world with the robot at ``start`` (the origin if None)."""
    grid = OccupancyGrid(np.zeros((4, 4), dtype=np.int8), 1.0, Pose2D())
    scene = Scene("laboratory", tuple(obstacles), tuple(zones), grid, grid)
    world = PyBulletWorld(scene, robot, params, Marchers(people), NoSensors(), steps_per_tick)
    try:
        restart(world, start or Pose2D())
        yield world
    finally:
        world.close()


def restart(world: PyBulletWorld, start: Pose2D) -> None:
    """Begin a new episode."""
    world.reset(
        Mission(start, start, 0.0),
        {name: np.random.default_rng(1) for name in ("pedestrians", "cargo")},
    )


def fling(
    world: PyBulletWorld,
    vx: float,
    vy: float = 0.0,
    spin: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> None:
    """Set the robot in motion without its drive: velocity [m/s] and spin [rad/s], map frame."""
    bullet.resetBaseVelocity(world._body, (vx, vy, 0.0), spin, physicsClientId=world._client)
    world._read_robot()


def coasting(robot: RobotParams) -> RobotParams:
    """The robot on ice: neither its wheels nor its body hold on to anything."""
    return dataclasses.replace(robot, wheel_friction=0.0, body_friction=0.0)


def stepping_at(params: WorldParams, rate: float) -> WorldParams:
    """The world with a physics rate [Hz], without popcorn."""
    physics, cargo = (
        dataclasses.replace(params.physics, rate=rate),
        dataclasses.replace(params.cargo, pieces=0),
    )
    return dataclasses.replace(params, physics=physics, cargo=cargo)


def bollard(x: float, height: float) -> Obstacle:
    """A post of 0.2 m with its nearest face at about ``x`` [m]."""
    return Obstacle("bollard", octagon(x + 0.1, 0.0, 0.1), height)


def collide(
    robot: RobotParams,
    params: WorldParams,
    speed: float,
    obstacles: Iterable[Obstacle],
    people: Iterable[Person],
) -> Contact:
    """Let the coasting robot, thrown forward with ``speed`` [m/s], hit the one thing ahead.

    The thing is within 1.5 m.
    """
    with laboratory(coasting(robot), params, obstacles, people) as world:
        fling(world, speed)
        for _ in range(round((2.0 / speed + 0.3) * params.physics.rate)):
            world.step(STOP)
        (contact,) = world.close_episode().contacts
    return contact


def greatest_tilt(
    robot: RobotParams,
    params: WorldParams,
    speed: float,
    obstacle: Obstacle,
) -> float:
    """How far [rad] the coasting robot leans when it hits something with ``speed`` [m/s].

    That is within 1 m ahead of it.
    """
    greatest = 0.0
    with laboratory(coasting(robot), params, [obstacle]) as world:
        fling(world, speed)
        for _ in range(round((1.2 / speed + 1.5) * params.physics.rate)):
            world.step(STOP)
            greatest = max(greatest, world.truth.tilt)
            if greatest > 1.0:
                break
    return greatest


def tipping_speed(
    robot: RobotParams,
    params: WorldParams,
    obstacle: Obstacle,
    tilt: float = 0.5,
) -> float:
    """Speed [m/s] from which hitting something tips the coasting robot by more than ``tilt`` [rad].

    By bisection.

    inf if 5 m/s does not.
    """
    low, high = 0.2, 5.0
    if greatest_tilt(robot, params, high, obstacle) <= tilt:
        return math.inf
    while high - low > 0.02:
        middle = 0.5 * (low + high)
        if greatest_tilt(robot, params, middle, obstacle) > tilt:
            high = middle
        else:
            low = middle
    return 0.5 * (low + high)


def drive(
    world: PyBulletWorld,
    steps: int,
    speed: float = 0.0,
    yaw_rate: float = 0.0,
) -> list[Truth]:
    """Command a speed [m/s] and a yaw rate [rad/s]; returns the truth after each tick."""
    truths: list[Truth] = []
    for _ in range(steps):
        world.step(Twist2D(speed, 0.0, yaw_rate))
        truths.append(world.truth)
    return truths


def mechanical_energy(world: PyBulletWorld, robot: RobotParams, gravity: float) -> float:
    """Kinetic and potential energy of the robot in [J]."""
    rotation = np.array(bullet.getMatrixFromQuaternion(world._orientation)).reshape(3, 3)
    spin = rotation.T @ world._spin
    translation = robot.mass * float(np.dot(world._velocity, world._velocity))
    turning = float(spin @ (np.array(robot.inertia) * spin))
    return float(0.5 * (translation + turning) + robot.mass * gravity * world._position[2])
