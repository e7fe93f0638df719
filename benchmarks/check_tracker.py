"""Does the tracker see people, and how fast they walk? In our world, held against the truth.

Usage: python benchmarks/check_tracker.py [--episodes N] [--seed S] [--stack NAME] [--pedestrians N] [--world NAME]

The tracker listens while a stack makes its deliveries, with that stack's belief and odometry. A person counts who is
within 8 m of the lidar and in line of sight: the beam next to the person's centre ends on that person. Tracks and
people are matched as CLEAR MOT does (Bernardin & Stiefelhagen 2008): a pair lasts while it is less than 0.5 m apart,
the rest is assigned so that the sum of distances is least. A track counts against precision if nobody, seen or not, is
within 0.5 m of it. Intervals: bootstrap over deliveries.
"""

import argparse
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from scipy.optimize import linear_sum_assignment

from harness.episode.factory import Parts, rules_of, scene_of
from harness.episode.factory import world_params as params_of
from harness.task.study import EpisodeTask, make_study
from harness.world.lidar import Lidar
from harness.world.sensors import SensorParams
from navstack.geometry import compose
from navstack.params.strict import load_dataclass
from navstack.params.tracker import TrackerParams
from navstack.perception.tracker import Tracker
from navstack.types import Belief, FloatArray, Observation, Odometry, Pose2D, Track, Twist2D

REACH = 8.0  # [m] up to which people count
NEAR = 0.5  # [m] between a track and its person
COLUMNS = ("seen", "matched", "told", "right", "switches", "speed2", "velocity2", "place2")


class Matching:
    """Which track is whom, over one delivery."""

    def __init__(self) -> None:
        self._last: dict[int, int] = {}  # person -> track id, as long as they were matched last
        self._pairs: dict[int, int] = {}
        self.sums = dict.fromkeys(COLUMNS, 0.0)

    def add(self, people: FloatArray, is_seen: FloatArray, tracks: list[Track]) -> None:
        """Compare the tracks with all people (N, 4) of whom some are seen (N,)."""
        places = np.array([(t.x, t.y) for t in tracks]).reshape(-1, 2)
        apart = np.hypot(*(people[:, None, :2] - places[None]).transpose(2, 0, 1))
        ids = [track.id for track in tracks]
        kept = {p: ids.index(i) for p, i in self._pairs.items() if i in ids and apart[p, ids.index(i)] < NEAR}
        costs = np.where(apart < NEAR, apart, 1e3)
        for person, track in kept.items():
            costs[person, :], costs[:, track] = 1e3, 1e3
        rows, columns = linear_sum_assignment(costs)
        fresh = {int(p): int(t) for p, t in zip(rows, columns, strict=True) if costs[p, t] < NEAR}
        matches = kept | fresh
        self._pairs = {person: ids[track] for person, track in matches.items()}
        sums = self.sums
        for person, track in matches.items():
            sums["switches"] += self._last.get(person, ids[track]) != ids[track]
            self._last[person] = ids[track]
            if not is_seen[person]:
                continue
            one, (vx, vy) = tracks[track], people[person, 2:]
            sums["matched"] += 1
            sums["speed2"] += (np.hypot(one.vx, one.vy) - np.hypot(vx, vy)) ** 2
            sums["velocity2"] += (one.vx - vx) ** 2 + (one.vy - vy) ** 2
            sums["place2"] += apart[person, track] ** 2
        sums["seen"] += is_seen.sum()
        sums["told"] += len(tracks)
        sums["right"] += len(matches)


def listen(task: EpisodeTask) -> Iterator[tuple[Tracker, FloatArray, FloatArray, list[Track]]]:
    """Drive a delivery; at every scan: people, who of them is seen, and the tracks."""
    generators = task.generators()
    mission, rules = Parts(task).mission(generators["mission"]), rules_of(task.rules)
    scene, world = scene_of(task.map_name), Parts(task).world()
    radius = params_of(task.world, task.pedestrians, task.people).people.radius
    lidar = Lidar(load_dataclass(SensorParams, Path(task.stack.sensors)).lidar, scene.geometry, radius)
    brain = Parts(task).brain(world)
    tracker = Tracker(TrackerParams(), scene.mapped_geometry)
    observation = world.reset(mission, generators)
    brain.reset(
        mission.goal, Belief(mission.start), generators["planner"], generators["localizer"], generators["controller"]
    )
    odometry = Odometry(0.0, Pose2D(), Twist2D())
    while rules.judge(world.truth, mission.goal) is None:
        command = brain.tick(observation)
        odometry = observation.odometry or odometry
        if observation.scan is not None and brain.belief is not None:
            tracker.observe(observation.scan, brain.belief.pose, odometry.pose)
            truth = world.truth
            is_seen = seen(lidar, truth.pose, truth.pedestrians, radius, observation)
            tracks = [
                t for t in tracker.tracks(observation.stamp) if np.hypot(t.x - truth.pose.x, t.y - truth.pose.y) < REACH
            ]
            yield tracker, truth.pedestrians, is_seen, tracks
        observation = world.step(command)
    world.close_episode()


def seen(lidar: Lidar, base: Pose2D, people: FloatArray, radius: float, observation: Observation) -> FloatArray:
    """Who (N,) of the people (N, 4) is near and in line of sight."""
    assert observation.scan is not None
    scan = observation.scan
    sensor = compose(base, scan.sensor_pose)
    ranges = lidar.exact_ranges(base, people)
    way = people[:, :2] - (sensor.x, sensor.y)
    distances = np.hypot(way[:, 0], way[:, 1])
    bearings = np.arctan2(way[:, 1], way[:, 0]) - sensor.yaw - scan.angle_min
    beams = np.rint(bearings / scan.angle_increment).astype(int) % len(ranges)
    return (distances < REACH) & (np.abs(ranges[beams] - distances) <= radius)


def rates(sums: dict[str, float]) -> dict[str, float]:
    """What the sums over deliveries say."""
    matched = max(sums["matched"], 1.0)
    return {
        "recall": sums["matched"] / max(sums["seen"], 1.0),
        "precision": sums["right"] / max(sums["told"], 1.0),
        "speed error RMS (m/s)": (sums["speed2"] / matched) ** 0.5,
        "velocity error RMS (m/s)": (sums["velocity2"] / matched) ** 0.5,
        "place error RMS (m)": (sums["place2"] / matched) ** 0.5,
        "identity switches per 1000 matches": 1000.0 * sums["switches"] / matched,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--episodes", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--stack", default="nav2-gps")
    parser.add_argument("--world", default="costnav")
    parser.add_argument("--pedestrians", type=int, default=100)
    given = parser.parse_args()
    study = make_study(
        stacks=[given.stack], episodes=given.episodes, seed=given.seed, world=given.world, pedestrians=given.pedestrians
    )
    found = []
    for task in study.tasks():
        matching = Matching()
        for _, people, is_seen, tracks in listen(task):
            matching.add(people, is_seen, tracks)
        found.append(matching.sums)
        print(task.episode, {key: round(value, 3) for key, value in rates(matching.sums).items()}, flush=True)
    rng = np.random.default_rng(0)
    table = np.array([[sums[key] for key in COLUMNS] for sums in found])
    drawn = [table[rng.integers(len(table), size=len(table))].sum(axis=0) for _ in range(2000)]
    spread = [rates(dict(zip(COLUMNS, row, strict=True))) for row in drawn]
    whole = rates(dict(zip(COLUMNS, table.sum(axis=0), strict=True)))
    print(f"{given.episodes} deliveries, {table[:, 0].sum():.0f} sights of people")
    for key, value in whole.items():
        low, high = np.percentile([each[key] for each in spread], (2.5, 97.5))
        print(f"{key:<36}{value:8.3f} [{low:.3f}, {high:.3f}]")


if __name__ == "__main__":
    main()
