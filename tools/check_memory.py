"""Memory of the program and of each of its workers over many deliveries.

Flat, and at most 300 MB of its own.

Usage: python -m tools.check_memory [--episodes N] [--stack NAME] [--workers N] [--timeout S]
       [--map MAP] python -m tools.check_memory --rows N

With --rows nothing but one delivery is driven: a run cut off just before its end has N copies of
it, no two with the same margin. Printed is what memory and processor time resuming it, finishing it
and reading it again take.

Short deliveries; after each of them the memory of every process is read (Linux): resident (RSS);
that in proportion, where what k processes share counts 1/k in each (PSS); and private, what would
be free without the process (USS). The fields of a map are shared by all processes of a machine, and
libraries: a worker alone has some 50 MiB more of its own. The built-in maps have 4000 x 4000 cells.

Compared are the medians of RSS in the second tenth of the deliveries (everything is compiled and
filled by then) and in the last tenth. Exit status 1 when one of them grew by more than 5 %, or when
a worker's private memory exceeds 300 MB.
"""

import argparse
import multiprocessing
import os
import random
import resource
import statistics
import sys
import tempfile
import time
from collections import defaultdict
from pathlib import Path

from harness.economics.valuation import value
from harness.episode.episode import run_episode
from harness.execution.workers import Workers
from harness.storage.journal import line_of
from harness.storage.new_run import create_run
from harness.storage.run_folder import JOURNAL, RunFolder
from harness.study.drive import TABLES, drive_missing, finish
from harness.study.manifest import about, load_study, parameters
from harness.study.stored_run import load_run
from harness.task.study import Study, make_study
from tools.options import parsed

ALLOWED = 0.05
MOST_PRIVATE = 300e6 / 2**20  # [MiB] of a worker
RULES = (
    "arrival_radius: 2.0\ntimeout: {timeout}\nmax_tilt: 0.5\nimpulse_health: "
    "177.78\nspoiled_fraction: 0.05\n"
)
PARENT = "program"


def memory(process: int) -> tuple[float, float, float]:
    """RSS, PSS and USS in [MiB]."""
    lines = Path(f"/proc/{process}/smaps_rollup").read_text().splitlines()[1:]
    sizes = {name: int(size) / 1024.0 for name, size, _ in (line.split() for line in lines)}
    return sizes["Rss:"], sizes["Pss:"], sizes["Private_Clean:"] + sizes["Private_Dirty:"]


def measure(
    arguments: argparse.Namespace, folder: Path
) -> dict[str, list[tuple[float, float, float]]]:
    """:func:`memory` of each process after each delivery."""
    (folder / "short.yaml").write_text(RULES.format(timeout=arguments.timeout))
    study = make_study(
        stacks=[arguments.stack],
        episodes=arguments.episodes,
        workers=arguments.workers,
        map_name=arguments.map,
        rules=str(folder / "short.yaml"),
    )
    create_run(folder / "run", about(study, sys.argv), parameters(study))
    study = load_study(folder / "run", arguments.workers)
    sizes: dict[str, list[tuple[float, float, float]]] = defaultdict(list)

    def on_finished(finished: object, record: object) -> None:
        sizes[PARENT].append(memory(os.getpid()))
        for number, process in enumerate(
            sorted(multiprocessing.active_children(), key=lambda child: child.pid or 0)
        ):
            sizes[f"worker {number}"].append(memory(process.pid or 0))

    with RunFolder(folder / "run", TABLES, study.total) as run, Workers(study.workers) as workers:
        drive_missing(study, run, workers, on_finished)
    return sizes


def write_journal(study: Study, folder: Path) -> None:
    """Copies of the study's first delivery, with other distances, as its journal."""
    with Workers(1) as workers:
        delivery = next(workers.run(run_episode, [next(iter(study.tasks()))])).result
    assert delivery is not None
    draw = random.Random(0)
    with (folder / JOURNAL).open("wb") as journal:
        for episode in range(study.total):
            varied = {
                "episode": episode,
                "distance_m": delivery.row["distance_m"] * draw.uniform(0.9, 1.1),
            }
            timing = {**delivery.timing, "episode": episode}
            journal.write(
                line_of(
                    {"row": {**delivery.row, **varied}, "events": delivery.events, "timing": timing}
                )
            )


def measure_rows(arguments: argparse.Namespace, folder: Path) -> None:
    """Print what each step of ending a large run takes."""
    study = make_study(stacks=[arguments.stack], episodes=arguments.rows, map_name=arguments.map)
    create_run(folder, about(study, sys.argv), parameters(study))
    write_journal(study, folder)
    began, before = time.process_time(), memory(os.getpid())[0]

    def report(step: str) -> None:
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
        spent, more = time.process_time() - began, memory(os.getpid())[0] - before
        print(
            f"{step:<8} {more:+8.0f} MiB since the beginning, peak {peak:.0f} MiB, {spent:6.1f} s "
            "of processor time"
        )

    print(
        f"{study.total} deliveries, {(folder / JOURNAL).stat().st_size / 1e6:.0f} MB of journal, "
        f"{before:.0f} MiB"
    )
    with RunFolder(folder, TABLES, study.total) as run:
        report("resumed")
        finish(study, run)
        report("priced")
    report("closed")
    stored = load_run(str(folder))
    report("loaded")
    value(stored.stacks[0].rows, stored.stacks[0], stored.prices(), stored.seed)
    report("priced")


def main() -> None:
    arguments = parsed(
        __doc__,
        episodes=500,
        stack="nav2-gps",
        workers=2,
        map="sidewalk",
        timeout=3.0,
        rows=0,
    )
    with tempfile.TemporaryDirectory() as name:
        if arguments.rows:
            measure_rows(arguments, Path(name) / "run")
            return
        sizes = measure(arguments, Path(name))
    failed = False
    steps = 10
    print(
        f"RSS [MiB] after each tenth of {arguments.episodes} deliveries, {arguments.stack}, and "
        "growth from 2nd to last"
    )
    for process, sizes_of_it in sizes.items():
        tenth = max(len(sizes_of_it) // steps, 1)
        medians = [
            statistics.median(rss for rss, _, _ in sizes_of_it[i * tenth : (i + 1) * tenth])
            for i in range(steps)
        ]
        growth = medians[-1] / medians[1] - 1.0
        pss, uss = (statistics.median(size[k] for size in sizes_of_it[-tenth:]) for k in (1, 2))
        failed |= growth > ALLOWED or (process != PARENT and uss > MOST_PRIVATE)
        print(
            f"{process:<10}{''.join(f'{median:8.0f}' for median in medians)}   {growth:+.1%}",
            end="",
        )
        print(
            f"   in proportion {pss:.0f}, private {uss:.0f} (a worker's may be {MOST_PRIVATE:.0f})"
        )
    sys.exit(bool(failed))


if __name__ == "__main__":
    main()
