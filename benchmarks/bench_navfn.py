"""Global plans on the shipped sidewalk map, against Nav2's C++ as recorded on the published map of the same kind.

Usage: python benchmarks/bench_navfn.py [--missions N]

The map is 4000 x 4000 cells of 0.05 m, inflated as in the published global costmap. The C++ fills arrays of 16 million
cells for every plan. Replanning drives along the first plan, 1.5 m between plans, past pedestrians that stand
elsewhere each time.
"""

import argparse
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from navstack.costmap.costmap import FREE_SPACE, LETHAL_OBSTACLE, Costmap
from navstack.costmap.inflation import Inflation
from navstack.costmap.map_io import load_map
from navstack.errors import PlanningError
from navstack.params.costmap import InflationLayerParams
from navstack.params.planners import OMPL_ALGORITHMS, IncrementalNavfnParams, NavfnParams, OmplParams
from navstack.planning.incremental_navfn import IncrementalNavfn
from navstack.planning.navfn import NavfnPlanner
from navstack.planning.ompl_planner import OmplPlanner
from navstack.planning.planner import Planner
from navstack.types import Pose2D

MAP = Path(__file__).parents[1] / "maps" / "sidewalk_walkable.yaml"
NAV2_CPP_MS = {"Dijkstra": 120.0, "A*": 110.0}  # recorded medians
INFLATION = InflationLayerParams(inflation_radius=1.0, cost_scaling_factor=0.3)
INSCRIBED_RADIUS = 0.39  # [m] of the padded footprint
STEP = 60  # path points between two plans: 1.5 m
PEDESTRIANS = 3  # within 10 m of the robot


def sidewalk() -> tuple[Costmap, Inflation]:
    """The inflated map, and what inflates it."""
    grid = load_map(MAP)
    costs = np.where(grid.data == 0, FREE_SPACE, LETHAL_OBSTACLE).astype(np.uint8)
    inflation = Inflation(INFLATION, grid.resolution, INSCRIBED_RADIUS)
    inflation.apply(costs, 0, grid.width, 0, grid.height)
    return Costmap(costs, grid.resolution, grid.origin.x, grid.origin.y), inflation


def missions(costmap: Costmap, count: int, rng: np.random.Generator) -> list[tuple[Pose2D, Pose2D]]:
    """Pairs of clear points 40 to 110 m apart."""
    rows, columns = np.nonzero(costmap.data < 150)
    pairs: list[tuple[Pose2D, Pose2D]] = []
    while len(pairs) < count:
        i, j = rng.integers(len(rows), size=2)
        start, goal = (Pose2D(*costmap.map_to_world(columns[k], rows[k])) for k in (i, j))
        if 40.0 < np.hypot(start.x - goal.x, start.y - goal.y) < 110.0:
            pairs.append((start, goal))
    return pairs


def bench(name: str, planner: Planner, costmap: Costmap, pairs: list[tuple[Pose2D, Pose2D]]) -> None:
    """Plan every mission once and print the median."""
    times, lengths = [], []
    for start, goal in (pairs[0], *pairs):
        began = time.perf_counter()
        try:
            path = planner.plan(start, goal, costmap)
        except PlanningError:
            continue
        times.append(1e3 * (time.perf_counter() - began))
        lengths.append(path.length)
    ratio = ""
    if name in NAV2_CPP_MS:
        ratio = f"; C++ {NAV2_CPP_MS[name]:.0f} ms, ratio {np.median(times[1:]) / NAV2_CPP_MS[name]:.2f}"
    print(
        f"{name:16s} {np.median(times[1:]):7.1f} ms median, {max(times[1:]):7.1f} worst, "
        f"{len(times) - 1}/{len(pairs)} found, mean {np.mean(lengths[1:]):.1f} m{ratio}"
    )


def drive(
    costmap: Costmap, inflation: Inflation, route: np.ndarray, rng: np.random.Generator
) -> Iterator[tuple[Pose2D, Costmap]]:
    """Poses along a route, each with a costmap in which pedestrians stand near it; the empty map is its floor."""
    for x, y, _ in route[:-STEP:STEP]:
        data = costmap.data.copy()
        mx, my = costmap.world_to_map(x, y)
        for dx, dy in rng.integers(-200, 200, (PEDESTRIANS, 2)):
            column, row = mx + dx, my + dy
            inside = 40 < column < costmap.size_x - 40 and 40 < row < costmap.size_y - 40
            if inside and np.hypot(dx, dy) > 30:
                data[row - 6 : row + 6, column - 6 : column + 6] = LETHAL_OBSTACLE
                inflation.apply(data, column - 40, column + 40, row - 40, row + 40)
        yield Pose2D(x, y), Costmap(data, costmap.resolution, costmap.origin_x, costmap.origin_y, costmap.data)


def bench_replanning(costmap: Costmap, inflation: Inflation, pairs: list[tuple[Pose2D, Pose2D]]) -> None:
    """Replan along some routes with both NavFns and print the medians."""
    planners = {
        "replan Dijkstra": NavfnPlanner(NavfnParams()),
        "replan increm.": IncrementalNavfn(IncrementalNavfnParams()),
    }
    times: dict[str, list[float]] = {name: [] for name in planners}
    for start, goal in pairs[:4]:
        route = NavfnPlanner(NavfnParams()).plan(start, goal, costmap).poses
        for k, (pose, now) in enumerate(drive(costmap, inflation, route, np.random.default_rng(1))):
            for name, planner in planners.items():
                began = time.perf_counter()
                planner.plan(pose, goal, now)
                if k > 0:
                    times[name].append(1e3 * (time.perf_counter() - began))
    for name, values in times.items():
        ratio = np.median(values) / NAV2_CPP_MS["Dijkstra"]
        print(
            f"{name:16s} {np.median(values):7.1f} ms median, {np.max(values):7.1f} worst; C++ 120 ms, ratio {ratio:.2f}"
        )


def main() -> None:
    """Run all."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--missions", type=int, default=20)
    count = parser.parse_args().missions
    costmap, inflation = sidewalk()
    pairs = missions(costmap, count, np.random.default_rng(0))
    bench("Dijkstra", NavfnPlanner(NavfnParams()), costmap, pairs)
    bench("A*", NavfnPlanner(NavfnParams(use_astar=True)), costmap, pairs)
    bench_replanning(costmap, inflation, pairs)
    for algorithm in sorted(OMPL_ALGORITHMS):
        planner = OmplPlanner(OmplParams(algorithm=algorithm))
        bench(algorithm, planner, costmap, pairs)


if __name__ == "__main__":
    main()
