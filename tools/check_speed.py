"""Is the working tree slower than a commit, and are its rows the same?

Usage: python -m tools.check_speed --against COMMIT [--tolerance 0.15] [--quick] [--rows 20]

The commit is exported (git archive) into a temporary folder. A process of each version drives the
first 20 s of the same deliveries, never both at a time, in the order commit, tree, tree, commit;
what counts is processor time per simulated second. Tree over commit is given with a 95 % interval
(bootstrap over deliveries), for each closed loop of
:mod:`tools.bench`. The check fails only where the whole interval lies above 1 + tolerance: a busy
machine widens the interval, it does not fail the check. The first delivery of an exported commit
compiles for half a minute or more.

--rows N also drives N whole deliveries of each loop and compares their rows; the check fails where
they differ, and says in which columns. COMMIT may also be a folder that holds another tree.

Exit status 0: not slower (and the same rows); 1: slower, other rows, or not done within
--time-limit.
"""

import argparse
import contextlib
import json
import math
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np

from harness.statistics.bootstrap import bootstrap_mean
from harness.statistics.interval import Interval
from tools.bench.loops import LOOPS
from tools.bench.loops import __file__ as DRIVER

ROOT = Path(__file__).resolve().parents[1]
SECONDS = 20.0  # simulated, of a timed delivery
DELIVERIES, QUICK_DELIVERIES = 12, 6  # of each loop; each is driven twice by both
QUICK_LOOPS = ("paper-gps incremental",)
TIME_LIMIT = 1800.0  # [s]

Answer = Mapping[str, Any]  # fields of tools.bench.loops.Driven


class Driver:
    """Drives deliveries in a process of its own, with the code of another folder."""

    def __init__(self, tree: Path) -> None:
        if not (tree / "harness" / "episode" / "episode.py").is_file():
            raise Failure(f"{tree} holds no version of this program")
        self._tree = tree
        environment = {**os.environ, "PYTHONPATH": str(tree)}
        self._process = subprocess.Popen(
            [sys.executable, "-P", str(DRIVER)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=environment,
            cwd=tree,
        )

    def ask(self, loop: str, episode: int, seconds: float | None) -> None:
        """Begin a delivery."""
        assert self._process.stdin is not None
        with contextlib.suppress(BrokenPipeError):  # it has died: there will be no answer
            print(
                json.dumps({"loop": loop, "episode": episode, "seconds": seconds}),
                file=self._process.stdin,
                flush=True,
            )

    def answer(self) -> Answer:
        """How the delivery went that was asked for.

        Raises:
            Failure: the process has died.
        """
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            raise Failure(f"the version in {self._tree} does not drive; what it said stands above")
        given: Answer = json.loads(line)
        if Path(given["program"]) != self._tree.resolve():
            raise Failure(
                f"{self._tree} holds no version of this program: {given['program']} drove in its "
                "place"
            )
        return given

    def end(self) -> None:
        """End the process, whatever it is doing."""
        self._process.kill()
        self._process.wait()


class Failure(Exception):
    """The check cannot be done."""


def drive(driver: Driver, loop: str, episode: int, seconds: float | None) -> Answer:
    driver.ask(loop, episode, seconds)
    return driver.answer()


@dataclass(frozen=True)
class Speed:
    """Processor time per simulated second, tree over commit."""

    loop: str
    ratio: Interval

    def is_slower(self, tolerance: float) -> bool:
        """Whether surely so, by more than is tolerated."""
        return self.ratio.low is not None and self.ratio.low > 1.0 + tolerance


def compare_speed(
    before: Driver,
    after: Driver,
    loop: str,
    deliveries: int,
    seconds: float,
) -> Speed:
    """Drive the beginnings of some deliveries twice with each version, in the order ABBA."""
    for driver in (before, after):
        drive(driver, loop, 0, seconds)  # compiles and fills caches
    logarithms = []
    for episode in range(deliveries):
        took = {id(before): 0.0, id(after): 0.0}
        for driver in (before, after, after, before):
            driven = drive(driver, loop, episode, seconds)
            took[id(driver)] += driven["processor"] / driven["simulated"]
        logarithms.append(math.log(took[id(after)] / took[id(before)]))
    interval = bootstrap_mean(logarithms, np.random.default_rng(0))
    bounds = (
        None if each is None else math.exp(each)
        for each in (interval.value, interval.low, interval.high)
    )
    return Speed(loop, Interval(*bounds, interval.n))


@dataclass(frozen=True)
class Rows:
    """Rows of the same deliveries in both versions."""

    loop: str
    compared: int
    differing: tuple[int, ...]  # numbers of deliveries
    columns: tuple[str, ...]  # in which any of them differs
    only_in_one: tuple[str, ...]  # columns that one version does not have
    lost: bool = False  # whether the new version lacks one of the old


def compare_rows(before: Driver, after: Driver, loop: str, deliveries: int) -> Rows:
    """Drive whole deliveries with both versions and compare their rows, to the last digit."""
    differing, columns, only_in_one, lost = [], set(), set(), False
    for episode in range(deliveries):
        for driver in (before, after):
            driver.ask(loop, episode, None)
        old, new = (driver.answer()["row"] for driver in (before, after))
        other = {
            key for key in old.keys() & new.keys() if json.dumps(old[key]) != json.dumps(new[key])
        }
        only_in_one |= old.keys() ^ new.keys()
        lost = lost or bool(old.keys() - new.keys())
        columns |= other
        if other:
            differing.append(episode)
    return Rows(
        loop, deliveries, tuple(differing), tuple(sorted(columns)), tuple(sorted(only_in_one)), lost
    )


@contextlib.contextmanager
def version(given: str, tree: Path) -> Iterator[Path]:
    """The folder with a commit's files, or the folder that was given."""
    if Path(given).is_dir():
        yield Path(given).resolve()
        return
    with tempfile.TemporaryDirectory(prefix="check_speed-") as folder:
        archive = subprocess.run(
            ["git", "-C", str(tree), "archive", given], capture_output=True, check=False
        )
        if archive.returncode:
            raise Failure(
                f"--against {given} is neither a commit of {tree} nor a folder; give one, e.g. "
                "HEAD~1"
            )
        subprocess.run(["tar", "-x", "-C", folder], input=archive.stdout, check=True)
        yield Path(folder)


def too_late(number: int, frame: FrameType | None) -> None:
    raise Failure(
        "the check is not done within --time-limit; give more time, --quick, or fewer --loop"
    )


def check(before: Driver, after: Driver, arguments: argparse.Namespace) -> bool:
    """Compare and print; whether all is well."""
    is_well = True
    deliveries, loops = DELIVERIES, tuple(LOOPS)
    if arguments.quick:
        deliveries, loops = QUICK_DELIVERIES, QUICK_LOOPS
    deliveries = arguments.deliveries or deliveries
    for loop in arguments.loop or loops:
        speed = compare_speed(before, after, loop, deliveries, arguments.seconds)
        ratio, slower = speed.ratio, speed.is_slower(arguments.tolerance)
        is_well = is_well and not slower
        span, verdict = "", "not slower"
        if ratio.low is not None:
            span = f" [{ratio.low:.3f}, {ratio.high:.3f}]"
        if slower:
            verdict = "SLOWER"
        print(
            f"{loop}: time of the tree / {arguments.against}: {ratio.value:.3f}{span}, n = "
            f"{ratio.n}: {verdict}",
            flush=True,
        )
        if arguments.rows:
            is_well = show_rows(compare_rows(before, after, loop, arguments.rows)) and is_well
    return is_well


def show_rows(rows: Rows) -> bool:
    """Print how rows differ; whether they do not."""
    shared = ""
    if rows.only_in_one:
        print(f"{rows.loop}: columns of one version only: {', '.join(rows.only_in_one)}")
        shared = " in the columns of both"
    if not rows.differing:
        same = f"{rows.compared} of {rows.compared} rows are identical{shared}"
        print(f"{rows.loop}: {same}", flush=True)
        return not rows.lost
    count = (
        f"{len(rows.differing)} of {rows.compared} rows DIFFER, the first is delivery "
        f"{rows.differing[0]}"
    )
    print(f"{rows.loop}: {count}; columns: {', '.join(rows.columns)}", flush=True)
    return False


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--against", required=True, metavar="COMMIT")
    parser.add_argument(
        "--tree",
        type=Path,
        default=ROOT,
        help="default: the checkout of this script",
    )
    parser.add_argument(
        "--tolerance",
        type=float,
        default=0.15,
        help="share by which it may be slower; default: 0.15",
    )
    parser.add_argument(
        "--loop",
        action="append",
        choices=LOOPS,
        help="repeatable; default: all, with --quick one",
    )
    parser.add_argument("--deliveries", type=int, help=f"timed of each loop; default: {DELIVERIES}")
    parser.add_argument(
        "--seconds",
        type=float,
        default=SECONDS,
        help="simulated, of each; default: 20",
    )
    parser.add_argument(
        "--rows",
        type=int,
        default=0,
        metavar="N",
        help="whole deliveries of each loop to compare",
    )
    parser.add_argument(
        "--quick", action="store_true", help=f"{QUICK_DELIVERIES} deliveries of one loop"
    )
    parser.add_argument("--time-limit", type=float, default=TIME_LIMIT, help="[s]; default: 1800")
    arguments = parser.parse_args()
    signal.signal(signal.SIGALRM, too_late)
    signal.setitimer(signal.ITIMER_REAL, arguments.time_limit)
    try:
        with version(arguments.against, arguments.tree) as folder, contextlib.ExitStack() as stack:
            before, after = Driver(folder), Driver(arguments.tree.resolve())
            stack.callback(before.end)
            stack.callback(after.end)
            return 0 if check(before, after, arguments) else 1
    except Failure as failure:
        print(f"check_speed: {failure}", file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main())
