"""Kernels compiled side by side before the first delivery.

Numba by itself compiles one after the other. The registry's entries name the modules of an
algorithm's kernels; the annotations of a kernel that is called from Python say with which types
(:func:`navstack.jit.argument_types`). Each module's kernels are compiled by one process, which
leaves them in numba's cache on disk; whoever calls them later finds them there. A file in that
cache tells what has been done. Whatever goes wrong here: a kernel that is not in the cache is
compiled when it is called.
"""

import contextlib
import fcntl
import gc
import hashlib
import importlib
import re
import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, TextIO

import numba
from numba.core.caching import IndexDataCacheFile

from harness.execution.workers import Workers, available_cores
from harness.storage.shipped import compiled_code
from harness.task.stack import Stack
from navstack.jit import argument_types, processor, source_stamp
from navstack.params.registry.entry import AlgorithmEntry
from navstack.params.registry.localizers import LOCALIZERS
from navstack.params.registry.nodes import FAMILIES

PLUGIN = re.compile(r"\w+::\w+")  # a type in a Nav2 file
DONE, LOCK = "navbench-compiled.txt", "navbench-saving.lock"  # in the folder of compiled code
LEAST = 3  # modules that are worth the start of processes
MOST_PROCESSES = 8  # the longest module takes as long as all others do with this many
TIME_LIMIT = 300.0  # [s] for the kernels of a module
SECONDS = 3.0  # [s] of processor time that a module takes, on average
MONITOR = "navstack.safety.monitor_kernels"
WORLD = (  # what every delivery calls
    "harness.world.sensors.lidar_kernels",
    "harness.world.people.walk_kernels",
    "harness.world.physics.drive_kernels",
    "harness.world.physics.touch_kernels",
    "harness.world.physics.motion_kernels",
    "harness.task.shortest_paths",
)

_SAVE, _LOAD = IndexDataCacheFile.save, IndexDataCacheFile.load


def needed_modules(stacks: Sequence[Stack]) -> list[str]:
    """The modules whose kernels the deliveries of stacks call, those that take longest first."""
    entries: list[AlgorithmEntry] = []
    for stack in stacks:
        text = ""
        if stack.nav2_file:
            text = Path(stack.nav2_file).read_text(encoding="utf-8", errors="replace")
        named = set(PLUGIN.findall(text))
        for family in FAMILIES.values():
            entries += [entry for kind, entry in family.items() if kind in named]
        entries += [entry for name, entry in LOCALIZERS.items() if name == stack.localizer]
    if not stacks:
        return []
    return _modules_of(entries)


def _modules_of(entries: Iterable[AlgorithmEntry]) -> list[str]:
    modules = [module for entry in entries for module in entry.kernels]
    if modules:
        modules.append(MONITOR)
    return list(dict.fromkeys([*modules, *WORLD]))


def every_module() -> list[str]:
    """The modules of kernels of all registered algorithms and of the world."""
    entries: list[AlgorithmEntry] = [*LOCALIZERS.values()]
    for family in FAMILIES.values():
        entries += family.values()
    return _modules_of(entries)


def compile_ahead(stacks: Sequence[Stack]) -> None:
    """Compile what the deliveries of stacks need with all cores, unless it has been done.

    Says so on stderr.
    """
    config: Any = numba.config
    if not config.DISABLE_JIT and available_cores() > 1:
        compile_new(needed_modules(stacks), LEAST)


def compile_new(modules: Sequence[str], least: int = 1) -> None:
    """Compile those modules that have not been compiled, if they are so many; says so on stderr."""
    # a folder that cannot be written, or a file system without locks
    with contextlib.suppress(OSError):
        marks = {module: _mark(module) for module in modules}
        done = compiled_code() / DONE
        if len(_missing(marks, done)) < least:
            return
        done.parent.mkdir(parents=True, exist_ok=True)
        with done.open("a+", encoding="utf-8") as file:
            _say(len(marks))
            # what another program compiles meanwhile is waited for
            fcntl.flock(file, fcntl.LOCK_EX)
            missing = _missing(marks, done)
            _compile_all(missing)
            _note(file, marks.values())


def _compile_all(modules: Sequence[str]) -> None:
    """Compile the kernels of modules in as many processes as there are cores."""
    with (
        Workers(
            min(available_cores(), MOST_PROCESSES, len(modules)), time_limit=TIME_LIMIT
        ) as workers,
        contextlib.closing(workers.run(compile_kernels, modules)) as ends,
    ):
        for _ in ends:  # errors show again where the kernel is called
            pass


def compile_kernels(name: str) -> None:
    """Compile the kernels of a module one after the other into the cache."""
    gc.disable()  # what compiling leaves behind ends with the process
    _save_in_turn(compiled_code() / LOCK)
    for kernel in kernels_of(name):
        kernel.compile(argument_types(kernel))


def kernels_of(name: str) -> list[Any]:
    """The kernels of a module that are called from Python."""
    members = vars(importlib.import_module(name)).values()
    return [
        each
        for each in members
        if getattr(each, "ahead", False) and each.py_func.__module__ == name
    ]


def _save_in_turn(lock: Path) -> None:
    """Let one process at a time touch the cache.

    Two that save the same function for different types at once can leave one's code under the
    other's name, and code is on disk a moment after the index tells of it.
    """

    def in_turn(method: Callable[..., Any]) -> Callable[..., Any]:
        def alone(*given: Any) -> Any:
            with lock.open("a") as file:
                fcntl.flock(file, fcntl.LOCK_EX)
                return method(*given)

        return alone

    cache: Any = IndexDataCacheFile
    cache.save, cache.load = in_turn(_SAVE), in_turn(_LOAD)


def _mark(module: str) -> str:
    """What stands for a module in the list of what has been done.

    Another one when numba would compile it anew.
    """
    source = Path(__file__).parents[2].joinpath(*module.split(".")).with_suffix(".py")
    state = (
        module,
        source_stamp(source),
        numba.__version__,
        sys.implementation.cache_tag,
        processor(),
    )
    return hashlib.sha256(repr(state).encode()).hexdigest()[:16]


def _missing(marks: dict[str, str], done: Path) -> list[str]:
    known: list[str] = []
    if done.exists():
        known = done.read_text(encoding="utf-8").split()
    return [module for module, mark in marks.items() if mark not in known]


def _note(file: TextIO, marks: Iterable[str]) -> None:
    """Keep what has been done; what has become of earlier versions is of no interest."""
    file.seek(0)
    kept = {_mark(module) for module in every_module()} & set(file.read().split())
    file.truncate(0)
    file.write("\n".join(sorted(kept | set(marks))) + "\n")


def _say(modules: int) -> None:
    seconds = SECONDS * modules / min(available_cores(), MOST_PROCESSES) + 2.0
    sys.stderr.write(
        f"note: compiling the kernels of {modules} modules, about {seconds:.0f} s; "
        f"they are kept in {compiled_code()} for next time\n"
    )
    sys.stderr.flush()
