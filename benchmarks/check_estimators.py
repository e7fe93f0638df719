"""What other estimators of a difference of margins would save: the variance that each leaves of plain deliveries'.

Usage: python benchmarks/check_estimators.py [--runs FOLDER ...] [--first NAME] [--second NAME]
       [--repeated N] [--times N]

Two stacks drove the same missions, in a run folder each. People walk independently of the robot, so that a forecast
knows beforehand how near somebody will come to a robot that follows the planner's first path.

- regression: missions are grouped by the forecast, and the groups' shares are known exactly.
- stratified: in addition, each group gets the number of missions that leaves the least variance (Neyman 1934).
- repeated: N missions are driven so many times with other noise of the sensors and the brain, mission and people
  unchanged. What lies within missions is all that a delivery continued with fresh noise (splitting) could save, and
  what lies between them is the most that a cheaper twin of the delivery could explain.
"""

from collections.abc import Sequence
from pathlib import Path
from unittest import mock

import numpy as np
from options import parsed

from harness.analysis.repricing import choose, profits
from harness.economics.valuation import margins
from harness.episode.episode import run_episode
from harness.episode.factory import Parts
from harness.plan.question import ends_of, make_ground, make_planner
from harness.statistics.paired import Z_OF_TEST
from harness.study.manifest import load_study
from harness.study.stored_run import load_run
from harness.task.study import EpisodeTask, make_generators
from harness.world.pedestrian_models import make_pedestrians
from navstack.types import FloatArray

SPEED = 1.88  # [m/s] at which a robot under way follows its path, on average
STEP = 0.1  # [s] of the forecast
GROUPS = (0.5, 2.0, 5.0)  # [m] between which the nearest forecast distances are grouped
RUNS = [f"results/baseline/published_2/{place}" for place in ("sidewalk", "sidewalk_1", "sidewalk_2")]
REPEATED = ("mission", "pedestrians", "cargo")  # generators that stay as they are


def forecasts(tasks: Sequence[EpisodeTask]) -> FloatArray:
    """How near somebody comes to a robot on the planner's first path [m], centre to centre, in each delivery."""
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
            nearest[number] = min(nearest[number], np.hypot(*(people.states[:, :2] - robot).T).min())
            people.step(STEP)
    return nearest


def margins_of(folder: Path) -> FloatArray:
    """What each mission of a run's only stack earned [USD]."""
    run = load_run(str(folder))
    return profits(run, run.stacks[0], choose(run, None, (), ()))


def table(folder: Path, first: str, second: str) -> None:
    """Print what each estimator leaves of the variance, and the missions that it needs for 1 USD."""
    differences = margins_of(folder / second) - margins_of(folder / first)
    group = np.digitize(forecasts(list(load_study(folder / first, 1).tasks())), GROUPS)
    shares = np.bincount(group, minlength=len(GROUPS) + 1) / len(group)
    spreads = np.array([differences[group == number].std() for number in range(len(GROUPS) + 1)])
    plain = differences.var()
    left = {"plain": plain, "regression": shares @ spreads**2, "stratified": (shares @ spreads) ** 2}
    means = [round(float(differences[group == number].mean()), 2) for number in range(len(shares))]
    print(f"{folder.name}: {second} less {first}, n = {len(group)}")
    print(f"  shares of the groups {np.round(shares, 3).tolist()}, mean difference in each [USD] {means}")
    for name, variance in left.items():
        print(f"  {name:10} {variance / plain:.2f}, {Z_OF_TEST**2 * variance:.0f} missions")


def repeated(folder: Path, missions: int, times: int) -> None:
    """Print the share of the variance that lies within missions."""
    found, prices = [], load_run(str(folder)).prices()
    for task in list(load_study(folder, 1).tasks())[:missions]:
        rows = []
        for number in range(times):
            other = make_generators(task.seed + 1_000_003 * number, task.episode)
            kept = {name: generator for name, generator in task.generators().items() if name in REPEATED}
            with mock.patch.object(EpisodeTask, "generators", lambda _, each=other | kept: each):
                rows.append(run_episode(task).row)
        found.append(margins(rows, prices))
    values = np.array(found)
    within = values.var(axis=1, ddof=1).mean()
    between = values.mean(axis=1).var(ddof=1) - within / times
    print(f"{folder.name}: {missions} missions {times} times: {within / (within + between):.2f} of the variance within")


def main() -> None:
    """Print the tables."""
    given = parsed(__doc__, runs=RUNS, first="nav2-gps-ekf", second="mpc-gps-ekf", repeated=0, times=4)
    for run in given.runs:
        table(Path(run), given.first, given.second)
        if given.repeated:
            repeated(Path(run) / given.first, given.repeated, given.times)


if __name__ == "__main__":
    main()
