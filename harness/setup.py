"""From a task to a world and a brain; what belongs to a map is made once per process."""

import contextlib
import dataclasses
import math
from functools import lru_cache
from pathlib import Path
from typing import Protocol

import numpy as np

from harness.economics.prices import Prices, load_prices
from harness.mission import Mission, MissionSampler, check_apart, check_footprint_free, check_pose_free
from harness.outcome import Rules
from harness.study import EpisodeTask
from harness.world.ground_truth import GroundTruthLocalizer
from harness.world.pedestrians import RandomWalkPedestrians
from harness.world.pybullet_world import PyBulletWorld
from harness.world.robot import RobotParams
from harness.world.scene import Scene
from harness.world.scene_io import load_scene
from harness.world.sensors import SensorParams, SensorSuite
from harness.world.world import World
from harness.world.world_params import WorldParams
from navstack.behavior_tree import Counts, Status
from navstack.build import build_localizer, build_navigator, read_frequencies
from navstack.costmap.occupancy_grid import FREE
from navstack.errors import InputError
from navstack.localization.localizer import Localizer
from navstack.navigator import Navigator
from navstack.params.nav2_file import Nav2File, load_nav2
from navstack.params.strict import load_dataclass
from navstack.types import Belief, Observation, Pose2D, Twist2D

REDRAWS = 50  # of a mission of which the user gave one end
PARKED_STEPS = 6  # physics steps per tick of a robot that does not drive


class Brain(Protocol):
    """What drives: a navigator, or nobody."""

    @property
    def belief(self) -> Belief | None:
        """Where it believes the robot to be; None: it does not localize."""

    @property
    def status(self) -> Status:
        """How the navigation stands."""

    @property
    def counts(self) -> Counts:
        """Plans, failures and recoveries so far."""

    @property
    def last_error(self) -> str:
        """Nav2's name of the last failure that called for a recovery; empty: none."""

    def reset(self, goal: Pose2D, initial_belief: Belief, rng: np.random.Generator) -> None:
        """Start a delivery; all chance in planning is drawn from ``rng``."""

    def tick(self, observation: Observation) -> Twist2D:
        """The command until the next tick."""


class Parked:
    """Never moves: what other people's walking costs."""

    status = Status.RUNNING
    last_error = ""
    belief = None

    def __init__(self) -> None:
        self.counts = Counts()

    def reset(self, goal: Pose2D, initial_belief: Belief, rng: np.random.Generator) -> None:
        """Stay where the delivery starts."""

    def tick(self, observation: Observation) -> Twist2D:
        """Standstill."""
        return Twist2D()


@lru_cache(maxsize=2)
def scene_of(map_name: str) -> Scene:
    """The scene of a map."""
    return load_scene(map_name)


@lru_cache(maxsize=2)
def _missions_on(map_name: str) -> MissionSampler:
    return MissionSampler(scene_of(map_name).walkable)


@lru_cache(maxsize=8)
def nav2_parameters(path: str, allow_unknown: bool) -> Nav2File:
    """A Nav2 parameter file, read and checked."""
    return load_nav2(Path(path), allow_unknown)


@lru_cache(maxsize=2)
def prices_of(path: str) -> Prices:
    """The prices of a study."""
    return load_prices(path)


@lru_cache(maxsize=2)
def rules_of(path: str) -> Rules:
    """The rules by which deliveries end."""
    return load_dataclass(Rules, Path(path))


def mission_of(task: EpisodeTask, rng: np.random.Generator) -> Mission:
    """The delivery to make: drawn, with the poses that the user gave put in their place.

    Raises:
        InputError: a given pose is not on walkable ground, or no path connects start and goal.
    """
    sampler, scene = _missions_on(task.map_name), scene_of(task.map_name)
    for what, given in (("start", task.start), ("goal", task.goal)):
        if given is not None:
            check_pose_free(scene.walkable, given, what)
    if task.start is not None:
        check_footprint_free(scene.geometry, task.start, robot_of(task.stack.robot).polygon)
    if task.start is not None and task.goal is not None:
        check_apart(task.start, task.goal, rules_of(task.rules).arrival_radius)
        return sampler.mission(task.start, task.goal)
    if task.start is None and task.goal is None:
        return sampler.sample(rng)
    for _ in range(REDRAWS):
        drawn = sampler.sample(rng)
        with contextlib.suppress(InputError):  # the drawn end lies in another part of the map
            return sampler.mission(task.start or drawn.start, task.goal or drawn.goal)
    raise InputError(
        f"none of {REDRAWS} missions drawn on this map connects to the pose given; "
        "choose it in a larger part of the map, or give both --start and --goal"
    )


def build_world(task: EpisodeTask) -> PyBulletWorld:
    """The world of a task, to be reset; made once per process for tasks that differ in seed and episode only."""
    return _world(
        task.map_name,
        task.world,
        task.stack.robot,
        task.stack.sensors,
        task.pedestrians,
        _steps_per_tick(task),
    )


@lru_cache(maxsize=2)
def _world(
    map_name: str, world: str, robot: str, sensors: str, pedestrians: int | None, steps_per_tick: int
) -> PyBulletWorld:
    scene, params = scene_of(map_name), world_params(world, pedestrians)
    return PyBulletWorld(
        scene,
        robot_of(robot),
        params,
        RandomWalkPedestrians(params.people, scene.walkable),
        SensorSuite(load_dataclass(SensorParams, Path(sensors)), scene.geometry, params.people.radius),
        steps_per_tick,
    )


@lru_cache(maxsize=2)
def world_params(path: str, pedestrians: int | None) -> WorldParams:
    """A world's parameters, with the number of people that the user asked for (None: the world's own)."""
    params = load_dataclass(WorldParams, Path(path))
    if pedestrians is None:
        return params
    return dataclasses.replace(params, people=dataclasses.replace(params.people, count=pedestrians))


@lru_cache(maxsize=2)
def robot_of(path: str) -> RobotParams:
    """The robot of a stack."""
    return load_dataclass(RobotParams, Path(path))


def _steps_per_tick(task: EpisodeTask) -> int:
    """The longest tick, in physics steps, at whose end every part of the brain can run when it is due."""
    if not task.stack.nav2_file:
        return PARKED_STEPS
    rate = world_params(task.world, task.pedestrians).physics.rate
    periods = [rate / frequency for frequency in read_frequencies(nav2_of(task))]
    if any(abs(period - round(period)) > 1e-6 or period < 1.0 for period in periods):
        return 1  # some part fits no whole number of steps: it runs at the first step after it is due
    return math.gcd(*(round(period) for period in periods))


def build_brain(task: EpisodeTask, world: World) -> Brain:
    """The brain of a task, to be reset; made once per process for tasks that differ in seed and episode only."""
    if not task.stack.nav2_file:
        return Parked()
    stack = task.stack
    return _navigator(world, task.map_name, stack.planning_map, stack.localizer, stack.nav2_file, task.allow_unknown)


@lru_cache(maxsize=2)
def _navigator(
    world: World, map_name: str, planning_map: str, localizer_name: str, nav2_file: str, allow_unknown: bool
) -> Navigator:
    scene, nav2 = scene_of(map_name), nav2_parameters(nav2_file, allow_unknown)
    if localizer_name == "ground_truth":
        localizer: Localizer = GroundTruthLocalizer(lambda: world.truth.pose)
    else:
        localizer = build_localizer(localizer_name)
    if planning_map == "navigation_mesh":
        return build_navigator(nav2, localizer, scene.walkable, None)
    return build_navigator(nav2, localizer, scene.geometry, scene.walkable.data != FREE)


def nav2_of(task: EpisodeTask) -> Nav2File:
    """The parameter file of a task's stack."""
    return nav2_parameters(task.stack.nav2_file, task.allow_unknown)
