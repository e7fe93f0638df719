"""Planners on other people's maps: how long their paths are, how far from obstacles, and how long they take.

Usage: python benchmarks/compare_planners.py MAP ... [--queries 20] [--seed 0] [--planner NAME ...]

A MAP is a map_server YAML file, or a MovingAI ``.map`` (https://movingai.com/benchmarks), whose cells are taken as
STREET_CELL wide. A query leads from one random place with room to turn to another one that NavFn reaches, at least a
third of the map's longer side away; headings at both ends are NavFn's. The robot and the parameters are those of the
stack nav2-gps. Lengths are medians of ratios to NavFn's, clearances and times medians. What touches has no clearance.
"""

import argparse
import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image
from scipy.ndimage import distance_transform_edt

from harness.episode.factory import Parts
from harness.plan.question import NAMES, Answer, Ground, ask, compile_first, make_ground, make_planner
from harness.report.markdown import table
from harness.task.study import EpisodeTask, make_study
from navstack.costmap.costmap import LETHAL_OBSTACLE
from navstack.errors import NavstackError
from navstack.types import FloatArray, Pose2D

PLANNERS = ("NavFn", "IncrementalNavfn", "ThetaStar", "Smac2D", "SmacHybrid", "SmacLattice", "BITstar", "RRTConnect")
STREET_CELL = 0.5  # [m]
TRIES = 50  # of places per query


def as_yaml(file: Path, folder: Path) -> Path:
    """A map as map_server has it, in ``folder`` if it is another one."""
    if file.suffix != ".map":
        return file
    rows = file.read_text(encoding="utf-8").split("map\n", 1)[1].split()
    is_free = np.array([[cell in ".G" for cell in row] for row in rows])
    Image.fromarray(np.where(is_free, 254, 0).astype(np.uint8)).save(folder / f"{file.stem}.png")
    text = (
        f"image: {file.stem}.png\nresolution: {STREET_CELL}\norigin: [0.0, 0.0, 0.0]\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    path = folder / f"{file.stem}.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def task_on(path: Path) -> EpisodeTask:
    """A delivery of the stack nav2-gps on a map."""
    return make_study(stacks=("nav2-gps",), episodes=1, map_name=str(path)).template


def queries(task: EpisodeTask, ground: Ground, count: int, seed: int) -> list[tuple[Pose2D, Pose2D]]:
    """Random queries that NavFn can answer; fewer where there are none."""
    rng, costmap = np.random.default_rng(seed), ground.costmap
    radius = np.hypot(*ground.footprint.T).max()
    free = np.argwhere(distance_transform_edt(costmap.data != LETHAL_OBSTACLE) * costmap.resolution > radius)
    least = max(costmap.size_x, costmap.size_y) * costmap.resolution / 3.0
    navfn, found = make_planner("NavFn", Parts(task).nav2, ground.shape, 0.0), []
    for _ in range(TRIES * count if len(free) else 0):
        ends = [Pose2D(*costmap.map_to_world(int(x), int(y))) for y, x in free[rng.integers(len(free), size=2)]]
        if np.hypot(ends[0].x - ends[1].x, ends[0].y - ends[1].y) < least:
            continue
        path = ask("NavFn", navfn, None, ground, ends, seed).path
        if path is not None and len(path) > 10:
            yaws = _yaw(path.poses[:5]), _yaw(path.poses[-5:])
            found.append(tuple(Pose2D(end.x, end.y, yaw) for end, yaw in zip(ends, yaws, strict=True)))
        if len(found) == count:
            break
    return found


def _yaw(poses: FloatArray) -> float:
    return float(np.arctan2(poses[-1, 1] - poses[0, 1], poses[-1, 0] - poses[0, 0]))


def row(name: str, answers: list[Answer], navfn: list[Answer]) -> list[str]:
    """What one planner made of all queries."""
    pairs = [(own, other) for own, other in zip(answers, navfn, strict=True) if own.path and other.path]
    ratios = [own.path.length / other.path.length for own, other in pairs if own.path and other.path]
    if not pairs:
        return [name, f"0 of {len(answers)}", "", "", "", ""]
    low, high = np.quantile(ratios, (0.05, 0.95))
    return [
        name,
        f"{len(pairs)} of {len(answers)}",
        f"{np.median(ratios):.3f} [{low:.2f}, {high:.2f}]",
        f"{np.median([own.clearance for own, _ in pairs]):.2f}",
        f"{sum(own.clearance == 0.0 for own, _ in pairs)}",
        f"{1e3 * np.median([answer.seconds for answer in answers]):.0f}",
    ]


def main() -> None:
    """Ask and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("maps", nargs="+", type=Path)
    parser.add_argument("--queries", type=int, default=20, help="per map")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--planner", nargs="+", default=list(PLANNERS), choices=NAMES)
    given = parser.parse_args()
    is_compiled = False
    answers: dict[str, list[Answer]] = {name: [] for name in ("NavFn", *given.planner)}
    with tempfile.TemporaryDirectory() as folder:
        for file in given.maps:
            task = task_on(as_yaml(file, Path(folder)))
            ground = make_ground(task)
            if not is_compiled:
                compile_first(ground.shape)
                is_compiled = True
            asked = queries(task, ground, given.queries, given.seed)
            print(f"{file.stem}: {len(asked)} queries", file=sys.stderr, flush=True)
            for name, of_planner in answers.items():
                planner = make_planner(name, Parts(task).nav2, ground.shape, 0.0)
                of_planner += [ask(name, planner, None, ground, ends, given.seed) for ends in asked]
    headers = ["planner", "found", "length / NavFn's [5 %, 95 %]", "clearance [m]", "touching", "time [ms]"]
    print(table(headers, [row(name, own, answers["NavFn"]) for name, own in answers.items()]))


if __name__ == "__main__":
    try:
        main()
    except NavstackError as error:
        sys.exit(str(error))
