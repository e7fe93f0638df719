"""Memory of the program and of each of its workers over many deliveries: flat.

Usage: python benchmarks/check_memory.py [--episodes N] [--stack NAME] [--workers N] [--timeout S]

Short deliveries; after each of them the resident memory (RSS, Linux) of every process is read. Compared are the medians
of the second tenth of the deliveries (everything is compiled and filled by then) and of the last tenth. Exit status 1
when one of them grew by more than 5 %.
"""

import argparse
import multiprocessing
import os
import statistics
import sys
import tempfile
from collections import defaultdict
from pathlib import Path

from harness.benchmark import TABLES, run_study
from harness.execution import Workers
from harness.manifest import about, load_study, parameters
from harness.runs import RunFolder, create_run
from harness.study import make_study

ALLOWED = 0.05
RULES = "arrival_radius: 2.0\ntimeout: {timeout}\nmax_tilt: 0.5\nimpulse_health: 177.78\nspoiled_fraction: 0.05\n"
PARENT = "program"


def resident(process: int) -> float:
    """RSS in [MiB]."""
    pages = int(Path(f"/proc/{process}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def measure(arguments: argparse.Namespace, folder: Path) -> dict[str, list[float]]:
    """RSS [MiB] of each process after each delivery."""
    (folder / "short.yaml").write_text(RULES.format(timeout=arguments.timeout))
    study = make_study(
        stacks=[arguments.stack],
        episodes=arguments.episodes,
        workers=arguments.workers,
        rules=str(folder / "short.yaml"),
    )
    create_run(folder / "run", about(study, sys.argv), parameters(study))
    study = load_study(folder / "run", arguments.workers)
    sizes: dict[str, list[float]] = defaultdict(list)

    def on_finished(finished: object, record: object) -> None:
        sizes[PARENT].append(resident(os.getpid()))
        for number, process in enumerate(sorted(multiprocessing.active_children(), key=lambda child: child.pid or 0)):
            sizes[f"worker {number}"].append(resident(process.pid or 0))

    with RunFolder(folder / "run", TABLES, study.total) as run, Workers(study.workers) as workers:
        run_study(study, run, workers, on_finished)
    return sizes


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--episodes", type=int, default=500)
    parser.add_argument("--stack", default="nav2-gps")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--timeout", type=float, default=3.0, help="simulated [s] of a delivery")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        sizes = measure(arguments, Path(name))
    grew = False
    steps = 10
    print(
        f"RSS [MiB] after each tenth of {arguments.episodes} deliveries, {arguments.stack}, and growth from 2nd to last"
    )
    for process, sizes_of_it in sizes.items():
        tenth = max(len(sizes_of_it) // steps, 1)
        medians = [statistics.median(sizes_of_it[i * tenth : (i + 1) * tenth]) for i in range(steps)]
        growth = medians[-1] / medians[1] - 1.0
        grew |= growth > ALLOWED
        print(f"{process:<10}{''.join(f'{median:8.0f}' for median in medians)}   {growth:+.1%}")
    sys.exit(1 if grew else 0)


if __name__ == "__main__":
    main()
