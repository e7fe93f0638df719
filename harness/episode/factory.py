"""From a task to a world and a brain; what belongs to a map is made once per process."""

import contextlib
import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from harness.episode.brains import (
    delivery_prices,
    navigator_on,
    planning_map,
    senses_on,
    steps_per_tick,
)
from harness.episode.files import (
    nav2_parameters,
    prices_of,
    robot_of,
    rules_of,
    world_params,
)
from harness.episode.places import place_of
from harness.episode.wall_time import on_wall_time
from harness.execution.process_cache import kept
from harness.policy.brain import PolicyBrain
from harness.policy.process import PolicyProcess
from harness.policy.senses import Senses
from harness.policy.waypoints import WaypointFollower
from harness.task.brain import Brain, Parked
from harness.task.mission import (
    SAMPLINGS,
    Mission,
    MissionSampler,
    check_apart,
    check_footprint_free,
    check_pose_free,
)
from harness.task.stack import ROS2, Stack
from harness.task.study import EpisodeTask
from harness.world.map.scene import Scene
from harness.world.map.scene_io import load_scene
from harness.world.people.models import make_pedestrians
from harness.world.people.params import PedestrianParams, people_on
from harness.world.people.pedestrians import PedestrianModel
from harness.world.pybullet_world import PyBulletWorld
from harness.world.sensors.suite import SensorParams, SensorSuite
from harness.world.world import World
from navstack.errors import InputError
from navstack.navigator import Navigator
from navstack.params.expected_cost import DeliveryPrices
from navstack.params.nav2_file.file import Nav2File
from navstack.params.strict import load_dataclass
from navstack.types import FloatArray, Pose2D

if TYPE_CHECKING:
    from harness.street.missions import Leg

# of a mission that is over before it begins, or whose given end the drawn one does not reach
REDRAWS = 50
BRAINS_KEPT = 2  # by a process: a third stack in turn would be made anew for each delivery
PARKED_STEPS = 6  # physics steps per tick of a robot that does not drive


@kept(2)
def scene_of(place: "str | Leg") -> Scene:
    """The scene of a map, or of the part of a district around a leg."""
    if isinstance(place, str):
        return load_scene(place)
    return place.scene()


@kept(2)
def _missions_on(place: "str | Leg", sampling: str) -> MissionSampler:
    scene = scene_of(place)
    if not isinstance(place, str):
        sampling = SAMPLINGS[0]  # a leg's ends are given
    return MissionSampler(scene.navigation_mesh, sampling, scene.walkable)


class Parts:
    """What a delivery is made of.

    Files are read, and world and brain built, once per process for tasks that differ in seed and
    episode only.
    """

    def __init__(self, task: EpisodeTask) -> None:
        """Read the files of a task.

        Raises:
            NavstackError: one of them cannot be used.
        """
        stack = task.stack
        self._task = task
        self._place = place_of(task)
        self.scene = scene_of(self._place)
        self.robot = robot_of(stack.robot)
        self.params = world_params(task.world, task.pedestrians, task.people)
        self._pedestrians = task.pedestrians
        if not isinstance(self._place, str) and self.params.people.model != "replay":
            self._pedestrians = people_on(self.scene.navigation_mesh, self.params.people.count)
            self.params = world_params(task.world, self._pedestrians, task.people)
        self.rules = rules_of(task.rules)
        if not isinstance(self._place, str):
            self.rules = self.rules.on_way(self._place.way)
        self.prices = prices_of(task.prices)
        self._nav2: Nav2File | None = None
        if stack.nav2_file:
            self._nav2 = nav2_parameters(stack.nav2_file, task.allow_unknown)

    @property
    def nav2(self) -> Nav2File:
        """The parameter file of a stack that drives."""
        if self._nav2 is None:
            raise ValueError(f"stack '{self._task.stack.name}' has no Nav2 file")
        return self._nav2

    def mission(self, rng: np.random.Generator) -> Mission:
        """The delivery to make: drawn, with the poses that the user gave put in their place.

        Raises:
            InputError: a given pose is not on walkable ground, or no path connects start and goal.
        """
        task, scene = self._task, self.scene
        sampler = _missions_on(self._place, task.missions)
        if not isinstance(self._place, str):
            return sampler.mission(self._place.start, self._place.goal)
        for what, given in (("start", task.start), ("goal", task.goal)):
            if given is not None:
                check_pose_free(scene.walkable, given, what)
        if task.start is not None:
            check_footprint_free(scene.geometry, task.start, self.robot.polygon)
        radius = self.rules.arrival_radius
        if task.start is not None and task.goal is not None:
            check_apart(task.start, task.goal, radius)
            return sampler.mission(task.start, task.goal)
        is_drawn = task.start is None and task.goal is None
        for _ in range(REDRAWS):
            drawn = sampler.sample(rng)
            start, goal = task.start or drawn.start, task.goal or drawn.goal
            # too near, or the drawn end lies in another part of the map
            with contextlib.suppress(InputError):
                check_apart(start, goal, radius)
                return drawn if is_drawn else sampler.mission(start, goal)
        raise InputError(
            f"none of {REDRAWS} missions drawn on this map has start and goal more than "
            f"{radius:g} m apart, or "
            "connects to the pose given; choose a larger map or part of it, or give both --start "
            "and --goal"
        )

    def world(self) -> PyBulletWorld:
        """The world, to be reset; the process has one for all tasks that are alike."""
        if not isinstance(self._place, str):
            return self.new_world()  # no leg is driven twice
        return _world(*self._world_key())

    def new_world(self, people: PedestrianModel | None = None) -> PyBulletWorld:
        """A world of its own, to be reset, and to be closed by the caller.

        Args:
            people: who walks about in it; None: those of the task's world.
        """
        return _make_world(*self._world_key(), people)

    def people(self) -> PedestrianModel:
        """The people of the task's world once more, to be reset; no world has them."""
        return make_pedestrians(self.params.people, self.scene.navigation_mesh, self.robot)

    def _world_key(self) -> "tuple[str | Leg, str, str, str, int | None, str | None, int]":
        """The arguments of :func:`_make_world`."""
        task, stack, steps = self._task, self._task.stack, PARKED_STEPS
        if stack.nav2_file:
            rate = self.params.physics.rate
            steps = _steps_per_tick_of(stack.nav2_file, task.allow_unknown, rate)
        if stack.is_policy:
            steps = math.gcd(steps, max(int(rate / stack.policy.rate), 1))
        return (
            self._place,
            task.world,
            stack.robot,
            stack.sensors,
            self._pedestrians,
            task.people,
            steps,
        )

    def senses(self, world: World) -> Senses:
        """What a policy of the task's stack sees, to be reset."""
        return senses_on(self.scene, world, self._task.stack, self.nav2, self.params.people)

    def brain(self, world: World) -> Brain:
        """The brain, to be reset."""
        task = self._task
        if task.stack.navigator == ROS2:
            return _ros2_brain(world, self._place, task.stack)
        if not task.stack.nav2_file:
            return Parked()
        if task.stack.is_policy:
            brain = _policy_brain(
                world, self._place, task.stack, task.allow_unknown, self.params.people
            )
            brain.load()
            return brain
        factor = self.rules.real_time_factor
        given = world, self._place, task.stack, task.allow_unknown, self._delivery_prices, factor
        if isinstance(self._place, str):
            return _navigator(*given)
        return _make_navigator(*given)

    def navigator_by(self, nav2: Nav2File, world: World) -> Navigator:
        """The brain by another Nav2 file than the stack's."""
        return navigator_on(
            self.scene,
            world,
            self._task.stack,
            on_wall_time(nav2, self.rules.real_time_factor),
            self._delivery_prices,
        )

    @property
    def _delivery_prices(self) -> DeliveryPrices:
        return delivery_prices(self.prices, self.rules, self.params.contacts.counted_impulse)


def _make_world(
    place: "str | Leg",
    world: str,
    robot: str,
    sensors: str,
    pedestrians: int | None,
    people: str | None,
    steps_per_tick: int,
    walking: PedestrianModel | None = None,
) -> PyBulletWorld:
    scene, params = scene_of(place), world_params(world, pedestrians, people)
    if walking is None:
        walking = make_pedestrians(params.people, scene.navigation_mesh, robot_of(robot))
    return PyBulletWorld(
        scene,
        robot_of(robot),
        params,
        walking,
        SensorSuite(load_dataclass(SensorParams, Path(sensors)), scene, params.people.radius),
        steps_per_tick,
    )


_world = kept(BRAINS_KEPT, is_heavy=True)(_make_world)


@kept(8)
def _steps_per_tick_of(nav2_file: str, allow_unknown: bool, rate: float) -> int:
    return steps_per_tick(nav2_parameters(nav2_file, allow_unknown), rate)


def _make_navigator(
    world: World,
    place: "str | Leg",
    stack: Stack,
    allow_unknown: bool,
    prices: DeliveryPrices,
    real_time_factor: float,
) -> Navigator:
    nav2 = on_wall_time(nav2_parameters(stack.nav2_file, allow_unknown), real_time_factor)
    return navigator_on(scene_of(place), world, stack, nav2, prices)


_navigator = kept(BRAINS_KEPT, is_heavy=True)(_make_navigator)


@kept(1)
def _ros2_brain(world: World, place: "str | Leg", stack: Stack) -> Brain:
    """A node for each process: who drives is elsewhere."""
    from harness.ros2.install import require_ros2

    require_ros2()
    from harness.ros2.brain import Ros2Brain
    from harness.ros2.robot import RobotNode

    def what_is() -> tuple[Pose2D, FloatArray]:
        return world.truth.pose, world.truth.pedestrians

    def robot() -> RobotNode:
        return RobotNode(stack.ros2, planning_map(scene_of(place), stack)[0])

    return Ros2Brain(robot, stack.ros2, what_is)


@kept(2, is_heavy=True)
def _policy_brain(
    world: World,
    place: "str | Leg",
    stack: Stack,
    allow_unknown: bool,
    persons: PedestrianParams,
) -> PolicyBrain:
    """A stack's policy, to be loaded."""
    senses = senses_on(
        scene_of(place), world, stack, nav2_parameters(stack.nav2_file, allow_unknown), persons
    )
    policy = PolicyProcess(stack.navigator, stack.policy)
    return PolicyBrain(senses, stack.policy.rate, policy, WaypointFollower(stack.policy.speed))
