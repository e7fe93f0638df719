"""Does AMCL hold its position, and does it find itself? On a real building's scans, and in our world.

Usage: python benchmarks/check_amcl.py missions|kidnapped|offset|demo [--count N] [--seed S] [--workers N]

``missions``: deliveries with the localizer in the loop (``--stack``, default nav2-amcl; ``--sensors`` names another
preset than the stack's). The error is that of the believed position at every tick; a delivery is lost if it ends more
than 2 m wrong. A median along an axis that is not 0 is a bias that more particles do not take away.

``kidnapped``: AMCL listens while a robot that knows where it is makes a delivery. After 8 m AMCL is made to believe in
another pose, anywhere free on the map, as if somebody had carried it; recovery is on. It has found itself when it ends
within 0.5 m of the truth. Deliveries of less than 40 m after that do not count. With ``--uniform`` random particles are
drawn from anywhere, as in Nav2.

``offset``: AMCL without and with recovery, and AMCL with GPS (and recovery) listen while a robot that knows where it is
drives 40 m of a delivery; all three believe to start 5 m beside the true start, in any direction, as sure of it as of
any. Each has recovered when it ends within 0.5 m of the truth. ``--sensors`` names another preset than rtk_good.

``demo`` (needs NAVSTACK_DATA): see ``amcl_demo.py``.
"""

import argparse
import dataclasses
import os
from collections.abc import Iterator
from functools import lru_cache, partial
from pathlib import Path

import numpy as np
from amcl_demo import localize_globally

from harness.episode.factory import Parts, rules_of, scene_of
from harness.execution.workers import Workers
from harness.report.markdown import interval_text
from harness.statistics import bootstrap_mean, wilson_interval
from harness.task.stack import Stack, load_stack
from harness.task.study import EpisodeTask, make_study
from navstack.localization.amcl import AmclLocalizer
from navstack.localization.amcl_gps import AmclGpsLocalizer
from navstack.localization.free_space import FreeSpace
from navstack.params.amcl import AmclParams
from navstack.params.nav2_file.file import load_nav2
from navstack.params.nav2_file.views import read_amcl, read_amcl_gps
from navstack.types import Belief, Observation, Pose2D

NEAR = 0.5  # [m] of the truth: it has found itself
LOST = 2.0  # [m] from the truth
BEFORE, AFTER = 8.0, 40.0  # [m] that a robot drives until it is kidnapped, and at least from then on
OFFSET = 5.0  # [m] from the true start to the believed one
CANDIDATES = 100_000  # poses of which a scan picks the random particles
RECOVERY = {"recovery_alpha_slow": 0.001, "recovery_alpha_fast": 0.1}


def drive(task: EpisodeTask) -> Iterator[tuple[Observation, Pose2D, Pose2D]]:
    """Drive a delivery: what the brain saw at every tick, where the robot was and where it believed to be."""
    generators = task.generators()
    mission, rules = Parts(task).mission(generators["mission"]), rules_of(task.rules)
    world = Parts(task).world()
    brain = Parts(task).brain(world)
    observation = world.reset(mission, generators)
    brain.reset(
        mission.goal, Belief(mission.start), generators["planner"], generators["localizer"], generators["controller"]
    )
    try:
        while rules.judge(world.truth, mission.goal) is None:
            command, truth = brain.tick(observation), world.truth.pose
            assert brain.belief is not None
            yield observation, truth, brain.belief.pose
            observation = world.step(command)
    finally:
        world.close_episode()


def errors_of(task: EpisodeTask) -> np.ndarray:
    """How far the believed position is from the truth along the map's axes [m] at every tick of a delivery, (n, 2)."""
    return np.array([(believed.x - truth.x, believed.y - truth.y) for _, truth, believed in drive(task)])


def missions(count: int, seed: int, workers: int, stack: str, sensors: str | None) -> None:
    """Print how well a stack's localizer knows where it is."""
    study = make_study(stacks=[stack], sensors=sensors, episodes=count, seed=seed)
    errors, axes = [], []
    with Workers(workers) as pool:
        for finished in pool.run(errors_of, study.tasks()):
            if finished.result is None:
                print(f"delivery {finished.task.episode}: {finished.error}", flush=True)
                continue
            axes.append(np.median(finished.result, axis=0))
            errors.append(np.hypot(*finished.result.T))
            if errors[-1][-1] > LOST:
                print(f"delivery {finished.task.episode} is lost", flush=True)
            print(summary(errors), flush=True)
    if not axes:
        return
    for axis, medians in zip("xy", np.transpose(axes), strict=True):
        span = bootstrap_mean(medians, np.random.default_rng(0))
        print(f"along {axis}: mean over deliveries of the median {interval_text(span, 3)} m")


def summary(errors: list[np.ndarray]) -> str:
    """The errors of deliveries in one line."""
    pooled, lost = np.concatenate(errors), sum(each[-1] > LOST for each in errors)
    low, high = bootstrap(errors)
    return (
        f"{len(errors)} deliveries: median error {np.median(pooled):.3f} m, 95th percentile "
        f"{np.percentile(pooled, 95):.3f} [{low:.3f}, {high:.3f}] m, greatest {pooled.max():.2f} m, lost {lost}"
    )


def bootstrap(errors: list[np.ndarray]) -> tuple[float, float]:
    """95 % interval of the 95th percentile, deliveries drawn anew."""
    rng, found = np.random.default_rng(0), []
    thinned = [each[::30] for each in errors]
    for _ in range(500):
        chosen = rng.integers(len(errors), size=len(errors))
        found.append(np.percentile(np.concatenate([thinned[i] for i in chosen]), 95))
    return float(np.percentile(found, 2.5)), float(np.percentile(found, 97.5))


@lru_cache(maxsize=1)
def listener(params: AmclParams, map_name: str) -> AmclLocalizer:
    """An AMCL that only listens; made once per process."""
    return AmclLocalizer(params, scene_of(map_name).mapped_geometry)


@lru_cache(maxsize=1)
def free_space(map_name: str) -> FreeSpace:
    """Where on a map a robot may be set down."""
    return FreeSpace(scene_of(map_name).mapped_geometry)


def carry_away(localizer: AmclLocalizer, truth: Pose2D, there: np.ndarray) -> None:
    """Move the particles as one, so that what stood at the truth stands at another pose (3,)."""
    poses = localizer.particles.poses
    turn = there[2] - truth.yaw
    x, y = poses[:, 0] - truth.x, poses[:, 1] - truth.y
    poses[:, 0] = there[0] + np.cos(turn) * x - np.sin(turn) * y
    poses[:, 1] = there[1] + np.sin(turn) * x + np.cos(turn) * y
    poses[:, 2] += turn


def final_error(task: EpisodeTask, candidates: int) -> float | None:
    """The error [m] at the end of a delivery on the way of which AMCL was kidnapped; None: it is too short."""
    params = dataclasses.replace(read_amcl(Parts(task).nav2), recovery_candidates=candidates, **RECOVERY)
    localizer = listener(params, task.map_name)
    rng = np.random.default_rng((task.seed, task.episode))
    driven, before, kidnapped_at, believed = 0.0, None, None, Pose2D()
    for observation, truth, _ in drive(task):
        if before is None:
            localizer.reset(Belief(truth), rng)
        driven += distance(truth, before or truth)
        before = truth
        if kidnapped_at is None and driven > BEFORE:
            kidnapped_at = driven
            carry_away(localizer, truth, free_space(task.map_name).draw(1, rng)[0])
        believed = localizer.update(observation).pose
    if before is None or kidnapped_at is None or driven - kidnapped_at < AFTER:
        return None
    return distance(before, believed)


@lru_cache(maxsize=1)
def arms(stack: Stack, map_name: str) -> dict[str, AmclLocalizer]:
    """What is compared from a wrong start, by name."""
    nav2, grid = load_nav2(Path(stack.nav2_file)), scene_of(map_name).mapped_geometry
    params = dataclasses.replace(read_amcl(nav2), recovery_candidates=CANDIDATES, **RECOVERY)
    without = dataclasses.replace(params, recovery_candidates=0, recovery_alpha_slow=0.0, recovery_alpha_fast=0.0)
    return {
        "AMCL, recovery off": AmclLocalizer(without, grid),
        "AMCL, recovery on": AmclLocalizer(params, grid),
        "AMCL + GPS": AmclGpsLocalizer(params, read_amcl_gps(nav2), grid),
    }


def offset_errors(task: EpisodeTask) -> dict[str, float] | None:
    """The error [m] of each arm 40 m after a start 5 m off; None: the delivery is too short."""
    localizers, driven, before = arms(load_stack("nav2-amcl-gps"), task.map_name), 0.0, None
    beliefs: dict[str, Belief] = {}
    for observation, truth, _ in drive(task):
        if before is None:
            angle = np.random.default_rng((task.seed, task.episode)).uniform(-np.pi, np.pi)
            start = Pose2D(truth.x + OFFSET * np.cos(angle), truth.y + OFFSET * np.sin(angle), truth.yaw)
            for localizer in localizers.values():
                localizer.reset(Belief(start), np.random.default_rng((task.seed, task.episode, 1)))
        driven += distance(truth, before or truth)
        before = truth
        beliefs = {name: localizer.update(observation) for name, localizer in localizers.items()}
        if driven > AFTER:
            return {name: distance(truth, belief.pose) for name, belief in beliefs.items()}
    return None


def distance(a: Pose2D, b: Pose2D) -> float:
    """[m] between two poses."""
    return float(np.hypot(a.x - b.x, a.y - b.y))


def found(successes: int, count: int) -> str:
    """A share in words."""
    share = wilson_interval(successes, count)
    return f"found itself in {successes} of {count} ({share.value:.2f} [{share.low:.2f}, {share.high:.2f}])"


def kidnapped(count: int, seed: int, workers: int, candidates: int) -> None:
    """Print how often AMCL finds itself after it was carried away."""
    study = make_study(stacks=["nav2-gps"], localizer="ground_truth", episodes=4 * count, seed=seed)
    errors: list[float] = []
    with Workers(workers) as pool:
        for finished in pool.run(partial(final_error, candidates=candidates), study.tasks()):
            if finished.error:
                print(f"delivery {finished.task.episode}: {finished.error}", flush=True)
            if finished.result is None:
                continue
            errors.append(finished.result)
            share = found(sum(error < NEAR for error in errors), len(errors))
            print(f"delivery {finished.task.episode}: {errors[-1]:.2f} m wrong; {share}", flush=True)
            if len(errors) == count:
                return


def offset(count: int, seed: int, workers: int, sensors: str | None) -> None:
    """Print how often AMCL, without and with GPS, recovers from a wrong start."""
    study = make_study(stacks=["nav2-gps"], localizer="ground_truth", sensors=sensors, episodes=4 * count, seed=seed)
    errors: list[dict[str, float]] = []
    with Workers(workers) as pool:
        for finished in pool.run(offset_errors, study.tasks()):
            if finished.error:
                print(f"delivery {finished.task.episode}: {finished.error}", flush=True)
            if finished.result is None:
                continue
            errors.append(finished.result)
            wrong = ", ".join(f"{name} {error:.2f}" for name, error in errors[-1].items())
            print(f"delivery {finished.task.episode}: wrong by [m] {wrong}", flush=True)
            if len(errors) == count:
                break
    for name in errors[0]:
        of_arm = [each[name] for each in errors]
        print(f"{name}: {found(sum(error < NEAR for error in of_arm), count)}, median error {np.median(of_arm):.2f} m")


def main() -> None:
    """Read the arguments and check."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("missions", "kidnapped", "offset", "demo"))
    parser.add_argument("--count", type=int, default=50)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--stack", default="nav2-amcl", help="for missions")
    parser.add_argument("--sensors", help="preset of params/sensors, for missions and offset; default: the stack's")
    parser.add_argument("--uniform", action="store_true", help="random particles from anywhere, as in Nav2")
    arguments = parser.parse_args()
    if arguments.what == "missions":
        missions(arguments.count, arguments.seed, arguments.workers, arguments.stack, arguments.sensors)
    elif arguments.what == "kidnapped":
        kidnapped(arguments.count, arguments.seed, arguments.workers, 0 if arguments.uniform else CANDIDATES)
    elif arguments.what == "offset":
        offset(arguments.count, arguments.seed, arguments.workers, arguments.sensors)
    else:
        seeds = range(arguments.seed, arguments.seed + arguments.count)
        print(found(localize_globally(Path(os.environ["NAVSTACK_DATA"]), seeds), arguments.count))


if __name__ == "__main__":
    main()
