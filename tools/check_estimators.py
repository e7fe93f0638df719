"""What other estimators of a difference of margins would save.

The variance that each leaves of plain deliveries'.

Usage: python -m tools.check_estimators [--runs FOLDER ...] [--first NAME] [--second NAME]
       [--split N] [--reach M] [--times N]

Two stacks drove the same missions, in a run folder each. People walk independently of the robot, so
that a forecast knows beforehand how near somebody will come to a robot that follows the planner's
first path.

- regression: missions are grouped by the forecast, and the groups' shares are known exactly.
- stratified: in addition, each group gets the number of missions that leaves the least variance
  (Neyman 1934).
- splitting (Villen-Altamirano 1991): N missions are driven until somebody comes within M metres of
  the robot's centre. There the process is copied, physics and brain and all, and so many copies
  drive on, the first as it would have, the others with fresh noise of the sensors and the brain. Of
  the variance only what lies within missions can be saved; what lies between them is the most that
  a cheaper twin of the delivery could explain.
"""

import gc
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from harness.analysis.repricing import choose, profits
from harness.economics.valuation import margins
from harness.episode.episode import RunningDelivery, run_episode
from harness.episode.factory import Parts
from harness.execution.copies import in_a_copy
from harness.plan.question import ends_of, make_ground, make_planner
from harness.statistics.paired import z_of_power
from harness.study.manifest import load_study
from harness.study.stored_run import load_run
from harness.task.study import STREAMS, EpisodeTask
from harness.world.people.models import make_pedestrians
from navstack.types import FloatArray
from tools.options import parsed

SPEED = 1.88  # [m/s] at which a robot under way follows its path, on average
STEP = 0.1  # [s] of the forecast
GROUPS = (0.5, 2.0, 5.0)  # [m] between which the nearest forecast distances are grouped
RUNS = [
    f"results/baseline/published_2/{place}" for place in ("sidewalk", "sidewalk_1", "sidewalk_2")
]
KEPT = ("mission", "pedestrians", "cargo")  # generators whose draws a copy repeats


def forecasts(tasks: Sequence[EpisodeTask]) -> FloatArray:
    """How near people come to a robot on the planner's first path, in each delivery.

    In [m], centre to centre.
    """
    parts, ground = Parts(tasks[0]), make_ground(tasks[0])
    planner = make_planner("NavFn", parts.nav2, ground.shape, 0.0)
    people = make_pedestrians(parts.params.people, parts.scene.navigation_mesh, parts.robot)
    nearest = np.full(len(tasks), np.inf)
    for number, task in enumerate(tasks):
        start, goal = ends_of(task)
        path = planner.plan(start, goal, ground.costmap).poses[:, :2]
        along = np.append(0.0, np.cumsum(np.hypot(*np.diff(path, axis=0).T)))
        people.reset(task.generators()["pedestrians"], start)
        for at in np.arange(0.0, along[-1], SPEED * STEP):
            robot = np.interp(at, along, path[:, 0]), np.interp(at, along, path[:, 1])
            nearest[number] = min(
                nearest[number], np.hypot(*(people.states[:, :2] - robot).T).min()
            )
            people.step(STEP)
    return nearest


def margins_of(folder: Path) -> FloatArray:
    """What each mission of a run's only stack earned [USD]."""
    run = load_run(str(folder))
    return profits(run, run.stacks[0], choose(run, None, {}, ()))


def table(folder: Path, first: str, second: str) -> None:
    """Print what each estimator leaves of the variance, and how many missions it needs."""
    differences = margins_of(folder / second) - margins_of(folder / first)
    group = np.digitize(forecasts(list(load_study(folder / first, 1).tasks())), GROUPS)
    shares = np.bincount(group, minlength=len(GROUPS) + 1) / len(group)
    spreads = np.array([differences[group == number].std() for number in range(len(GROUPS) + 1)])
    plain = differences.var()
    left = {
        "plain": plain,
        "regression": shares @ spreads**2,
        "stratified": (shares @ spreads) ** 2,
    }
    means = [round(float(differences[group == number].mean()), 2) for number in range(len(shares))]
    print(f"{folder.name}: {second} less {first}, n = {len(group)}")
    print(
        f"  shares of the groups {np.round(shares, 3).tolist()}, mean difference in each [USD] "
        f"{means}"
    )
    for name, variance in left.items():
        print(f"  {name:10} {variance / plain:.2f}, {z_of_power() ** 2 * variance:.0f} missions")


def make_fresh(number: int) -> None:
    """Have every generator of this process draw something else.

    Those whose draws a copy repeats are left out.
    """
    for generator in gc.get_objects():
        if isinstance(generator, np.random.Generator):
            seeds = generator.bit_generator.seed_seq
            where = seeds.spawn_key if isinstance(seeds, np.random.SeedSequence) else ()
            if len(where) > 1 and where[1] not in {STREAMS[name] for name in KEPT}:
                generator.bit_generator.state = np.random.default_rng(
                    [number, *where]
                ).bit_generator.state


def continued(
    task: EpisodeTask,
    reach: float,
    copies: int,
) -> tuple[list[dict[str, Any]], list[float]]:
    """How the copies of a delivery end, and their processor time.

    In [s], until it is copied and then of each copy.
    """
    delivery = RunningDelivery(task)

    def drive(goes_on: Callable[[], bool]) -> float:
        began = time.process_time()
        while delivery.verdict is None and goes_on():
            delivery.drive(delivery.brain.tick(delivery.observation))
        return time.process_time() - began

    def nobody_near() -> bool:
        robot, people = delivery.truth.pose, delivery.world.people.states
        return bool((np.hypot(people[:, 0] - robot.x, people[:, 1] - robot.y) > reach).all())

    def end(number: int) -> tuple[dict[str, Any], float]:
        if number:
            make_fresh(number)
        seconds = drive(lambda: True)
        return delivery.finish().row, seconds

    seconds = drive(nobody_near)
    ends = [
        in_a_copy(partial(end, number))
        for number in range(copies if delivery.verdict is None else 1)
    ]
    return [row for row, _ in ends], [seconds, *(after for _, after in ends)]


def split(folder: Path, missions: int, reach: float, copies: int) -> None:
    """Print what splitting leaves of the variance, and of variance times processor time.

    Raises:
        AssertionError: a copy of a delivery does not end as the delivery does.
    """
    tasks, prices = list(load_study(folder, 1).tasks())[:missions], load_run(str(folder)).prices()
    found = [in_a_copy(partial(continued, task, reach, copies)) for task in tasks]
    assert found[0][0][0] == in_a_copy(lambda: run_episode(tasks[0]).row)
    values = [np.array(margins(rows, prices)) for rows, _ in found]
    within = float(np.mean([each.var(ddof=1) if len(each) > 1 else 0.0 for each in values]))
    within /= float(
        np.mean([(each**2).mean() for each in values])
        - np.mean([each.mean() for each in values]) ** 2
    )
    before = float(np.mean([seconds[0] for _, seconds in found]))
    after = float(np.mean([np.mean(seconds[1:]) for _, seconds in found])) / before
    print(
        f"{folder.name}: {sum(len(each) > 1 for each in values)} of {missions} missions copied "
        f"{copies} times"
    )
    print(
        f"  {within:.2f} of the variance lies within missions; after copying "
        f"{after / (1.0 + after):.2f} of the time"
    )
    for number in (2, 4, 8):
        left = 1.0 - within * (1.0 - 1.0 / number)
        print(
            f"  {number} copies: variance {left:.2f}, times time "
            f"{left * (1.0 + number * after) / (1.0 + after):.2f}"
        )


def main() -> None:
    """Print the tables."""
    given = parsed(
        __doc__,
        runs=RUNS,
        first="nav2-gps-ekf",
        second="mpc-gps-ekf",
        split=0,
        reach=8.0,
        times=4,
    )
    for run in given.runs:
        table(Path(run), given.first, given.second)
        if given.split:
            split(Path(run) / given.first, given.split, given.reach, given.times)


if __name__ == "__main__":
    main()
