"""A synthetic drive for the filters: a known motion, measured by the world's own sensor models."""

import math
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from harness.storage.shipped import shipped
from harness.world.physics.body_state import BodyState
from harness.world.sensors.gps_receiver import GpsReceiver
from harness.world.sensors.inertial_unit import InertialUnit
from harness.world.sensors.suite import SensorParams
from harness.world.sensors.wheel_odometry import WheelOdometry
from navstack.params.strict import load_dataclass
from navstack.types import Observation

RATE, FINE = 30.0, 10  # [Hz] of ticks; steps of the truth within one
NOBODY = np.zeros((0, 4))
GPS_EVERY = 3  # ticks


class Drive(NamedTuple):
    """What the robot observed, and where it truly was at each tick."""

    observations: list[Observation]
    truth: list[BodyState]


@lru_cache(maxsize=8)
def true_motion(seconds: float, straight: bool) -> tuple[BodyState, ...]:
    """A robot that starts from rest and winds along, or goes straight on, at about 1.2 m/s."""
    dt, states = 1.0 / (RATE * FINE), []
    x = y = yaw = 0.0
    for i in range(int(seconds * RATE) * FINE):
        t = i * dt
        speed = 1.2 * (1.0 - math.exp(-t)) + 0.3 * math.sin(0.5 * t)
        push = 1.2 * math.exp(-t) + 0.15 * math.cos(0.5 * t)
        rate = 0.0 if straight else 0.4 * math.sin(0.25 * t)
        if i % FINE == 0:
            states.append(BodyState(x, y, yaw, speed, 0.0, rate, push, speed * rate))
        middle = t + 0.5 * dt
        speed = 1.2 * (1.0 - math.exp(-middle)) + 0.3 * math.sin(0.5 * middle)
        turn = (0.0 if straight else 0.4 * math.sin(0.25 * middle)) * dt
        x, y = (
            x + speed * dt * math.cos(yaw + 0.5 * turn),
            y + speed * dt * math.sin(yaw + 0.5 * turn),
        )
        yaw += turn
    return tuple(states)


@lru_cache(maxsize=4)
def preset(name: str) -> SensorParams:
    """A sensor preset."""
    return load_dataclass(SensorParams, Path(shipped("params") / "sensors" / f"{name}.yaml"))


def drive(seed: int, seconds: float, sensors: str = "white_noise", straight: bool = False) -> Drive:
    """Measure the motion with the sensors of a preset, under open sky and without latency."""
    params, truth = preset(sensors), true_motion(seconds, straight)
    wheels, unit, receiver = (
        WheelOdometry(params.odometry),
        InertialUnit(params.imu),
        GpsReceiver(params.gps, None),
    )
    for sensor, rng in zip(
        (wheels, unit, receiver), np.random.default_rng(seed).spawn(3), strict=True
    ):
        sensor.reset(truth[0], rng)
    observations = []
    for i, body in enumerate(truth):
        stamp = i / RATE
        fix = receiver.measure(body, NOBODY, stamp) if i % GPS_EVERY == 0 else None
        wheel, inertial = wheels.measure(body, NOBODY, stamp), unit.measure(body, NOBODY, stamp)
        observations.append(Observation(stamp, wheel, inertial, fix))
    return Drive(observations, list(truth))


@pytest.fixture(name="drive", scope="session")
def drive_fixture():
    """The function :func:`drive`."""
    return drive
