"""How many cores one driver keeps busy: its processor time per delivery, against that of a delivery.

Usage: python benchmarks/check_driver.py [--stack NAME] [--deliveries N | --run FOLDER] [--tasks N] [--at-once N ...]
           [--processes] [--dask]

What a delivery costs comes from some whole ones (0, 1 ... of seed 0) that are driven in this process, after one that
compiles and fills caches, in processor time; or, with ``--run``, from those of a finished run, in the wall time of its
workers. Then their rows stand for the results of many tasks that cost nothing, which take the way of ``navbench run``:
handed out, collected, written to the journal with fsync, and turned into tables at the end.

- in this process, with so many tasks at a time (``--at-once``): what the program itself does;
- by two worker processes (``--processes``), and by two workers of a Dask cluster on this machine (``--dask``): the same
  with what carries tasks and results; the scheduler is a process of its own, and its time stands beside the driver's.

Times are processor time, all threads of a process together; ``add`` is the wall time of one fsynced line of the journal
(median), during which the driver waits. Cores are the seconds of a delivery by those of the driver, its waiting
included, or by those of the scheduler if it needs more. ``--run`` also tells what the run takes on disk per 1000
deliveries, all of its stacks together.
"""

import argparse
import contextlib
import functools
import json
import os
import pickle
import statistics
import subprocess
import sys
import tempfile
import time
import tracemalloc
from collections import deque
from collections.abc import Callable, Generator, Iterable
from concurrent.futures import Future
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq

from harness.episode.episode import Delivery, run_episode
from harness.execution.workers import Finished, Place, Workers
from harness.storage.run_folder import RunFolder, create_run
from harness.study.drive import TABLES, drive_missing
from harness.study.manifest import about, parameters
from harness.task.study import EpisodeTask, make_study

TICKS = os.sysconf("SC_CLK_TCK")
DASK = [sys.executable, "-m"]


@dataclass(frozen=True)
class Cost:
    """Of one delivery, beside driving it."""

    driver: float  # [s] of processor time
    closing: float  # [s] of it, to turn the journal into tables
    add: float  # [s] of wall time, for a line of the journal
    scheduler: float = 0.0  # [s] of processor time


@functools.lru_cache(maxsize=1)
def results(file: str) -> list[Delivery]:
    """The deliveries that were driven, in whichever process."""
    stored: list[Delivery] = pickle.loads(Path(file).read_bytes())
    return stored


def stand_in(file: str, task: EpisodeTask) -> Delivery:
    """The result of another delivery."""
    known = results(file)
    other = known[task.episode % len(known)]
    where = {"stack": task.stack.name, "stack_number": task.stack_number, "episode": task.episode}
    short = {"stack": task.stack.name, "episode": task.episode}
    events = [{**event, **short} for event in other.events]
    return Delivery({**other.row, **where}, events, {**other.timing, **short}, None, None)


class Cheap(Workers):
    """Workers whose tasks cost nothing."""

    def __init__(self, file: str, *given: Any) -> None:
        super().__init__(*given)
        self._file = file

    def run(self, function: Callable[[Any], Any], tasks: Iterable[Any]) -> Generator[Finished[Any, Any], None, None]:
        """Give out other tasks."""
        return super().run(functools.partial(stand_in, self._file), tasks)


class Timed(RunFolder):
    """A run folder that times its journal."""

    times: list[float]

    def add(self, record: dict[str, Any]) -> None:
        """Time it."""
        began = time.perf_counter()
        super().add(record)
        self.times.append(time.perf_counter() - began)


def drive(folder: Path, tasks: int, workers: Workers) -> Cost:
    """Hand out cheap tasks."""
    study = make_study(stacks=["parked"], episodes=tasks, workers=1)
    create_run(folder, about(study, []), parameters(study))
    with Timed(folder, TABLES, tasks) as run:
        run.times = []
        began = time.process_time()
        drive_missing(study, run, workers, lambda finished, record: None)
        driven = time.process_time()
        run.close()
        closed = time.process_time()
    return Cost((closed - began) / tasks, (closed - driven) / tasks, statistics.median(run.times))


class OneByOne:
    """Makes the oldest call as soon as so many wait, so that the driver always waits for one of so many."""

    def __init__(self, tasks: int, at_once: int) -> None:
        self._left, self._at_once = tasks, at_once
        self._waiting: deque[tuple[Future[Any], Callable[..., Any], Any]] = deque()

    def start(self, function: Callable[..., Any], task: Any) -> "Future[Any]":
        """Take a call in."""
        future: Future[Any] = Future()
        self._waiting.append((future, function, task))
        self._left -= 1
        while self._waiting and (len(self._waiting) >= self._at_once or not self._left):
            oldest, made, of = self._waiting.popleft()
            oldest.set_result(made(of))
        return future


def in_process(file: str, folder: Path, tasks: int, at_once: int) -> Cost:
    calls = OneByOne(tasks, at_once)
    return drive(folder, tasks, Cheap(file, at_once, lambda: Place(calls.start)))


def on_processes(file: str, folder: Path, tasks: int) -> Cost:
    with Cheap(file, 2) as workers:
        list(workers.run(run_episode, list(make_study(stacks=["parked"], episodes=2).tasks())))  # they start
        return drive(folder, tasks, workers)


def processor_time(process: int) -> float:
    """[s] of a process so far (Linux)."""
    fields = Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / TICKS


def on_dask(file: str, folder: Path, tasks: int) -> Cost:
    """Two workers and a scheduler on this machine."""
    from harness.execution.dask_cluster import DaskCluster

    where = folder.parent / "scheduler.json"
    common = ["--host", "127.0.0.1", "--no-dashboard", "--scheduler-file", str(where)]
    worker = ["distributed.cli.dask_worker", *common, "--nthreads", "1", "--no-nanny", "--memory-limit", "0"]
    worker += ["--local-directory", str(folder.parent)]
    with contextlib.ExitStack() as ending:

        def start(*command: str) -> "subprocess.Popen[bytes]":
            process = subprocess.Popen([*DASK, *command], stderr=subprocess.DEVNULL)
            ending.callback(process.wait)
            ending.callback(process.terminate)
            return process

        scheduler = start("distributed.cli.dask_scheduler", *common, "--port", "0")
        while not where.exists():
            time.sleep(0.1)
        address = json.loads(where.read_text())["address"]
        for _ in range(2):
            start(*worker)
        cluster = ending.enter_context(DaskCluster(address, (), (), print))
        while cluster.room() < 2:
            time.sleep(0.1)
        workers = Cheap(file, 2, cluster.place, 600.0, cluster.room)
        list(workers.run(run_episode, list(make_study(stacks=["parked"], episodes=4).tasks())))  # they import
        before = processor_time(scheduler.pid)
        cost = drive(folder, tasks, workers)
        return Cost(cost.driver, cost.closing, cost.add, (processor_time(scheduler.pid) - before) / tasks)


def deliveries(stack: str, count: int) -> tuple[list[Delivery], list[float]]:
    """Deliveries with the processor time [s] of each."""
    tasks = list(make_study(stacks=[stack], episodes=count, workers=1).tasks())
    run_episode(tasks[0])
    made, times = [], []
    for task in tasks:
        began = time.process_time()
        made.append(run_episode(task))
        times.append(time.process_time() - began)
    return made, times


def stored(run: Path, stack: str) -> tuple[list[Delivery], list[float]]:
    """A stack's deliveries of a finished run, with the wall time [s] of each, its set-up included."""
    episodes, events, timings = (pq.read_table(run / f"{table}.parquet").to_pylist() for table in TABLES)
    own = [row for row in episodes if row["stack"] == stack and not row["error"]]
    if not own:
        sys.exit(f"{run} has no deliveries of {stack}")
    of = {row["episode"]: ([], None) for row in own}
    of |= {each["episode"]: ([], each) for each in timings if each["stack"] == stack and each["episode"] in of}
    for event in events:
        if event["stack"] == stack and event["episode"] in of:
            of[event["episode"]][0].append(event)
    made = [Delivery(row, *of[row["episode"]], None, None) for row in own]
    return made, [each.timing["setup_s"] + each.timing["wall_s"] for each in made]


def kept_in_memory(known: list[Delivery]) -> float:
    """[bytes] that the driver keeps of a finished delivery until its tables are written."""
    messages = [pickle.dumps(known[i % len(known)]) for i in range(1000)]
    tracemalloc.start()
    records = [{"row": each.row, "timing": each.timing} for each in map(pickle.loads, messages)]
    size, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    return size / len(records)


def print_sizes(run: Path, known: list[Delivery]) -> None:
    """What a finished run takes on disk, and what its journal took until then."""
    count = pq.read_metadata(run / "episodes.parquet").num_rows
    print(f"\nsize of {run.name} on disk, {count} deliveries, in MB per 1000 of them")
    for name in ("episodes.parquet", "events.parquet", "timings.parquet"):
        print(f"  {name:<20}{(run / name).stat().st_size / count / 1000.0:8.2f}")
    lines = [json.dumps({"row": each.row, "events": each.events, "timing": each.timing}) for each in known]
    print(f"  {'journal meanwhile':<20}{statistics.mean(map(len, lines)) / 1000.0:8.2f}")
    recordings = list((run / "recordings").glob("*.npz"))
    if recordings:
        size = sum(file.stat().st_size for file in recordings) / len(recordings) / 1000.0
        print(f"  {'recordings':<20}{size:8.0f}   ({len(recordings)} of them)")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--stack", default="nav2-gps")
    parser.add_argument("--deliveries", type=int, default=4)
    parser.add_argument("--tasks", type=int, default=1000)
    parser.add_argument("--at-once", type=int, nargs="+", default=[2, 64, 512])
    parser.add_argument("--processes", action="store_true")
    parser.add_argument("--dask", action="store_true")
    parser.add_argument("--run", type=Path)
    given = parser.parse_args()
    made, times = stored(given.run, given.stack) if given.run else deliveries(given.stack, given.deliveries)
    seconds, kind_of_time = statistics.mean(times), "processor" if given.run is None else "wall"
    simulated = sum(each.row["duration_s"] for each in made)
    print(f"{given.stack}: {seconds:.2f} s of {kind_of_time} time per delivery (n = {len(made)}: ", end="")
    print(f"{min(times):.2f} to {max(times):.2f}), {simulated / sum(times):.1f} simulated seconds per second")
    print(
        f"\n{'tasks by':<24}{'n':>6}{'driver ms':>11}{'of it tables':>14}{'add ms':>8}{'scheduler ms':>14}{'cores':>8}"
    )
    with tempfile.TemporaryDirectory() as name:
        file = str(Path(name) / "results.pickle")
        Path(file).write_bytes(pickle.dumps(made))
        kinds: dict[str, Callable[[Path], Cost]] = {
            f"itself, {count} at once": functools.partial(in_process, file, tasks=given.tasks, at_once=count)
            for count in given.at_once
        }
        if given.processes:
            kinds["2 processes"] = functools.partial(on_processes, file, tasks=given.tasks)
        if given.dask:
            kinds["2 Dask workers"] = functools.partial(on_dask, file, tasks=given.tasks)
        for number, (kind, measure) in enumerate(kinds.items()):
            cost = measure(folder=Path(name) / str(number))
            line = f"{kind:<24}{given.tasks:>6}{1e3 * cost.driver:>11.2f}{1e3 * cost.closing:>14.2f}"
            line += f"{1e3 * cost.add:>8.2f}{1e3 * cost.scheduler or float('nan'):>14.2f}"
            print(f"{line}{seconds / max(cost.driver + cost.add, cost.scheduler):>8.0f}", flush=True)
    print(f"\nmemory of the driver: {kept_in_memory(made) / 1000.0:.1f} MB per 1000 deliveries")
    if given.run is not None:
        print_sizes(given.run, made)


if __name__ == "__main__":
    main()
