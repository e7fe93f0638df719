"""Policies in a file of their own, and stacks that they drive."""

from collections.abc import Callable
from pathlib import Path

import pytest

POLICIES = '''
import os
import socket
import sys
import time

import numpy as np


class Along:
    """Waypoints: the route."""

    def reset(self, seed):
        print("a policy may print")

    def act(self, seen):
        return seen.route[:6]


class Steer:
    """A velocity towards the route, less near things."""

    def reset(self, seed):
        pass

    def act(self, seen):
        x, y = seen.route[1]
        angle = np.arctan2(y, x)
        near = seen.ranges[np.abs(seen.angles) < 0.5].min() if len(seen.ranges) else 9.0
        speed = np.clip(near - 0.7, 0.0, 1.5) * max(np.cos(angle), 0.0)
        return np.clip(np.array((speed, 2.0 * angle)) / (3.56, 2.5), -1.0, 1.0) * (3.56, 2.5)


class Alone(Steer):
    """Takes a name that only one process can have, which its file holds."""

    def __init__(self, file):
        name = open(file).read()
        if name == "taken":
            raise OSError(name)
        self.socket = socket.socket(socket.AF_UNIX)
        self.socket.bind("\\0" + name)


class Crashes(Steer):
    def act(self, seen):
        if seen.stamp > 1.0:
            raise RuntimeError("out of ideas")
        return super().act(seen)


class Ends(Steer):
    def act(self, seen):
        if seen.stamp > 1.0:
            os._exit(7)
        return super().act(seen)


class Hangs(Steer):
    def act(self, seen):
        if seen.stamp > 1.0:
            time.sleep(1e6)
        return super().act(seen)


class Odd(Steer):
    def act(self, seen):
        return [1.0, 2.0, 3.0]


class Endless(Steer):
    def act(self, seen):
        return [float("nan"), 0.0]


class Far(Steer):
    def act(self, seen):
        return [[1e300, 1e300]]


class Unreadable(Steer):
    def act(self, seen):
        raise ValueError(os.fsdecode(b"weights-\\xff.bin"))


class Looks(Steer):
    """Drives where the picture of its camera is bright enough, and shows that it came over."""

    def act(self, seen):
        assert seen.image.shape == (30, 40, 3) and seen.image.dtype == np.uint8
        assert seen.image.max() > 0
        return super().act(seen) * (seen.image[20:].mean() > 1.0)


class Weighed(Steer):
    """Made with a file."""

    def __init__(self, file):
        self.gain = float(open(file).read())
'''
STACK = """title: "{name}"
navigator: policies.py:{name}
nav2_file: gps_ekf
localizer: ground_truth
planning_map: geometry
sensors: rtk_good
carries: [lidar, gps]
robot: segway_e1
policy: {{time_limit: {limit}{more}}}
"""
RULES = """arrival_radius: 2.0
timeout: 4.0
max_tilt: 0.5
impulse_health: 1000.0
spoiled_fraction: 0.1
"""


@pytest.fixture
def stack(tmp_path: Path) -> Callable[..., Path]:
    """Write a stack whose policy is a class of :data:`POLICIES`."""

    def write(name: str, limit: float = 60.0, more: str = "") -> Path:
        (tmp_path / "policies.py").write_text(POLICIES)
        (tmp_path / "rules.yaml").write_text(RULES)
        path = tmp_path / f"{name.lower()}.yaml"
        path.write_text(STACK.format(name=name, limit=limit, more=more))
        return path

    return write
