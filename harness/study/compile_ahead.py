"""Kernels compiled side by side before the first delivery; numba by itself compiles one after the other.

``kernels.txt`` lists what deliveries call from Python, with the types of its arguments. Each module's kernels are
compiled by one process, which leaves them in numba's cache on disk; whoever calls them later finds them there. A file
in that cache tells what has been done. Whatever goes wrong here: a kernel that is not in the cache is compiled when it
is called.
"""

import contextlib
import fcntl
import gc
import hashlib
import importlib
import re
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, TextIO

import numba
from llvmlite.binding import get_host_cpu_name
from numba.core.caching import IndexDataCacheFile

from harness.execution.workers import Workers, available_cores
from harness.storage.shipped import compiled_code
from harness.task.stack import Stack
from navstack.jit import source_stamp

TABLE = Path(__file__).with_name("kernels.txt")
ALWAYS = "always"  # the section of the table that is needed whatever drives
PLUGIN = re.compile(r"\w+::\w+")  # a type in a Nav2 file
DONE, LOCK = "navbench-compiled.txt", "navbench-saving.lock"  # in the folder of compiled code
LEAST = 8  # kernels that are worth the start of processes
MOST_PROCESSES = 8  # the longest module takes as long as all others do with this many
TIME_LIMIT = 300.0  # [s] for the kernels of a module
SECONDS = 1.1  # [s] of processor time that a kernel takes, on average

_SAVE, _LOAD = IndexDataCacheFile.save, IndexDataCacheFile.load


@dataclass(frozen=True, slots=True)
class Kernel:
    """A kernel for one kind of arguments."""

    module: str
    name: str
    arguments: str  # their types in numba's notation, in brackets; named tuples as its module knows them

    @classmethod
    def of(cls, line: str) -> "Kernel":
        """From a line of the table, ``module.name(types)``."""
        path, bracket, arguments = line.partition("(")
        module, _, name = path.rpartition(".")
        return cls(module, name, bracket + arguments)

    @property
    def source(self) -> Path:
        """The file of its module."""
        return Path(__file__).parents[2].joinpath(*self.module.split(".")).with_suffix(".py")


def load_table() -> dict[Kernel, frozenset[str]]:
    """The kernels, those that take longest first, and the names of who needs them."""
    table: dict[Kernel, frozenset[str]] = {}
    for line in TABLE.read_text(encoding="utf-8").splitlines():
        if line.startswith("["):
            names = frozenset(line.strip("[]").split())
        elif line and not line.startswith("#"):
            table[Kernel.of(line)] = names
    return table


def needed_kernels(stacks: Sequence[Stack]) -> list[Kernel]:
    """What the deliveries of stacks call."""
    names = {ALWAYS} if stacks else set()
    for stack in stacks:
        text = Path(stack.nav2_file).read_text(encoding="utf-8", errors="replace") if stack.nav2_file else ""
        names |= {stack.name, stack.navigator, stack.planning_map, stack.localizer, *PLUGIN.findall(text)}
    return [kernel for kernel, needed_by in load_table().items() if names & needed_by]


def compile_ahead(stacks: Sequence[Stack]) -> None:
    """Compile what the deliveries of stacks need with all cores, unless it has been done; says so on stderr."""
    if numba.config.DISABLE_JIT or available_cores() == 1:
        return
    with contextlib.suppress(OSError):  # a folder that cannot be written, or a file system without locks
        marks = {kernel: _mark(kernel) for kernel in needed_kernels(stacks)}
        done = compiled_code() / DONE
        if len(_missing(marks, done)) < LEAST:
            return
        done.parent.mkdir(parents=True, exist_ok=True)
        with done.open("a+", encoding="utf-8") as file:
            _say(len(marks))
            fcntl.flock(file, fcntl.LOCK_EX)  # what another program compiles meanwhile is waited for
            missing = _missing(marks, done)
            _compile_all(missing)
            _note(file, marks.values())


def _compile_all(kernels: Sequence[Kernel]) -> None:
    """Compile kernels, module by module, in as many processes as there are cores."""
    modules: dict[str, list[Kernel]] = {}
    for kernel in kernels:
        modules.setdefault(kernel.module, []).append(kernel)
    processes = min(available_cores(), MOST_PROCESSES, len(modules))
    with (
        Workers(processes, time_limit=TIME_LIMIT) as workers,
        contextlib.closing(workers.run(compile_kernels, modules.values())) as ends,
    ):
        for _ in ends:  # errors show again where the kernel is called
            pass


def compile_kernels(kernels: Sequence[Kernel]) -> None:
    """Compile kernels one after the other into the cache, in a process of their own."""
    gc.disable()  # what compiling leaves behind ends with the process
    _save_in_turn(compiled_code() / LOCK)
    for kernel in kernels:
        module = importlib.import_module(kernel.module)
        getattr(module, kernel.name).compile(eval(kernel.arguments, vars(module), vars(numba.types)))


def _save_in_turn(lock: Path) -> None:
    """Let one process at a time touch the cache.

    Two that save the same function for different types at once can leave one's code under the other's name, and code is
    on disk a moment after the index tells of it.
    """

    def in_turn(method: Callable[..., Any]) -> Callable[..., Any]:
        def alone(*given: Any) -> Any:
            with lock.open("a") as file:
                fcntl.flock(file, fcntl.LOCK_EX)
                return method(*given)

        return alone

    IndexDataCacheFile.save, IndexDataCacheFile.load = in_turn(_SAVE), in_turn(_LOAD)


def _mark(kernel: Kernel) -> str:
    """What stands for a kernel in the list of what has been done; another one when numba would compile it anew."""
    state = (kernel, source_stamp(kernel.source), numba.__version__, sys.version, _processor())
    return hashlib.sha256(repr(state).encode()).hexdigest()[:16]


@cache
def _processor() -> str:
    return str(get_host_cpu_name())


def _missing(marks: dict[Kernel, str], done: Path) -> list[Kernel]:
    known = set(done.read_text(encoding="utf-8").split()) if done.exists() else set()
    return [kernel for kernel, mark in marks.items() if mark not in known]


def _note(file: TextIO, marks: Iterable[str]) -> None:
    """Keep what has been done; what has become of other kernels is of no interest."""
    file.seek(0)
    kept = {_mark(kernel) for kernel in load_table()} & set(file.read().split())
    file.truncate(0)
    file.write("\n".join(sorted(kept | set(marks))) + "\n")


def _say(kernels: int) -> None:
    seconds = SECONDS * kernels / min(available_cores(), MOST_PROCESSES) + 2.0
    sys.stderr.write(
        f"note: compiling {kernels} kernels, about {seconds:.0f} s; they are kept in {compiled_code()} for next time\n"
    )
    sys.stderr.flush()
