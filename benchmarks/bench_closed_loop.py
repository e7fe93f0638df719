"""How much faster than real time one core drives deliveries, brain and world together.

Usage: python benchmarks/bench_closed_loop.py [--episodes N] [--stack NAME ...]

Each stack drives the same missions of seed 0 after one warm-up delivery; the factor of an episode is simulated seconds
over wall seconds of the episode, its reset included.
"""

import argparse

import numpy as np

from harness.episode import run_episode
from harness.study import make_study


def factors(stack: str, episodes: int) -> np.ndarray:
    """Real-time factor of each episode (the first one, which compiles and fills caches, left out)."""
    study = make_study(stacks=[stack], episodes=episodes + 1, workers=1)
    return np.array([run_episode(task).timing["real_time_factor"] for task in study.tasks()])[1:]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--episodes", type=int, default=8)
    parser.add_argument("--stack", nargs="*", default=["nav2-gps", "nav2-stock", "paper-gps", "parked"])
    arguments = parser.parse_args()
    print(f"{'stack':<14}{'median':>8}{'least':>8}{'most':>8}   x real time per core, n = {arguments.episodes}")
    for stack in arguments.stack:
        measured = factors(stack, arguments.episodes)
        print(f"{stack:<14}{np.median(measured):>8.1f}{measured.min():>8.1f}{measured.max():>8.1f}")


if __name__ == "__main__":
    main()
