"""In drives: how many plans of NavFn lead elsewhere than those of a wave that is not held back.

Usage: python -m tools.parity.held_back [DELIVERIES=8]

The stack ``nav2-gps-ekf`` drives on ``sidewalk`` in the default world, seed 0.
"""

import dataclasses
import sys

import numpy as np
from scipy.spatial import cKDTree

from harness.episode.episode import run_episode
from harness.task.study import make_study
from navstack.costmap.costmap import Costmap
from navstack.planning.navfn import NavfnPlanner
from navstack.types import Path, Pose2D

SAME = 0.25  # [m] between paths of one way


def main(deliveries: int = 8) -> None:
    """Drive, plan everything twice, and print the counts."""
    held_back = NavfnPlanner.plan
    apart: list[float] = []

    def plan(
        self: NavfnPlanner, start: Pose2D, goal: Pose2D, costmap: Costmap, stamp: float = 0.0
    ) -> Path:
        free = NavfnPlanner(self._params)
        other = held_back(free, start, goal, dataclasses.replace(costmap, floor=None), stamp)
        path = held_back(self, start, goal, costmap, stamp)
        apart.append(farthest(path, other))
        return path

    NavfnPlanner.plan = plan  # type: ignore[method-assign]
    task = next(make_study(stacks=["nav2-gps-ekf"], episodes=1, workers=1).tasks())
    for episode in range(deliveries):
        run_episode(dataclasses.replace(task, episode=episode))
    found = np.array(apart)
    print(  # noqa: T201
        f"{(found > SAME).sum()} of {len(found)} plans lead elsewhere, "
        f"{(found > 0.0).sum()} differ; largest distance {found.max():.2f} m"
    )


def farthest(path: Path, other: Path) -> float:
    """The largest distance [m] of a pose of one path to the nearest of the other."""
    return float(cKDTree(other.poses[:, :2]).query(path.poses[:, :2])[0].max())


if __name__ == "__main__":
    main(*map(int, sys.argv[1:2]))
