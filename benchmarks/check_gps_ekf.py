"""How well does the GPS-EKF know where it is, beside raw GPS and through outages, in our world?

Usage: python benchmarks/check_gps_ekf.py [--sensors NAME] [--count N] [--seed S] [--workers N]

Robots that know where they are (ground truth drives) make deliveries; the GPS-EKF, raw GPS and a GPS-EKF
that gets no fixes for the last 20 s of every 45 s listen to the same sensors. The error is that of the believed
position at every tick. Raw GPS is compared over all ticks, and over those at which its last fix is at most half a
second old, for between houses it stands still without one. An outage counts if it lasts 20 s and the robot drives 5 m
or more; what grows is the error, and the drift is the way that the believed position moves from the true one.
"""

import argparse
import dataclasses
from collections.abc import Iterator
from functools import partial
from typing import NamedTuple

import numpy as np

from harness.episode.factory import Parts, rules_of
from harness.execution.workers import Workers
from harness.task.study import EpisodeTask, make_study
from navstack.localization.gps import DEGRADED_AFTER, GpsLocalizer
from navstack.localization.gps_ekf import GpsEkfLocalizer
from navstack.localization.localizer import Localizer
from navstack.params.gps_ekf import GpsEkfParams
from navstack.types import Belief, Observation, Pose2D

PERIOD, OUTAGE = 45.0, 20.0  # [s] from outage to outage, and its length
SHORTEST = 5.0  # [m] that a robot drives in an outage that counts


class Outage(NamedTuple):
    """What became of the position in an outage."""

    distance: float  # [m] driven
    growth: float  # [m] of the error
    drift: float  # [m] between the errors before and after, as vectors


class Delivery(NamedTuple):
    """Errors [m] at every tick of a delivery, and its outages."""

    fused: np.ndarray
    raw: np.ndarray
    is_fresh: np.ndarray  # whether raw GPS had a fix of late
    outages: list[Outage]

    def ratio(self, ticks: np.ndarray | slice) -> float:
        """The error of raw GPS over that of the GPS-EKF, at some ticks."""
        return rms(self.raw[ticks]) / rms(self.fused[ticks])


def drive(task: EpisodeTask) -> Iterator[tuple[Observation, Pose2D]]:
    """Drive a delivery: what the robot observed at every tick, without scans, and where it was."""
    generators = task.generators()
    mission, rules = Parts(task).mission(generators["mission"]), rules_of(task.rules)
    world = Parts(task).world()
    brain = Parts(task).brain(world)
    observation = world.reset(mission, generators)
    brain.reset(
        mission.goal, Belief(mission.start), generators["planner"], generators["localizer"], generators["controller"]
    )
    while rules.judge(world.truth, mission.goal) is None:
        command = brain.tick(observation)
        yield dataclasses.replace(observation, scan=None), world.truth.pose
        observation = world.step(command)
    world.close_episode()


class Listener:
    """A localizer that only listens."""

    def __init__(self, localizer: Localizer, start: Pose2D) -> None:
        self._localizer = localizer
        localizer.reset(Belief(start), np.random.default_rng(0))

    def error(self, observation: Observation, truth: Pose2D) -> np.ndarray:
        """The error (2,) [m] of the believed position."""
        believed = self._localizer.update(observation).pose
        return np.array((believed.x - truth.x, believed.y - truth.y))


class OutageWatch:
    """Takes the fixes away now and then, and notes what that does."""

    def __init__(self, listener: Listener, start: Pose2D) -> None:
        self._listener, self._before, self._driven = listener, start, 0.0
        self._begun: tuple[float, float, np.ndarray] | None = None
        self._last = np.zeros(2)
        self.found: list[Outage] = []

    def watch(self, observation: Observation, truth: Pose2D) -> None:
        """One tick."""
        self._driven += float(np.hypot(truth.x - self._before.x, truth.y - self._before.y))
        self._before = truth
        is_out = observation.stamp % PERIOD >= PERIOD - OUTAGE
        if is_out and self._begun is None:
            self._begun = (observation.stamp, self._driven, self._last)
        if not is_out and self._begun is not None:
            stamp, driven, error = self._begun
            distance, self._begun = self._driven - driven, None
            if observation.stamp - stamp > OUTAGE - 0.5 and distance > SHORTEST:
                growth = float(np.linalg.norm(self._last) - np.linalg.norm(error))
                self.found.append(Outage(distance, growth, float(np.linalg.norm(self._last - error))))
        given = dataclasses.replace(observation, gps=None) if is_out else observation
        self._last = self._listener.error(given, truth)


def listen(task: EpisodeTask, params: GpsEkfParams) -> Delivery:
    """Make a delivery with everybody listening."""
    fused: list[float] = []
    raw: list[float] = []
    fresh: list[bool] = []
    watch, last = None, -np.inf
    for observation, truth in drive(task):
        if watch is None:
            watch = OutageWatch(Listener(GpsEkfLocalizer(params), truth), truth)
            ekf, gps = Listener(GpsEkfLocalizer(params), truth), Listener(GpsLocalizer(), truth)
        last = observation.gps.stamp if observation.gps is not None else last
        fused.append(float(np.linalg.norm(ekf.error(observation, truth))))
        raw.append(float(np.linalg.norm(gps.error(observation, truth))))
        fresh.append(observation.stamp - last <= DEGRADED_AFTER)
        watch.watch(observation, truth)
    return Delivery(np.array(fused), np.array(raw), np.array(fresh), watch.found if watch else [])


def summary(deliveries: list[Delivery]) -> str:
    """Deliveries in a few lines."""
    fused, raw, fresh = (np.concatenate([each[i] for each in deliveries]) for i in range(3))
    lines = [f"{len(deliveries)} deliveries, {len(fused)} ticks"]
    for name, which in (("all", np.ones(len(fused), dtype=bool)), ("with a fresh fix", fresh)):
        ratios = [each.ratio(each.is_fresh if name != "all" else slice(None)) for each in deliveries]
        lines.append(
            f"  ticks {name} ({which.mean():.0%}): RMS {rms(fused[which]):.3f} m, raw {rms(raw[which]):.3f} m, "
            f"ratio {rms(raw[which]) / rms(fused[which]):.2f} (median of deliveries {np.median(ratios):.2f}); "
            f"median {np.median(fused[which]):.3f} m, 95th percentile {np.percentile(fused[which], 95):.3f} m"
        )
    outages = [outage for each in deliveries for outage in each.outages]
    if outages:
        distance, growth, drift = np.array(outages).T
        low, high = interval(growth, distance)
        lines.append(
            f"  {len(outages)} outages of {OUTAGE:g} s, {distance.mean():.1f} m each: the error grows by "
            f"{growth.sum() / distance.sum():.2%} [{low:.2%}, {high:.2%}] of the distance, 95th percentile "
            f"{np.percentile(growth / distance, 95):.2%}; drift {drift.sum() / distance.sum():.2%}"
        )
    return "\n".join(lines)


def rms(errors: np.ndarray) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(errors**2)))


def interval(growth: np.ndarray, distance: np.ndarray) -> tuple[float, float]:
    """95 % interval of the share, outages drawn anew."""
    rng, count = np.random.default_rng(0), len(growth)
    drawn = rng.integers(count, size=(2000, count))
    shares = growth[drawn].sum(axis=1) / distance[drawn].sum(axis=1)
    return float(np.percentile(shares, 2.5)), float(np.percentile(shares, 97.5))


def missions(sensors: str, count: int, seed: int, workers: int) -> None:
    """Print how well the GPS-EKF knows where it is."""
    study = make_study(stacks=["nav2-gps-ekf"], localizer="ground_truth", sensors=sensors, episodes=count, seed=seed)
    params = Parts(next(study.tasks())).nav2.read(GpsEkfParams, "gps_ekf")
    deliveries = []
    with Workers(workers) as pool:
        for finished in pool.run(partial(listen, params=params), study.tasks()):
            if finished.result is None:
                print(f"delivery {finished.task.episode}: {finished.error}", flush=True)
                continue
            deliveries.append(finished.result)
            print(summary(deliveries), flush=True)


def main() -> None:
    """Read the arguments and check."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sensors", default="rtk_urban")
    parser.add_argument("--count", type=int, default=50)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--workers", type=int, default=1)
    arguments = parser.parse_args()
    missions(arguments.sensors, arguments.count, arguments.seed, arguments.workers)


if __name__ == "__main__":
    main()
