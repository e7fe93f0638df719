"""Mutation testing: how many small faults, planted one at a time, do the nearest tests notice?

Usage: python -m tools.mutants [--sample 200] [--seed 0] [--checkpoint results/mutants.jsonl]
PATH...

A mutant is one changed operator, comparison, constant or function name somewhere below the given
paths. The sample is drawn evenly from all of them, by hashes: edits elsewhere leave it as it is.
Each mutant is tested in a copy of the tree by the NEAREST test files, until one fails: those with
the shortest chain of imports to its module, those in the folder that is called like its own, Nav2's
recordings, and deliveries of the published study. Tests marked slow are left out. Compiled kernels
of unchanged files are kept. Taking much longer than unchanged code counts as failing.

Not planted, because no test could tell the difference or should: changes in messages (f-strings and
``raise``), annotations, decorators, ``zip``'s ``strict``, and floats of at most ROUNDING, which
only guard against rounding. Drawn but not judged: those in equivalent_mutants.txt, which says of
each why no test could notice it.

Verdicts are kept in the checkpoint: an interrupted run goes on, and one after new tests judges what
they may notice.
"""

import argparse
import ast
import contextlib
import hashlib
import importlib
import json
import math
import os
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import hypothesis
import pytest

from tools.faults import ROOT, Mutant, find_mutants, read_equivalent

COPIED = (
    "navbench",
    "navstack",
    "harness",
    "params",
    "maps",
    "tests",
    "tools",
    "docs",
    "pyproject.toml",
)
TRACKED = ("results/baseline", "README.md", "CHANGELOG.md", "mkdocs.yml", "Makefile")
PACKAGES = ("navstack", "harness", "navbench")
LIBRARIES = (
    "numba",
    "scipy.optimize",
    "scipy.stats",
    "scipy.ndimage",
    "pyarrow.parquet",
    "ruamel.yaml",
    "rich.table",
)
FARTHEST = 2  # imports between a test and what it tests
NEAREST = 8  # files of tests that judge a mutant
WHOLE = (
    Path("tests/params/test_defaults.py"),
    Path("tests/parity/test_cases.py"),
    Path("tests/study/test_published_rows.py"),
)  # judge all
PASSING = (0, 5)  # exit codes of pytest: passed; nothing to run here
LONGEST = 120.0  # [s] of unchanged code: slower files of tests judge nothing
# a mutant may take so many times as long as unchanged code, and so many seconds [s]
PATIENCE, COMPILING = 3.0, 60.0
Z = 1.959964  # of a 95 % interval


@cache
def imports_of(file: Path) -> frozenset[Path]:
    """The files of this project that a file imports, anywhere in it."""
    names = set()
    for node in ast.walk(ast.parse((ROOT / file).read_bytes())):
        if isinstance(node, ast.Import):
            names |= {each.name for each in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            names |= {node.module, *(f"{node.module}.{each.name}" for each in node.names)}
    paths = {Path(name.replace(".", "/") + ".py") for name in names}
    return frozenset(
        path for path in paths if path.parts[0] in PACKAGES and (ROOT / path).is_file()
    )


@cache
def distances(test: Path) -> dict[Path, int]:
    """How many imports lie between a test file and each module that it reaches."""
    found, layer = {test: 0}, {test}
    for distance in range(1, FARTHEST + 1):
        layer = {file for each in layer for file in imports_of(each)} - found.keys()
        found |= dict.fromkeys(layer, distance)
    return found


@cache
def nearest_tests(file: Path) -> tuple[Path, ...]:
    """The test files that reach a module by the fewest imports, then those of its room.

    The likest called first.
    """
    words = set("_".join(file.with_suffix("").parts[1:]).split("_"))
    ranked = []
    for test in sorted(path.relative_to(ROOT) for path in (ROOT / "tests").rglob("test_*.py")):
        if file in distances(test) or set(test.parts[1:-1]) & set(file.parts[1:-1]):
            alike = len(words & set(test.stem.split("_")))
            ranked.append(
                (
                    distances(test).get(file, FARTHEST + 1),
                    -alike,
                    (ROOT / test).stat().st_size,
                    test,
                )
            )
    nearest = [test for *_, test in sorted(ranked)[:NEAREST]]
    return (*nearest, *(test for test in WHOLE if test not in nearest))


def copy_tree(source: Path, target: Path) -> None:
    """Copy the project by hard links, with compiled kernels, which stay valid."""
    for name in (*COPIED, *TRACKED):
        (target / name).parent.mkdir(parents=True, exist_ok=True)
        if (source / name).is_dir():
            shutil.copytree(source / name, target / name, copy_function=os.link)
        else:
            os.link(source / name, target / name)


def passes(folder: Path, test: Path, time_limit: float) -> bool:
    """Whether a file of tests passes in time in a copy.

    In a fork of this process, which has the libraries loaded.
    """
    child = os.fork()
    if not child:
        os.setsid()
        os.chdir(folder)
        sys.path[:] = [
            str(folder),
            *(path for path in sys.path if Path(path) not in (ROOT, ROOT / "tests")),
        ]
        os.environ["PYTHONPATH"] = str(folder)
        # what is kept there was computed by unchanged code
        os.environ["NAVSTACK_CACHE"] = str(folder / "cache")
        nowhere = os.open(os.devnull, os.O_RDWR)
        for stream in (0, 1, 2):
            os.dup2(nowhere, stream)
        hypothesis.settings.register_profile("same", deadline=None, derandomize=True, database=None)
        hypothesis.settings.load_profile("same")
        os._exit(
            pytest.main(
                [
                    "-x",
                    "-q",
                    "-p",
                    "no:cacheprovider",
                    "-p",
                    "no:xdist",
                    "-m",
                    "not slow",
                    str(test),
                ]
            )
        )
    end = time.monotonic() + time_limit
    while time.monotonic() < end:
        finished, status = os.waitpid(child, os.WNOHANG)
        if finished:
            return os.waitstatus_to_exitcode(status) in PASSING
        time.sleep(0.02)
    with contextlib.suppress(ProcessLookupError):
        os.killpg(child, signal.SIGKILL)
    os.waitpid(child, 0)
    return False


@cache
def seconds_unchanged(tree: Path, test: Path) -> float:
    """How long [s] a file of tests takes with unchanged code.

    Infinite: it fails, or it takes too long.
    """
    start = time.monotonic()
    return time.monotonic() - start if passes(tree, test, LONGEST) else math.inf


def killer(mutant: Mutant, unchanged: Path) -> Path | None:
    """The test file that notices a mutant, which is planted in a copy of an unchanged tree."""
    with tempfile.TemporaryDirectory(dir=ROOT.parent, ignore_cleanup_errors=True) as folder:
        copy = Path(folder)
        copy_tree(unchanged, copy)
        file = copy / mutant.file
        text = mutant.applied(file.read_bytes())
        file.unlink()  # the link, not what it leads to
        file.write_bytes(text)
        for test in nearest_tests(mutant.file):
            seconds = seconds_unchanged(unchanged, test)
            if math.isfinite(seconds) and not passes(copy, test, PATIENCE * seconds + COMPILING):
                return test
    return None


def wilson(killed: int, n: int) -> tuple[float, float]:
    """95 % interval of a share (Wilson 1927)."""
    centre = (killed + Z * Z / 2) / (n + Z * Z)
    width = Z * math.sqrt(killed * (n - killed) / n + Z * Z / 4) / (n + Z * Z)
    return centre - width, centre + width


def key(mutant: Mutant, judges: Sequence[Path] = ()) -> str:
    """A mutant's name for as long as its file, and its judges, are what they are."""
    content = hashlib.sha256(
        b"".join((ROOT / file).read_bytes() for file in (mutant.file, *judges))
    ).hexdigest()[:16]
    return f"{mutant.file}@{content}:{mutant.begin}-{mutant.end}:{mutant.text}"


def main() -> None:
    """Draw, judge, print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("paths", nargs="+")
    parser.add_argument("--sample", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--checkpoint", type=Path, default=ROOT / "results/mutants.jsonl")
    given = parser.parse_args()
    for library in LIBRARIES:
        importlib.import_module(library)
    every = find_mutants(given.paths)
    drawn = sorted(
        every,
        key=lambda mutant: hashlib.sha256(repr((given.seed, mutant.change)).encode()).digest(),
    )
    drawn = drawn[: given.sample]
    equivalent = read_equivalent()
    sample = [mutant for mutant in drawn if mutant.change not in equivalent]
    print(
        f"{len(drawn)} of {len(every)} mutants, {len(drawn) - len(sample)} of them equivalent",
        flush=True,
    )
    lines = given.checkpoint.read_text().splitlines() if given.checkpoint.exists() else []
    killers = {line["mutant"]: line["killer"] for line in map(json.loads, lines)}
    names = [
        (key(mutant), key(mutant, nearest_tests(mutant.file))) for mutant in sample
    ]  # of one killed, of a survivor
    killed = 0
    with tempfile.TemporaryDirectory(dir=ROOT.parent, ignore_cleanup_errors=True) as unchanged:
        copy_tree(ROOT, Path(unchanged))
        for n, (mutant, name) in enumerate(zip(sample, names, strict=True), 1):
            test = killers.get(name[0])
            if test is None and name[1] not in killers:
                test = killer(mutant, Path(unchanged))
                with given.checkpoint.open("a") as checkpoint:
                    line = {"mutant": name[test is None], "killer": test and str(test)}
                    checkpoint.write(json.dumps(line) + "\n")
            killed += test is not None
            if test is None:
                print("survived:", *mutant.change, sep="\n", flush=True)
            if n % 10 == 0 or n == len(sample):
                low, high = wilson(killed, n)
                print(f"{n}: {killed} killed, {killed / n:.3f} [{low:.3f}, {high:.3f}]", flush=True)


if __name__ == "__main__":
    main()
