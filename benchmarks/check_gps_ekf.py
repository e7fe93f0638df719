"""How well does the GPS-EKF know where it is, beside raw GPS and through outages, in our world?

Usage: python benchmarks/check_gps_ekf.py [--sensors NAME] [--count N] [--seed S] [--workers N]

Robots that know where they are (ground truth drives) make deliveries; the GPS-EKF, raw GPS and a GPS-EKF
that gets no fixes for the last 20 s of every 45 s listen to the same sensors. The error is that of the believed
position at every tick. Raw GPS is compared over all ticks, and over those at which its last fix is at most half a
second old, for between houses it stands still without one. An outage counts if it lasts 20 s and the robot drives 5 m
or more; what grows is the error, and the drift is the way that the believed position moves from the true one.
"""

import dataclasses
from collections.abc import Iterator
from functools import partial
from typing import NamedTuple

import numpy as np
from options import parsed

from harness.episode.factory import Parts, rules_of
from harness.execution.workers import Workers
from harness.task.study import EpisodeTask, make_study, of_brain
from navstack.localization.gps import DEGRADED_AFTER, GpsLocalizer
from navstack.localization.gps_ekf import GpsEkfLocalizer
from navstack.localization.localizer import Localizer
from navstack.params.gps_ekf import GpsEkfParams
from navstack.types import Belief, Observation, Pose2D

PERIOD, OUTAGE = 45.0, 20.0  # [s] from outage to outage, and its length
SHORTEST = 5.0  # [m] that a robot drives in an outage that counts


class Delivery(NamedTuple):
    """Errors [m] at every tick of a delivery, and its outages."""

    fused: np.ndarray
    raw: np.ndarray
    is_fresh: np.ndarray  # whether raw GPS had a fix of late
    outages: np.ndarray  # (n, 3) [m] driven, by which the error grew, and between the errors before and after

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
    brain.reset(mission.goal, Belief(mission.start), of_brain(generators))
    while rules.judge(world.truth, mission.goal) is None:
        command = brain.tick(observation)
        yield dataclasses.replace(observation, scan=None), world.truth.pose
        observation = world.step(command)
    world.close_episode()


def listen(task: EpisodeTask, params: GpsEkfParams) -> Delivery:
    """Make a delivery with everybody listening."""
    listeners: list[Localizer] = [GpsEkfLocalizer(params), GpsLocalizer(), GpsEkfLocalizer(params)]
    rows: list[tuple[float, ...]] = []
    for observation, truth in drive(task):
        if not rows:
            for each in listeners:
                each.reset(Belief(truth), np.random.default_rng(0))
        cut_off = dataclasses.replace(observation, gps=None) if is_out(observation.stamp) else observation
        heard = zip(listeners, (observation, observation, cut_off), strict=True)
        poses = [listener.update(given).pose for listener, given in heard]
        fix = observation.gps.stamp if observation.gps is not None else -np.inf
        rows.append(
            (observation.stamp, fix, truth.x, truth.y, *(number for pose in poses for number in (pose.x, pose.y)))
        )
    stamps, fixes, *_ = table = np.array(rows).T
    errors = table[4:].T.reshape(-1, 3, 2) - table[2:4].T[:, None]
    fused, raw, _ = np.linalg.norm(errors, axis=2).T
    is_fresh = stamps - np.maximum.accumulate(fixes) <= DEGRADED_AFTER
    return Delivery(fused, raw, is_fresh, outages(stamps, table[2:4], errors[:, 2]))


def is_out(stamps: float | np.ndarray) -> bool | np.ndarray:
    """Whether fixes are taken away then."""
    return stamps % PERIOD >= PERIOD - OUTAGE


def outages(stamps: np.ndarray, places: np.ndarray, errors: np.ndarray) -> np.ndarray:
    """The outages that count, as :class:`Delivery` has them, from true places (2, T) and errors (T, 2)."""
    driven = np.concatenate(([0.0], np.hypot(*np.diff(places)).cumsum()))
    edges = np.flatnonzero(np.diff(is_out(stamps).astype(int))) + 1  # a delivery begins without one
    begins, ends = edges[: len(edges) // 2 * 2].reshape(-1, 2).T
    before, after = errors[begins - 1], errors[ends - 1]
    growth = np.linalg.norm(after, axis=1) - np.linalg.norm(before, axis=1)
    distances = driven[ends] - driven[begins]
    counts = (stamps[ends] - stamps[begins] > OUTAGE - 0.5) & (distances > SHORTEST)
    return np.column_stack((distances, growth, np.linalg.norm(after - before, axis=1)))[counts]


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
    found = np.concatenate([each.outages for each in deliveries])
    if len(found):
        distance, growth, drift = found.T
        low, high = interval(growth, distance)
        lines.append(
            f"  {len(found)} outages of {OUTAGE:g} s, {distance.mean():.1f} m each: the error grows by "
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
    study = make_study(
        stacks=["nav2-gps-ekf"], localizer="ground_truth", sensors=sensors, episodes=count, seed=seed, world="easy"
    )
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
    missions(**vars(parsed(__doc__, sensors="rtk_urban", count=50, seed=0, workers=1)))


if __name__ == "__main__":
    main()
