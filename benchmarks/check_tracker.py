"""How well people are tracked, by one model of how they walk and by two: both listen to the same deliveries.

Usage: python benchmarks/check_tracker.py [--episodes N] [--seed S] [--pedestrians N] [--map NAME]

``evasive-gps-ekf`` drives in the world ``published``. A person counts who is within 8 m of the lidar and in line of
sight: the beam next to the person's centre ends on that person. A track is a person's if it is less than 0.5 m away,
assigned so that the sum of distances is least; precision counts tracks near anybody. A turn is a change of somebody's
direction by 45 degrees or more within 0.5 s; its delay ends when a track at the person has the new velocity to 0.5 m/s.
Intervals: bootstrap over deliveries.
"""

import dataclasses
import math
from collections import deque
from pathlib import Path
from typing import Any

import numpy as np
from options import parsed
from scipy.optimize import linear_sum_assignment

from harness.episode.episode import run_episode
from harness.episode.factory import Parts
from harness.task.study import make_study
from harness.world.lidar import Lidar
from harness.world.sensors import SensorParams
from navstack.geometry import compose
from navstack.params.strict import load_dataclass
from navstack.params.tracker import TrackerParams
from navstack.perception.tracker import Tracker
from navstack.types import BoolArray, FloatArray, Observation, Pose2D, Track

REACH, NEAR = 8.0, 0.5  # [m] up to which people count; between a track and its person
TURN, WITHIN = math.radians(45.0), 5  # a turn, and scans within which it is made
KNOWN, PATIENCE = 0.5, 20  # [m/s] of velocity that is known again; scans after which a delay counts as that long
SCAN = 0.1  # [s]
MODELS = {
    "one model": TrackerParams(),
    "two models": dataclasses.replace(TrackerParams(), turning_acceleration_std=5.0, min_hits=2),
}


class Listener:
    """A tracker beside the one that drives, and what its tracks are worth over one delivery."""

    def __init__(self, tracker: Tracker) -> None:
        self.tracker = tracker
        # people seen, those of them with a track, tracks, those near anybody; squared errors of speed, velocity, place
        self.sums = np.zeros(7)
        self.delays: list[float] = []  # [s]
        self._waiting: dict[int, int] = {}  # person -> scans since the turn

    def add(self, people: FloatArray, is_seen: BoolArray, turned: BoolArray, tracks: list[Track]) -> None:
        """Compare the tracks with all people (N, 4), of whom some are seen and some have just turned (N,)."""
        states = np.array([(each.x, each.y, each.vx, each.vy) for each in tracks]).reshape(-1, 4)
        apart = np.hypot(*(people[:, None, :2] - states[None, :, :2]).transpose(2, 0, 1))
        rows, columns = linear_sum_assignment(np.where(apart < NEAR, apart, 1e3))
        pairs = {int(p): int(t) for p, t in zip(rows, columns, strict=True) if apart[p, t] < NEAR}
        off = {p: states[t, 2:] - people[p, 2:] for p, t in pairs.items() if is_seen[p]}
        counts = (is_seen.sum(), len(off), len(tracks), len(pairs))
        speeds = (np.hypot(*states[pairs[p], 2:]) - np.hypot(*people[p, 2:]) for p in off)
        errors = (
            sum(d**2 for d in speeds),
            sum(d @ d for d in off.values()),
            sum(apart[p, pairs[p]] ** 2 for p in off),
        )
        self.sums += (*counts, *errors)
        self._turns(is_seen, turned, off)

    def _turns(self, is_seen: BoolArray, turned: BoolArray, off: dict[int, FloatArray]) -> None:
        for person in np.flatnonzero(turned & is_seen).tolist():
            self._waiting.setdefault(person, 0)
        for person, scans in list(self._waiting.items()):
            is_known = person in off and math.hypot(*off[person]) < KNOWN
            if is_known or scans == PATIENCE:
                self.delays.append(SCAN * scans)
            if is_known or scans == PATIENCE or not is_seen[person]:
                del self._waiting[person]
            else:
                self._waiting[person] += 1


class Watched:
    """A brain whose observations other trackers hear, too."""

    def __init__(self, brain: Any, world: Any, lidar: Lidar, radius: float, listeners: list[Listener]) -> None:
        self._brain, self._world, self._lidar, self._radius = brain, world, lidar, radius
        self._listeners = listeners
        self._before: deque[FloatArray] = deque(maxlen=WITHIN)  # velocities (N, 2) at the last scans
        self._turning: BoolArray = np.zeros(0, dtype=np.bool_)
        self._odom = Pose2D()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._brain, name)

    def tick(self, observation: Observation) -> Any:
        """See :class:`Brain`."""
        command = self._brain.tick(observation)
        self._odom = observation.odometry.pose if observation.odometry else self._odom
        if observation.scan is not None and self._brain.belief is not None:
            truth = self._world.truth
            is_seen = self._in_sight(truth.pose, truth.pedestrians, observation)
            turned = self._turned(truth.pedestrians[:, 2:])
            for each in self._listeners:
                each.tracker.observe(observation.scan, self._brain.belief.pose, self._odom)
                tracks = each.tracker.tracks(observation.stamp)
                near = [t for t in tracks if math.hypot(t.x - truth.pose.x, t.y - truth.pose.y) < REACH]
                each.add(truth.pedestrians, is_seen, turned, near)
        return command

    def _turned(self, velocities: FloatArray) -> BoolArray:
        """Who (N,) has just turned sharply."""
        old = self._before[0] if self._before else velocities
        self._before.append(velocities.copy())
        angle = np.arctan2(velocities[:, 1], velocities[:, 0]) - np.arctan2(old[:, 1], old[:, 0])
        walk = np.minimum(np.hypot(*velocities.T), np.hypot(*old.T)) > KNOWN
        turns: BoolArray = walk & (np.abs((angle + math.pi) % (2.0 * math.pi) - math.pi) >= TURN)
        begun = turns & ~self._turning if len(self._turning) == len(turns) else turns
        self._turning = turns
        return begun

    def _in_sight(self, base: Pose2D, people: FloatArray, observation: Observation) -> BoolArray:
        """Who (N,) of the people (N, 4) is near and in line of sight."""
        assert observation.scan is not None
        scan, sensor = observation.scan, compose(base, observation.scan.sensor_pose)
        ranges = self._lidar.exact_ranges(base, people)
        way = people[:, :2] - (sensor.x, sensor.y)
        distances = np.hypot(*way.T)
        bearings = np.arctan2(way[:, 1], way[:, 0]) - sensor.yaw - scan.angle_min
        beams = np.rint(bearings / scan.angle_increment).astype(int) % len(ranges)
        found: BoolArray = (distances < REACH) & (np.abs(ranges[beams] - distances) <= self._radius)
        return found


def rates(heard: list[Listener]) -> dict[str, float]:
    """What deliveries say together."""
    seen, matched, told, right, speed2, velocity2, place2 = sum(each.sums for each in heard).tolist()
    delays = [delay for each in heard for delay in each.delays] or [math.nan]
    return {
        "recall": matched / max(seen, 1.0),
        "precision": right / max(told, 1.0),
        "speed error, RMS [m/s]": math.sqrt(speed2 / max(matched, 1.0)),
        "velocity error, RMS [m/s]": math.sqrt(velocity2 / max(matched, 1.0)),
        "place error, RMS [m]": math.sqrt(place2 / max(matched, 1.0)),
        "delay after a turn, mean [s]": float(np.mean(delays)),
        "turns known within 0.3 s": float(np.mean(np.array(delays) <= 0.3 + 1e-9)),
    }


def main() -> None:
    given = parsed(__doc__, episodes=40, seed=0, pedestrians=100, map="sidewalk_1")
    study = make_study(
        stacks=["evasive-gps-ekf"],
        episodes=given.episodes,
        seed=given.seed,
        map_name=given.map,
        world="published",
        pedestrians=given.pedestrians,
    )
    heard: dict[str, list[Listener]] = {name: [] for name in MODELS}
    for task in study.tasks():

        def watched(parts: Parts, world: Any, sensors: str = task.stack.sensors) -> Any:
            radius, geometry = parts.params.people.radius, parts.scene.geometry
            lidar = Lidar(load_dataclass(SensorParams, Path(sensors)).lidar, geometry, radius)
            for name, params in MODELS.items():
                heard[name].append(Listener(Tracker(params, parts.scene.mapped_geometry)))
            return Watched(parts.brain(world), world, lidar, radius, [each[-1] for each in heard.values()])

        run_episode(task, watched)
        print(f"delivery {task.episode + 1} of {given.episodes}", flush=True)
    rng = np.random.default_rng(0)
    for name, each in heard.items():
        turns = sum(len(one.delays) for one in each)
        print(f"\n{name}: {given.episodes} deliveries, {sum(one.sums[0] for one in each):.0f} sights, {turns} turns")
        drawn = [rates([each[k] for k in rng.integers(len(each), size=len(each))]) for _ in range(2000)]
        for key, value in rates(each).items():
            low, high = np.nanpercentile([one[key] for one in drawn], (2.5, 97.5))
            print(f"{key:<30}{value:8.3f} [{low:.3f}, {high:.3f}]")


if __name__ == "__main__":
    main()
