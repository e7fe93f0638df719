"""One delivery, from a task to its rows."""

import math
import time
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from harness.economics.prices import Prices, load_prices
from harness.injury import injury_cost
from harness.metrics import DeliveryLog, Row, event_rows
from harness.mission import Mission, MissionSampler
from harness.outcome import Rules, Verdict
from harness.stack import Stack
from harness.study import EpisodeTask, Study
from harness.truth import Partner, Truth
from harness.world.ground_truth import GroundTruthLocalizer
from harness.world.pybullet_world import PyBulletWorld, build_world
from harness.world.scene import Scene
from harness.world.scene_io import load_scene
from harness.world.world import World
from navstack.behavior_tree import Counts, Status
from navstack.build import build_localizer, build_navigator
from navstack.costmap.occupancy_grid import FREE
from navstack.errors import NavstackError
from navstack.navigator import Navigator
from navstack.params.nav2_file import Nav2File, load_nav2
from navstack.params.strict import load_dataclass
from navstack.types import Belief, BoolArray, Observation, Pose2D, Twist2D

PARKED_TICK = 0.05  # [s] of a robot that does not drive


class Brain(Protocol):
    """What drives: a navigator, or nobody."""

    belief: Belief

    def reset(self, goal: Pose2D, initial_belief: Belief) -> None:
        """Start a delivery."""

    def tick(self, observation: Observation) -> Twist2D:
        """The command until the next tick."""


class Parked:
    """Never moves: what other people's walking costs."""

    def __init__(self) -> None:
        self.belief = Belief(Pose2D())

    def reset(self, goal: Pose2D, initial_belief: Belief) -> None:
        """Stay where the delivery starts."""
        self.belief = initial_belief

    def tick(self, observation: Observation) -> Twist2D:
        """Standstill."""
        return Twist2D()
