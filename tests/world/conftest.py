"""A laboratory for the physical world: flat ground, straight walkers, no sensors."""

import dataclasses

import pytest

from harness.storage import shipped as resources
from harness.world.physics.robot import RobotParams
from harness.world.world_params import WorldParams
from navstack.params.strict import load_dataclass

from . import laboratory


class Lab:
    """Makes worlds and drives through them; two physics steps per tick."""

    restart = staticmethod(laboratory.restart)
    fling = staticmethod(laboratory.fling)
    without_drive = staticmethod(laboratory.coasting)

    @staticmethod
    def world(robot, params, obstacles=(), people=(), steps_per_tick=2, start=None, zones=()):
        return laboratory.laboratory(robot, params, obstacles, people, zones, steps_per_tick, start)

    @staticmethod
    def drive(world, ticks, v=0.0, w=0.0):
        """The truth after each tick."""
        return laboratory.drive(world, ticks, v, w)


def load_robot(name):
    return load_dataclass(RobotParams, resources.shipped("params") / "robots" / f"{name}.yaml")


@pytest.fixture(scope="session")
def lab() -> type[Lab]:
    return Lab


@pytest.fixture(scope="session")
def robot() -> RobotParams:
    return load_robot("segway_e1")


@pytest.fixture(scope="session", params=["segway_e1", "nova_carter"])
def any_robot(request) -> RobotParams:
    return load_robot(request.param)


@pytest.fixture(scope="session")
def params() -> WorldParams:
    """The published world without cargo."""
    loaded = load_dataclass(WorldParams, resources.shipped("params") / "worlds" / "easy.yaml")
    return dataclasses.replace(loaded, cargo=dataclasses.replace(loaded.cargo, pieces=0))
