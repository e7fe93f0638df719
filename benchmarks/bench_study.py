"""How long a study takes: 100 deliveries each of two stacks, both tables, and the comparison; on all cores.

Usage: python benchmarks/bench_study.py [--episodes 100] [--workers 2] [--limit 240]

The stacks are paper-gps and nav2-amcl as they are shipped, but with IncrementalNavfn as planner. What is timed is what
a user types: ``navbench run`` and ``navbench compare``, their start included, after a delivery of each that fills the
caches and does not count. Wall time: on a machine that does nothing else. Exit status 1 if it takes longer than
``--limit``, or a command fails.
"""

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from harness.bench.loops import INCREMENTAL, NAVFN
from harness.bench.machine import load, machine
from harness.storage.shipped import shipped

NAVBENCH = [sys.executable, "-c", "from harness.cli.app import main; main()"]
STACKS = {"paper-gps": "tuned", "nav2-amcl": "amcl"}  # and their Nav2 files


def write_stack(name: str, nav2: str, folder: Path) -> Path:
    """A stack like a shipped one, with the other planner."""
    text = (shipped("params") / "nav2" / f"{nav2}.yaml").read_text()
    file = folder / f"{nav2}-incremental.yaml"
    file.write_text(text.replace(NAVFN, INCREMENTAL))
    stack = (shipped("params") / "stacks" / f"{name}.yaml").read_text()
    changed = folder / f"{name}-incremental.yaml"
    changed.write_text(stack.replace(f"nav2_file: {nav2} ", f"nav2_file: {file} "))
    return changed


def navbench(*words: object) -> float:
    """Run a command; its wall time in [s]."""
    began = time.perf_counter()
    subprocess.run([*NAVBENCH, *map(str, words)], check=True)
    return time.perf_counter() - began


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--episodes", type=int, default=100)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--limit", type=float, default=240.0, help="[s]")
    arguments = parser.parse_args()
    print(f"machine: {machine()}; {load():.1f} processes want a core already", flush=True)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        stacks = [write_stack(stack, nav2, folder) for stack, nav2 in STACKS.items()]
        both = [word for stack in stacks for word in ("--stack", stack)]
        navbench("run", *both, "--episodes", 1, "--out", folder / "warm")
        driving = navbench(
            "run", *both, "--episodes", arguments.episodes, "--workers", arguments.workers, "--out", folder / "study"
        )
        comparing = navbench("compare", *(f"{folder / 'study'}:{stack.stem}" for stack in stacks))
    total = driving + comparing
    verdict = "within" if total <= arguments.limit else "LONGER THAN"
    count = len(STACKS) * arguments.episodes
    print(f"{count} deliveries and both tables {driving:.1f} s, the comparison {comparing:.1f} s: {total:.1f} s, "
          f"{verdict} {arguments.limit:g} s")  # fmt: skip
    return 0 if total <= arguments.limit else 1


if __name__ == "__main__":
    sys.exit(main())
