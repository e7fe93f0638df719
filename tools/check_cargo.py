"""Popcorn simulated late, only where it may spill, against popcorn simulated in every step.

Same rows, in what time?

Usage: python -m tools.check_cargo [--stack NAME ...] [--world NAME] [--episodes N] [--seed N]

Every delivery is driven both ways, in turn first. Exit status 1 when rows or events of one differ.
"""

import sys
import time
from typing import Any
from unittest import mock

from harness.episode.episode import run_episode
from harness.task.study import EpisodeTask, make_study
from harness.world.cargo.cargo import harmless_jolt
from tools.options import parsed

HARMLESS = (harmless_jolt, lambda *given: -1.0)  # late, and in every step


def driven(task: EpisodeTask, way: int) -> tuple[float, dict[str, Any], str]:
    """Processor time [s], the row, and row and events as they compare."""
    with mock.patch("harness.world.cargo.cargo.harmless_jolt", HARMLESS[way]):
        began = time.process_time()
        delivery = run_episode(task)
        return (
            time.process_time() - began,
            dict(delivery.row),
            repr((delivery.row, delivery.events)),
        )


def main() -> None:
    given = parsed(
        __doc__,
        stack=["nav2-gps", "evasive-gps-ekf", "mpc-gps-ekf"],
        world="paper_fitted",
        episodes=40,
        seed=900,
    )
    differing = 0
    for stack in given.stack:
        tasks = list(
            make_study(
                stacks=[stack],
                episodes=given.episodes,
                world=given.world,
                seed=given.seed,
            ).tasks()
        )
        run_episode(tasks[0])  # compiles, and fills caches
        times, spilled = [0.0, 0.0], 0
        for number, task in enumerate(tasks):
            first = 1 - number % 2
            found = {way: driven(task, way) for way in (first, 1 - first)}
            times = [spent + found[way][0] for way, spent in enumerate(times)]
            spilled += bool(found[1][1]["pieces_lost"])
            differing += found[0][2] != found[1][2]
        print(
            f"{stack}: {times[0] / times[1]:.3f} of the time, {spilled} of {len(tasks)} "
            "deliveries spilled",
            flush=True,
        )
    print(f"{differing} deliveries differ")
    sys.exit(bool(differing))


if __name__ == "__main__":
    main()
