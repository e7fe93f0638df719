"""Train the policy of tiny_policy.py on dollars with CMA-ES (the package cmaes), on all cores.

Usage: python train_policy.py [--world NAME] [--generations N] [--deliveries N] [--out FILE]

Among people who do not make way a policy so small soon learns to stand still; it is trained among
such as do.
"""

import argparse
import json
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from cmaes import CMA
from tiny_policy import FIRST, command

from navbench.gym import DeliveryEnv

SEED = 7000  # of the missions; those of a run count from 0
STEP = 0.3  # standard deviation of the first generation's weights


@cache
def environment(world: str) -> DeliveryEnv:
    """The environment of this process."""
    return DeliveryEnv("nav2-gps-ekf", world=world)


def dollars(weights: Any, world: str, seed: int, deliveries: int) -> float:
    """Mean margin [USD] of the weights on the missions of a seed."""
    env = environment(world)
    earned = 0.0
    for episode in range(deliveries):
        env.reset(seed=seed, options={"episode": episode})
        is_over = False
        while not is_over:
            _, reward, is_over, _, _ = env.step(command(weights, env.seen) / env.fastest)
            earned += reward
    return earned / deliveries


def keep(search: CMA, out: Path) -> None:
    """Write the centre of the search."""
    out.write_text(json.dumps(search.mean.tolist()), encoding="utf-8")


def main() -> None:
    """Search, a line per generation; the centre of the last one is kept."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--world", default="social_force")
    parser.add_argument("--generations", type=int, default=20)
    parser.add_argument("--deliveries", type=int, default=8, help="of each candidate")
    parser.add_argument("--out", type=Path, default=Path("tiny_policy.json"))
    asked = parser.parse_args()
    search = CMA(mean=FIRST, sigma=STEP, seed=0)
    began = time.monotonic()
    with ProcessPoolExecutor() as pool:
        keep(search, asked.out)
        for generation in range(asked.generations):
            candidates = [search.ask() for _ in range(search.population_size)]
            tasks = [
                pool.submit(dollars, each, asked.world, SEED + generation, asked.deliveries)
                for each in candidates
            ]
            earned = [task.result() for task in tasks]
            search.tell([(each, -money) for each, money in zip(candidates, earned, strict=True)])
            told = f"mean {np.mean(earned):.2f}, best {max(earned):.2f} USD a delivery"
            keep(search, asked.out)
            sys.stderr.write(f"generation {generation}: {told}, {time.monotonic() - began:.0f} s\n")


if __name__ == "__main__":
    main()
