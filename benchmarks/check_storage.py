"""Does nothing get lost, and does no change pass unseen? Kills runs at random moments, and edits run folders.

Usage: python benchmarks/check_storage.py [--kills N] [--edits N] [--seed S]

A run of 6 deliveries (nav2-gps-ekf, 20 people, 6 s each) is the model. Then every run is killed with SIGKILL, its
workers with it, at a moment drawn from the time that the model took, and resumed: tables and summary must be those of
the model, byte for byte. An edit changes a random byte of a random file of a finished run's folder, cuts the file, or
removes it; ``navbench verify`` must notice.
"""

import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from options import parsed

from harness.storage.run_folder import MANIFEST

NAVBENCH = [sys.executable, "-m", "navbench"]
SAME = ("episodes.parquet", "events.parquet", "summary.json")  # whatever the machine does
RULES = "arrival_radius: 2.0\ntimeout: 6.0\nmax_tilt: 0.5\nimpulse_health: 177.78\nspoiled_fraction: 0.05\n"


def arguments(folder: Path) -> list[str]:
    """Of the run."""
    rules = folder.parent / "short.yaml"
    rules.write_text(RULES)
    return [
        "--stack",
        "nav2-gps-ekf",
        "--episodes",
        "10",
        "--workers",
        "2",
        "--rules",
        str(rules),
        "--out",
        str(folder),
    ]


def drive(*given: str) -> subprocess.Popen[bytes]:
    """A run, the first of a process group."""
    command = [*NAVBENCH, "run", *given]
    return subprocess.Popen(command, start_new_session=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def same(folder: Path) -> dict[str, bytes]:
    """What must not hang on how often the run was cut off."""
    return {name: (folder / name).read_bytes() for name in SAME}


def killed(folder: Path, after: float) -> str:
    """Begin a run, kill it, and finish it; what was on disk by then."""
    process = drive(*arguments(folder))
    time.sleep(after)
    was_over = process.poll() is not None
    if not was_over:
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    has_begun = (folder / MANIFEST).exists()
    if drive(*(("--resume", str(folder)) if has_begun else arguments(folder))).wait() != 0:
        return "failed"
    return "was over" if was_over else ("resumed" if has_begun else "begun anew")


def edit(folder: Path, rng: random.Random) -> str:
    """Change something in a run folder; what."""
    path = rng.choice(sorted(each for each in folder.rglob("*") if each.is_file() and each.stat().st_size))
    content, how = bytearray(path.read_bytes()), rng.choice(("a byte of", "the end of", "all of"))
    if how == "all of":
        path.unlink()
    else:
        at = rng.randrange(len(content))
        if how == "a byte of":
            content[at] ^= 1 + rng.randrange(255)
        path.write_bytes(content if how == "a byte of" else content[:at])
    return f"{how} {path.relative_to(folder)}"


def main() -> int:
    """0 if every killed run came out as the model did, and every edit was noticed."""
    given = parsed(__doc__, kills=50, edits=20, seed=0)
    rng, told, missed = random.Random(given.seed), [], []
    with tempfile.TemporaryDirectory() as root:
        model = Path(root) / "model" / "run"
        model.parent.mkdir()
        began = time.monotonic()
        if drive(*arguments(model)).wait() != 0:
            sys.exit("the model failed")
        whole = time.monotonic() - began
        for n in range(given.kills):
            folder = Path(root) / f"killed-{n}" / "run"
            folder.parent.mkdir()
            told.append(killed(folder, rng.uniform(0.0, whole)))
            if told[-1] == "failed" or same(folder) != same(model):
                missed.append(f"kill {n}: {told[-1]}")
            shutil.rmtree(folder.parent)
        for n in range(given.edits):
            folder = Path(root) / f"edited-{n}"
            shutil.copytree(model, folder)
            what = edit(folder, rng)
            if subprocess.run([*NAVBENCH, "verify", str(folder), "--sample", "0"], capture_output=True).returncode == 0:
                missed.append(f"edit {n}: {what} was not noticed")
    counts = ", ".join(f"{told.count(each)} {each}" for each in sorted(set(told)))
    print(f"{given.kills} kills ({counts}) and {given.edits} edits: {len(missed)} missed")
    print("\n".join(missed))
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
