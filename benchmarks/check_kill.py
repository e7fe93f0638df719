"""A run that is killed at a random moment, and resumed, gives the rows of an uninterrupted one; a full disk loses none.

Usage: python benchmarks/check_kill.py [--kills N] [--episodes N] [--seed S]

Each time, ``navbench run`` (2 workers, ``parked``, short deliveries) and all of its processes get SIGKILL at a moment
spread evenly over its deliveries: a random time after a random number of them (none: during the start). ``--resume``
goes on. Compared are the SHA-256 of ``episodes.parquet``, ``events.parquet`` and ``summary.json``. Then the same run
writes to a file system that has no room for all of it: a tmpfs where mounting is allowed, otherwise under a limit on
the size of a file. Exit status 1 on any difference.
"""

import argparse
import contextlib
import hashlib
import os
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from harness.storage.run_folder import count_finished

NAVBENCH = [sys.executable, "-c", "from harness.cli.app import main; main()", "run"]
COMPARED = ("episodes.parquet", "events.parquet", "summary.json")
RULES = "arrival_radius: 2.0\ntimeout: 1.0\nmax_tilt: 0.5\nimpulse_health: 177.78\nspoiled_fraction: 0.05\n"
DISK = 65_536  # [bytes] of the small file system: room for the parameters and for some deliveries


def arguments(folder: Path, out: Path, episodes: int) -> list[str]:
    (folder / "short.yaml").write_text(RULES)
    study = ["--stack", "parked", "--pedestrians", "5", "--rules", str(folder / "short.yaml"), "--workers", "2"]
    return [*study, "--episodes", str(episodes), "--out", str(out)]


def navbench(*given: str) -> "subprocess.CompletedProcess[str]":
    return subprocess.run([*NAVBENCH, *given], capture_output=True, text=True, check=False)


def digests(out: Path) -> list[str]:
    return [hashlib.sha256((out / name).read_bytes()).hexdigest() for name in COMPARED]


def kill_after(finished: int, delay: float, given: list[str], out: Path) -> bool:
    """Start a run and kill it with all of its processes; whether it was still running.

    Args:
        finished: number of deliveries to wait for.
        delay: [s] to wait after that.
        given: the command's arguments.
        out: its run folder.
    """
    process = subprocess.Popen(
        [*NAVBENCH, *given], start_new_session=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    while process.poll() is None and count_finished(out) < finished:
        time.sleep(0.005)
    with contextlib.suppress(subprocess.TimeoutExpired):
        process.wait(delay)
    was_running = process.poll() is None
    if was_running:
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    return was_running


def check_kills(folder: Path, episodes: int, kills: int, rng: np.random.Generator) -> int:
    """Kill and resume; returns the number of runs that differ."""
    began = time.monotonic()
    done = navbench(*arguments(folder, folder / "whole", episodes))
    length = time.monotonic() - began
    assert done.returncode == 0, done.stderr
    expected = digests(folder / "whole")
    print(f"uninterrupted: {length:.1f} s, {expected[0][:16]} (episodes), {expected[1][:16]} (events)")
    different = 0
    for number in range(kills):
        out, after = folder / f"killed{number}", int(rng.integers(0, episodes))
        delay = rng.uniform(0.0, 1.0) * (length / episodes if after else length / 2.0)
        was_running = kill_after(after, delay, arguments(folder, out, episodes), out)
        finished = count_finished(out)
        if (out / "run.json").exists():
            resumed = navbench("--resume", str(out))
        else:  # killed before there was a run: it begins anew
            shutil.rmtree(out, ignore_errors=True)
            resumed = navbench(*arguments(folder, out, episodes))
        equal = resumed.returncode == 0 and digests(out) == expected
        different += not equal
        how = f"killed after {finished} deliveries" if was_running else "had ended"
        print(f"{number + 1:>3}  {how:<28}{'equal' if equal else 'DIFFERENT ' + resumed.stderr}", flush=True)
        shutil.rmtree(out)
    print(f"{kills - different} of {kills} resumed runs equal the uninterrupted one")
    return different


def check_full_disk(folder: Path, episodes: int) -> int:
    """Run out of room; returns the number of complaints about how that ended."""
    small = folder / "small"
    small.mkdir()
    mounted = mount(small)
    limit = None if mounted else lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))
    try:
        out = small / "run"
        done = subprocess.run(
            [*NAVBENCH, *arguments(folder, out, episodes)],
            preexec_fn=limit,
            capture_output=True,
            text=True,
            check=False,
        )
        lines = [line for line in done.stderr.splitlines() if line.startswith("navbench:")]
        finished = count_finished(out)
        how = "tmpfs" if mounted else "limit on the size of a file"
        print(f"full disk ({how}): status {done.returncode}, {finished} deliveries are kept")
        print("\n".join(lines))
        clear = done.returncode == 1 and len(lines) == 1 and "Traceback" not in done.stderr and finished > 0
        moved = folder / "moved"
        shutil.copytree(out, moved)
        resumed = navbench("--resume", str(moved))
        equal = resumed.returncode == 0 and digests(moved) == digests(folder / "whole")
        print(f"resumed where there is room: {'equal' if equal else 'DIFFERENT ' + resumed.stderr}")
        return (not clear) + (not equal)
    finally:
        if mounted:
            subprocess.run(["umount", str(small)], check=True)


def mount(folder: Path) -> bool:
    """Put a small file system on a folder, if that is allowed."""
    command = ["mount", "-t", "tmpfs", "-o", f"size={DISK}", "tmpfs", str(folder)]
    try:
        return subprocess.run(command, capture_output=True, check=False).returncode == 0
    except FileNotFoundError:
        return False


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--episodes", type=int, default=40)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        failures = check_kills(folder, given.episodes, given.kills, np.random.default_rng(given.seed))
        failures += check_full_disk(folder, given.episodes)
    sys.exit(1 if failures else 0)


if __name__ == "__main__":
    main()
