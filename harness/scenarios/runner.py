"""Drives a scenario in the physical world."""

import dataclasses
import math
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from harness.episode.brains import navigator_on, steps_per_tick
from harness.episode.episode import OF_THE_MACHINE
from harness.episode.files import nav2_parameters, robot_of, world_params
from harness.metrics.encounters import Body, in_base_frame, surface_distances
from harness.scenarios.actors import ScriptedPedestrians
from harness.scenarios.checks import CheckResult, ScenarioDrive, judge
from harness.scenarios.drawing import draw_scene, with_things
from harness.scenarios.scenario import Scenario, load_scenario
from harness.storage.shipped import resolve, shipped
from harness.storage.texts import clean_text
from harness.task.mission import Mission, check_apart, check_footprint_free, check_pose_free
from harness.task.stack import load_stack
from harness.task.study import RandomStreams, brain_rngs
from harness.world.map.scene import Scene
from harness.world.map.scene_io import load_scene
from harness.world.outcome import ARRIVALS, Rules
from harness.world.physics.robot import RobotParams
from harness.world.pybullet_world import PyBulletWorld
from harness.world.sensors.suite import SensorParams, SensorSuite
from navstack.errors import (
    InputError,
    NavstackError,
    ParameterError,
    PluginError,
    UnknownNameError,
)
from navstack.navigation_status import Status
from navstack.navigator import Navigator
from navstack.params.strict import load_dataclass
from navstack.types import Belief, FloatArray, Pose2D

AFTERMATH = 1.0  # [s] that is still driven after the navigator gave up


@dataclass(frozen=True, slots=True)
class Result:
    """What became of a scenario."""

    path: Path
    scenario: Scenario
    findings: tuple[CheckResult, ...]
    duration: float  # [s] simulated

    @property
    def holds(self) -> bool:
        """Whether every check holds."""
        return all(finding.holds for finding in self.findings)

    @property
    def as_expected(self) -> bool:
        """Whether it passed, or failed in nothing but what its file knows.

        What is known to fail and passes is not.
        """
        failed = {finding.check for finding in self.findings if not finding.holds}
        return failed <= set(self.scenario.fails) and bool(failed) == bool(self.scenario.fails)


def run_scenario(path: Path) -> Result:
    """Drive a scenario file and judge it.

    Raises:
        InputError: the file, or something that it names, cannot be used.
    """
    scenario = load_scenario(path)
    try:
        drive = _drive(scenario, path)
    except NavstackError as error:
        if str(path) in str(error):
            raise
        raise InputError(f"{path}: {error}") from None
    return Result(path, scenario, judge(drive, scenario.checks), float(drive.times[-1]))


def _drive(scenario: Scenario, path: Path) -> ScenarioDrive:
    stack = load_stack(_beside(path, scenario.stack))
    if not stack.is_nav2:
        raise ParameterError(
            f"{path}: stack '{scenario.stack}' has no Nav2 navigator; give one that has"
        )
    known = _scene(scenario, path)
    mapped = with_things(known, tuple(thing for thing in scenario.things if thing.on_map))
    real = with_things(known, scenario.things)
    grounds = {zone.kind for zone in real.zones}
    for kind in scenario.checks.stays_off:
        if kind not in grounds:
            raise UnknownNameError(f"ground of {path}", kind, grounds)
    robot, nav2 = robot_of(stack.robot), nav2_parameters(stack.nav2_file, True)
    params = world_params(
        str(resolve(_beside(path, scenario.world), shipped("params") / "worlds", "world")), None
    )
    check_pose_free(real.walkable, scenario.start, "start")
    check_footprint_free(real.geometry, scenario.start, robot.polygon)
    people = ScriptedPedestrians(scenario.people)
    preset = load_dataclass(SensorParams, Path(stack.sensors))
    outages = (*preset.gps.outages, *scenario.gps_outages)
    preset = dataclasses.replace(preset, gps=dataclasses.replace(preset.gps, outages=outages))
    sensors = SensorSuite(preset, real, params.people.radius)
    world = PyBulletWorld(
        real,
        robot,
        params,
        people,
        sensors,
        steps_per_tick(nav2, params.physics.rate),
    )
    try:
        with _told():
            navigator = navigator_on(mapped, world, stack, nav2)
        return _deliver(scenario, real, world, navigator, robot, params.people.radius)
    finally:
        world.close()


@contextmanager
def _told() -> Iterator[None]:
    """Tell what algorithms of other packages raise in one line.

    Raises:
        PluginError: they raised something.
    """
    try:
        yield
    except (NavstackError, *OF_THE_MACHINE):
        raise
    except Exception as error:
        raise PluginError(clean_text(f"{type(error).__name__}: {error}")) from error


def _scene(scenario: Scenario, path: Path) -> Scene:
    if scenario.drawing is not None:
        return draw_scene(scenario.drawing, path.stem)
    return load_scene(_beside(path, str(scenario.map)))


def _beside(path: Path, name: str) -> str:
    """A file beside the scenario's by its path, anything else as it is: a built-in name."""
    beside = path.parent / name
    if os.path.isfile(beside):
        return str(beside)
    return name


def _deliver(
    scenario: Scenario,
    scene: Scene,
    world: PyBulletWorld,
    navigator: Navigator,
    robot: RobotParams,
    radius: float,
) -> ScenarioDrive:
    rules = load_dataclass(Rules, shipped("params") / "rules" / "costnav.yaml")
    rules = dataclasses.replace(rules, timeout=scenario.time_limit)
    check_apart(scenario.start, scenario.goal, rules.arrival_radius)
    generators = RandomStreams(scenario.seed, 0)
    observation = world.reset(Mission(scenario.start, scenario.goal, 0.0), generators)
    with _told():
        navigator.reset(scenario.goal, Belief(scenario.start), brain_rngs(generators))
    body = Body(robot.center, robot.half_size, radius)
    rows: list[tuple[float, ...]] = []
    end = math.inf  # [s] when the aftermath of giving up is over
    while (verdict := rules.judge(world.truth, scenario.goal)) is None and world.stamp < end:
        with _told():
            command = navigator.tick(observation)
        truth = world.truth
        error = 0.0
        if navigator.belief:
            believed = navigator.belief.pose
            error = math.hypot(believed.x - truth.pose.x, believed.y - truth.pose.y)
        observation = world.step(command)
        truth = world.truth
        pose = (truth.pose.x, truth.pose.y, truth.pose.yaw)
        rows.append((truth.stamp, *pose, _distance(truth.pose, truth.pedestrians, body), error))
        if navigator.status is Status.FAILED and end == math.inf:
            end = world.stamp + AFTERMATH
    table = np.array(rows)
    return ScenarioDrive(
        scene=scene,
        feet=np.array(robot.feet),
        times=table[:, 0],
        poses=table[:, 1:4],
        distances=table[:, 4],
        errors=table[:, 5],
        truth=world.close_episode(),
        arrived=verdict is not None and verdict.outcome in ARRIVALS,
        gave_up=navigator.status is Status.FAILED,
        error=navigator.trouble.error,
    )


def _distance(pose: Pose2D, people: FloatArray, body: Body) -> float:
    """Between the surfaces of the robot and of the nearest person, in [m]; inf: nobody is there."""
    present = people[np.isfinite(people[:, 0])]
    if not len(present):
        return math.inf
    robot = np.tile((0.0, pose.x, pose.y, pose.yaw), (len(present), 1))
    return float(surface_distances(in_base_frame(robot, present), body).min())
