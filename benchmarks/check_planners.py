"""How good are sampled paths after one second? Against a minute of BIT*, and every path against the map's squares.

Usage: python benchmarks/check_planners.py [--count N] [--first N] [--seed S] [--time T] [--reference T] [--workers N]
           [--out FILE] [--cpu-time]

Missions of 50 to 120 m on the sidewalk map, drawn from the seed. RRTstar and InformedRRTstar each get ``--time``, BIT*
``--reference``; all look for the shortest path and take short cuts at the end. A query passes where the better of the
two is at most 2 % longer than the shortest path that any of the three found. Every path is driven by the robot's body,
turns included, over the map's occupied and forbidden cells as squares (shapely).

``--cpu-time`` counts the time that the process computes instead of the time that passes: for a busy machine.

``--out`` keeps a line (JSON) for each query; queries that have one there are not asked again.
"""

import argparse
import dataclasses
import json
import time
from functools import lru_cache
from pathlib import Path

from harness.episode.factory import Parts
from harness.execution.workers import Workers
from harness.plan.question import Ground, ask, compile_first, ends_of, make_ground, make_planner
from harness.statistics import wilson_interval
from harness.task.study import EpisodeTask, make_study
from navstack.planning import ompl_search

LENGTHS = (50.0, 120.0)  # [m]
QUICK = ("RRTstar", "InformedRRTstar")
REFERENCE = "BITstar"
TOLERANCE = 0.02


@lru_cache(maxsize=1)
def ground_of(map_name: str, template: EpisodeTask) -> Ground:
    ground = make_ground(template)
    compile_first(ground.shape)
    return ground


def answer(task: EpisodeTask, seconds: float, reference: float) -> dict:
    """Ask the three planners; lengths [m] and clearances [m] by planner."""
    ground, ends = ground_of(task.map_name, dataclasses.replace(task, episode=0)), ends_of(task)
    row: dict = {"seed": task.seed, "episode": task.episode}
    row["shortest_m"] = Parts(task).mission(task.generators()["mission"]).shortest_path
    for name, budget in (*((name, seconds) for name in QUICK), (REFERENCE, reference)):
        planner = make_planner(name, Parts(task).nav2, ground.shape, budget, cost_weight=0.0)
        reply = ask(name, planner, None, ground, ends, task.episode)
        length = None if reply.path is None else reply.path.length
        row[name] = {"length_m": length, "clearance_m": reply.clearance, "time_s": reply.seconds, "why": reply.why}
    return row


def excess(row: dict) -> float:
    """By how much the better of the quick paths is longer than the shortest found; infinite where there is none."""
    quick = [row[name]["length_m"] for name in QUICK if row[name]["length_m"] is not None]
    every = [*quick, *([row[REFERENCE]["length_m"]] if row[REFERENCE]["length_m"] is not None else [])]
    return min(quick) / min(every) - 1.0 if quick else float("inf")


def show(row: dict) -> str:
    """One query in one line."""
    parts = []
    for name in (*QUICK, REFERENCE):
        reply = row[name]
        found = reply["length_m"] is not None
        parts.append(
            f"{name} {reply['length_m']:.2f} m in {reply['time_s']:.2f} s, clear by {reply['clearance_m']:.2f} m"
            if found
            else f"{name} {reply['why']}"
        )
    return f"query {row['episode']} ({row['shortest_m']:.0f} m): " + "; ".join(parts) + f"; excess {excess(row):.2%}"


def summary(rows: list[dict]) -> str:
    """All queries in three lines."""
    passed = sum(excess(row) <= TOLERANCE for row in rows)
    share = wilson_interval(passed, len(rows))
    clear = [row[name]["clearance_m"] for row in rows for name in (*QUICK, REFERENCE) if row[name]["length_m"]]
    lines = [
        f"{passed} of {len(rows)} within {TOLERANCE:.0%} of the shortest ({share.low:.2f}..{share.high:.2f}, Wilson)",
        f"{sum(c > 0.0 for c in clear)} of {len(clear)} paths touch nothing; least clearance {min(clear):.3f} m",
    ]
    for name in QUICK:
        alone = sum(excess({**row, **{other: row[name] for other in QUICK}}) <= TOLERANCE for row in rows)
        lines.append(f"{name} alone: {alone} of {len(rows)}")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=50)
    parser.add_argument("--first", type=int, default=0, help="leave out so many missions of the right length")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--time", type=float, default=1.0, help="[s]")
    parser.add_argument("--reference", type=float, default=60.0, help="[s]")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--cpu-time", action="store_true")
    given = parser.parse_args()
    study = make_study(stacks=["nav2-gps"], episodes=100 * (given.first + given.count), seed=given.seed)
    tasks: list[EpisodeTask] = []
    for task in study.tasks():
        if LENGTHS[0] <= Parts(task).mission(task.generators()["mission"]).shortest_path <= LENGTHS[1]:
            tasks.append(task)
        if len(tasks) == given.first + given.count:
            break
    tasks = tasks[given.first :]
    rows = []
    if given.out is not None and given.out.exists():
        rows = [json.loads(line) for line in given.out.read_text(encoding="utf-8").splitlines()]
    known = {(row["seed"], row["episode"]) for row in rows}
    with Workers(given.workers) as pool:
        for row in pool.run(
            Asked(given.time, given.reference, given.cpu_time), [t for t in tasks if (t.seed, t.episode) not in known]
        ):
            if row.result is None:
                print(f"query {row.task.episode}: {row.error}", flush=True)
                continue
            rows.append(row.result)
            print(show(row.result), flush=True)
            if given.out is not None:
                with given.out.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(row.result) + "\n")
    print(summary(rows))


@dataclasses.dataclass(frozen=True)
class Asked:
    """What a worker does with a task."""

    seconds: float
    reference: float
    is_cpu_time: bool

    def __call__(self, task: EpisodeTask) -> dict:
        """Answer one query."""
        ompl_search.clock = time.process_time if self.is_cpu_time else time.perf_counter
        return answer(task, self.seconds, self.reference)


if __name__ == "__main__":
    main()
