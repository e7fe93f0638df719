"""Mutation testing: how many small faults, planted one at a time, do the nearest tests notice?

Usage: python tests/mutants.py [--sample 200] [--seed 0] [--workers 2] PATH...

A mutant is one changed operator, comparison, constant or function name somewhere below the given paths. The sample is
drawn evenly from all of them. Each mutant is tested in a copy of the tree: first by the test files that import its
module, then by the tests in the folder of the same name, until one fails. A run that takes too long counts as killed.
"""

import argparse
import ast
import math
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
COPIED = ("navbench", "navstack", "harness", "params", "maps", "tests", "benchmarks", "docs", "pyproject.toml")
TRACKED = ("results/baseline", "README.md", "CHANGELOG.md", "mkdocs.yml", "Makefile")
PASSED, NOTHING_COLLECTED = 0, 5  # exit codes of pytest
SLOWEST = 600.0  # [s] of a run of unchanged code
PATIENCE = 3.0  # a mutant may take so many times as long as unchanged code, and a minute for compiling
COMPARED = {ast.Lt: ("<", "<="), ast.LtE: ("<=", "<"), ast.Gt: (">", ">="), ast.GtE: (">=", ">"),
            ast.Eq: ("==", "!="), ast.NotEq: ("!=", "==")}  # fmt: skip
OPERATED = {ast.Add: ("+", "-"), ast.Sub: ("-", "+"), ast.Mult: ("*", "/"), ast.Div: ("/", "*"),
            ast.FloorDiv: ("//", "/"), ast.Mod: ("%", "*")}  # fmt: skip
RENAMED = {"min": "max", "max": "min", "minimum": "maximum", "maximum": "minimum", "ceil": "floor", "floor": "ceil",
           "sin": "cos", "cos": "sin", "argmin": "argmax", "argmax": "argmin", "any": "all", "all": "any"}  # fmt: skip
Z = 1.959964  # of a 95 % interval


@dataclass(frozen=True, slots=True)
class Mutant:
    """One change of one file."""

    file: Path  # relative to the root
    line: int
    begin: int  # offsets into the file's bytes
    end: int
    text: str

    def applied(self, source: bytes) -> bytes:
        """The file with the change."""
        return source[: self.begin] + self.text.encode() + source[self.end :]


@dataclass(frozen=True, slots=True)
class Verdict:
    """What the tests said of a mutant."""

    mutant: Mutant
    killed: bool
    seconds: float


class Finder(ast.NodeVisitor):
    """Collects the changes of a file: (node to replace or span, new text)."""

    def __init__(self, file: Path, source: bytes) -> None:
        self.file, self.source, self.found = file, source, list[Mutant]()
        self.starts = [0, *(match.end() for match in re.finditer(rb"\n", source))]

    def offset(self, line: int, column: int) -> int:
        """Where a place of the syntax tree stands in the file's bytes."""
        return self.starts[line - 1] + column

    def span(self, node: ast.expr) -> tuple[int, int]:
        """The bytes of an expression."""
        assert node.end_lineno is not None and node.end_col_offset is not None
        return self.offset(node.lineno, node.col_offset), self.offset(node.end_lineno, node.end_col_offset)

    def add(self, node: ast.expr, begin: int, end: int, text: str) -> None:
        self.found.append(Mutant(self.file, node.lineno, begin, end, text))

    def between(self, left: ast.expr, right: ast.expr, symbol: str, text: str) -> None:
        """Replace the operator between two operands."""
        begin, end = self.span(left)[1], self.span(right)[0]
        place = self.source.find(symbol.encode(), begin, end)
        if place >= 0 and b"#" not in self.source[begin:end]:
            self.add(left, place, place + len(symbol), text)

    def visit_Compare(self, node: ast.Compare) -> None:  # noqa: N802, D102
        left = node.left
        for operator, right in zip(node.ops, node.comparators, strict=True):
            if type(operator) in COMPARED:
                self.between(left, right, *COMPARED[type(operator)])
            left = right
        self.generic_visit(node)

    def visit_BinOp(self, node: ast.BinOp) -> None:  # noqa: N802, D102
        if type(node.op) in OPERATED and not (_is_text(node.left) or _is_text(node.right)):
            self.between(node.left, node.right, *OPERATED[type(node.op)])
        self.generic_visit(node)

    def visit_BoolOp(self, node: ast.BoolOp) -> None:  # noqa: N802, D102
        was, new = ("and", "or") if isinstance(node.op, ast.And) else ("or", "and")
        self.between(node.values[0], node.values[1], was, new)
        self.generic_visit(node)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> None:  # noqa: N802, D102
        if isinstance(node.op, ast.USub | ast.Not) and not isinstance(node.operand, ast.Constant):
            self.add(node, self.span(node)[0], self.span(node.operand)[0], "")
        self.generic_visit(node)

    def visit_Call(self, node: ast.Call) -> None:  # noqa: N802, D102
        begin, end = self.span(node.func)
        name = self.source[begin:end].decode().rpartition(".")[2]
        if name in RENAMED:
            self.add(node, end - len(name), end, RENAMED[name])
        elif name in ("abs", "fabs"):
            self.add(node, begin, end, "+")
        self.generic_visit(node)

    def visit_Constant(self, node: ast.Constant) -> None:  # noqa: N802, D102
        text = _other_value(node.value)
        if text is not None:
            self.add(node, *self.span(node), text)

    def visit_FunctionDef(self, node: ast.FunctionDef) -> None:  # noqa: N802, D102
        for each in (*node.args.defaults, *node.args.kw_defaults, *node.body):  # not decorators and annotations
            if each is not None:
                self.visit(each)

    def visit_ClassDef(self, node: ast.ClassDef) -> None:  # noqa: N802, D102
        for each in node.body:
            self.visit(each)

    def visit_AnnAssign(self, node: ast.AnnAssign) -> None:  # noqa: N802, D102
        if node.value is not None:
            self.visit(node.value)

    def visit_JoinedStr(self, node: ast.JoinedStr) -> None:  # noqa: N802, D102
        """Leave messages as they are."""

    def visit_Raise(self, node: ast.Raise) -> None:  # noqa: N802, D102
        """Leave messages as they are."""


def _is_text(node: ast.expr) -> bool:
    return isinstance(node, ast.JoinedStr) or (isinstance(node, ast.Constant) and isinstance(node.value, str))


def _other_value(value: object) -> str | None:
    if isinstance(value, bool):
        return str(not value)
    if isinstance(value, int):
        return str(value + 1)
    if isinstance(value, float) and math.isfinite(value):
        return repr(value * 1.5 if value else 1.0)
    return None


def find_mutants(paths: Sequence[str]) -> list[Mutant]:
    """Every mutant below files or folders, in their order."""
    files = [
        file for path in paths for file in ([ROOT / path] if path.endswith(".py") else (ROOT / path).rglob("*.py"))
    ]
    found = []
    for file in sorted(files):
        source = file.read_bytes()
        finder = Finder(file.relative_to(ROOT), source)
        finder.visit(ast.parse(source))
        found += finder.found
    return found


def nearest_tests(file: Path) -> list[str]:
    """The test files that import a module, then those of the folder that is called like its own."""
    module = ".".join(file.with_suffix("").parts)
    package, _, name = module.rpartition(".")
    imports = re.compile(rf"^\s*(from {re.escape(module)} import|from {re.escape(package)} import .*\b{name}\b)", re.M)
    tests = sorted(path.relative_to(ROOT) for path in (ROOT / "tests").rglob("test_*.py"))
    first = [test for test in tests if imports.search((ROOT / test).read_text(encoding="utf-8"))]
    neighbours = [test for test in tests if set(test.parts[1:-1]) & set(file.parts[1:-1])]
    return [str(test) for test in dict.fromkeys([*first, *neighbours])]


class Copy:
    """A copy of the tree, made of hard links but for the changed file: compiled kernels of other files stay valid."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        for name in (*COPIED, *TRACKED):
            source, copy = ROOT / name, folder / name
            copy.parent.mkdir(parents=True, exist_ok=True)
            if source.is_dir():
                shutil.copytree(source, copy, copy_function=os.link)
            else:
                os.link(source, copy)

    def change(self, mutant: Mutant) -> None:
        """Plant the mutant."""
        file = self.folder / mutant.file
        text = mutant.applied(file.read_bytes())
        file.unlink()  # the link, not what it leads to
        file.write_bytes(text)

    def test(self, tests: Sequence[str], time_limit: float) -> int | None:
        """Exit code of pytest; None: it took too long."""
        command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", *tests]
        environment = {**os.environ, "PYTHONPATH": str(self.folder), "HYPOTHESIS_DATABASE_FILE": os.devnull}
        with subprocess.Popen(command, cwd=self.folder, env=environment, stdout=subprocess.DEVNULL,
                              stderr=subprocess.DEVNULL, start_new_session=True) as process:  # fmt: skip
            try:
                return process.wait(time_limit)
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, 9)
                return None


def time_unchanged(test: str) -> float:
    """Seconds [s] that a test file takes with unchanged code.

    Raises:
        SystemExit: it fails, so that it would kill every mutant.
    """
    with tempfile.TemporaryDirectory(dir=ROOT.parent) as folder:
        start = time.monotonic()
        code = Copy(Path(folder)).test([test], SLOWEST)
        if code not in (PASSED, NOTHING_COLLECTED):
            sys.exit(f"unchanged code fails (exit code {code}): pytest -x {test}")
        return time.monotonic() - start


def judge(mutant: Mutant, tests: Sequence[str], time_limit: float) -> Verdict:
    """Run the nearest tests on one mutant."""
    start = time.monotonic()
    if not tests:
        return Verdict(mutant, False, 0.0)
    with tempfile.TemporaryDirectory(dir=ROOT.parent) as folder:
        copy = Copy(Path(folder))
        copy.change(mutant)
        code = copy.test(tests, time_limit)
    return Verdict(mutant, code != PASSED, time.monotonic() - start)


def judge_all(mutants: Sequence[Mutant], workers: int) -> Iterator[Verdict]:
    """Judge mutants side by side."""
    tests = {mutant.file: nearest_tests(mutant.file) for mutant in mutants}
    with ThreadPoolExecutor(workers) as pool:
        files = sorted({test for each in tests.values() for test in each})
        seconds = dict(zip(files, pool.map(time_unchanged, files), strict=True))
        limits = {file: PATIENCE * sum(seconds[test] for test in each) + 60.0 for file, each in tests.items()}
        yield from pool.map(lambda mutant: judge(mutant, tests[mutant.file], limits[mutant.file]), mutants)


def wilson(killed: int, n: int) -> tuple[float, float]:
    """95 % interval of a share (Wilson 1927)."""
    centre, width = (
        (killed + Z * Z / 2) / (n + Z * Z),
        Z * math.sqrt(killed * (n - killed) / n + Z * Z / 4) / (n + Z * Z),
    )
    return centre - width, centre + width


def describe(mutant: Mutant) -> str:
    """Where a mutant is and what it changes."""
    source = (ROOT / mutant.file).read_bytes()
    line = source.splitlines()[mutant.line - 1].decode().strip()
    return f"{mutant.file}:{mutant.line}: '{source[mutant.begin : mutant.end].decode()}' -> '{mutant.text}' in: {line}"


def main() -> None:
    """Draw, judge, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("paths", nargs="+")
    parser.add_argument("--sample", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--workers", type=int, default=2)
    given = parser.parse_args()
    every = find_mutants(given.paths)
    sample = random.Random(given.seed).sample(every, min(given.sample, len(every)))
    print(f"{len(sample)} of {len(every)} mutants", flush=True)
    killed = 0
    for n, verdict in enumerate(judge_all(sample, given.workers), 1):
        killed += verdict.killed
        if not verdict.killed:
            print(f"survived: {describe(verdict.mutant)}", flush=True)
        if n % 10 == 0 or n == len(sample):
            low, high = wilson(killed, n)
            print(f"{n}: {killed} killed, {killed / n:.3f} [{low:.3f}, {high:.3f}]", flush=True)


if __name__ == "__main__":
    main()
