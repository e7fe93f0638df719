"""A laboratory for the physical world: flat ground, straight walkers, no sensors."""

import dataclasses
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest

from harness import resources
from harness.mission import Mission
from harness.world.engine import bullet
from harness.world.pedestrians import PedestrianModel
from harness.world.pybullet_world import PyBulletWorld
from harness.world.robot import RobotParams
from harness.world.scene import Scene
from harness.world.world_params import WorldParams
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.params.strict import load_dataclass
from navstack.types import Observation, Pose2D, Twist2D


class Marchers(PedestrianModel):
    """People who walk straight on for ever."""

    def __init__(self, *states):
        self._start = np.array(states, dtype=float).reshape(-1, 4)
        self._states = self._start

    def reset(self, rng, robot):
        self._states = self._start

    def step(self, dt):
        states = self._states.copy()
        states[:, :2] += dt * states[:, 2:]
        self._states = states

    @property
    def states(self):
        return self._states


class NoSensors:
    """Delivers nothing."""

    def reset(self, body, generators):
        pass

    def measure(self, body, pedestrians, stamp):
        return Observation(stamp)


class Lab:
    """Makes worlds and drives through them."""

    @staticmethod
    @contextmanager
    def world(robot, params, obstacles=(), people=(), steps_per_tick=2, start=None) -> Iterator[PyBulletWorld]:
        grid = OccupancyGrid(np.zeros((4, 4), dtype=np.int8), 1.0, Pose2D())
        scene = Scene("test", tuple(obstacles), (), grid, grid)
        world = PyBulletWorld(scene, robot, params, Marchers(*people), NoSensors(), steps_per_tick)
        try:
            Lab.restart(world, start or Pose2D())
            yield world
        finally:
            world.close()

    @staticmethod
    def restart(world, start):
        generators = {name: np.random.default_rng(1) for name in ("pedestrians", "cargo")}
        world.reset(Mission(start, start, 0.0), generators)

    @staticmethod
    def fling(world, vx, vy=0.0, vz=0.0, spin=(0.0, 0.0, 0.0)):
        """Set the robot in motion without its drive."""
        bullet.resetBaseVelocity(world._body, (vx, vy, vz), spin, physicsClientId=world._client)
        world._read_robot()

    @staticmethod
    def drive(world, ticks, v=0.0, w=0.0):
        """The truth after each tick."""
        truths = []
        for _ in range(ticks):
            world.step(Twist2D(v, 0.0, w))
            truths.append(world.truth)
        return truths

    @staticmethod
    def without_drive(robot):
        return dataclasses.replace(robot, wheel_friction=0.0, body_friction=0.0)


@pytest.fixture(scope="session")
def lab() -> type[Lab]:
    return Lab


@pytest.fixture(scope="session")
def robot() -> RobotParams:
    return load_dataclass(RobotParams, resources.shipped("params") / "robots" / "segway_e1.yaml")


@pytest.fixture(scope="session")
def params() -> WorldParams:
    """The published world without cargo."""
    loaded = load_dataclass(WorldParams, resources.shipped("params") / "worlds" / "costnav.yaml")
    return dataclasses.replace(loaded, cargo=dataclasses.replace(loaded.cargo, pieces=0))
