"""Kernels say how deliveries call them, and compiling them ahead leaves them in the cache, once."""

import fcntl
import subprocess
import sys
import threading

import pytest

from harness.study import compile_ahead as module
from harness.study.compile_ahead import compile_ahead, kernels_of, needed_modules
from harness.task.stack import load_stack
from navstack.jit import argument_types

MODULES = ["navstack.costmap.spread_kernels", "navstack.localization.kld", "harness.world.gone"]
STACKS = (
    "paper-gps",
    "nav2-amcl-gps",
    "rpp-gps-ekf",
    "graceful-gps-ekf",
    "mppi-gps-ekf",
    "mpc-gps-ekf",
    "evasive-gps-ekf",
)
# Drives the first seconds of a delivery of each stack, in a process of its own, and prints the
# kernels called from Python: stack, module, name, types. The map is read once for all of them.
DRIVE = """
import os
import sys
import tempfile
from pathlib import Path

from numba.core.dispatcher import Dispatcher

compile_for_args = Dispatcher._compile_for_args


def noted(kernel, *given):
    types = [str(kernel.typeof_pyval(each)) for each in given]
    print("called by", stack, kernel.py_func.__module__, kernel.py_func.__qualname__, types)
    return compile_for_args(kernel, *given)


Dispatcher._compile_for_args = noted
from harness.episode.factory import scene_of
from tools.bench.loops import Course, Loop, drive

stack = "none"
scene_of("sidewalk")
for stack in sys.argv[1:]:
    process = os.fork()
    if not process:
        drive(Course(Loop(stack, stack, False, 1.0), Path(tempfile.mkdtemp()), seconds=3.0).task(0))
        sys.stdout.flush()
        os._exit(0)
    if os.waitpid(process, 0)[1]:
        sys.exit(stack)
"""


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """An empty cache, and a few modules, one of which does not exist."""
    folder = tmp_path / "cache"
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(folder))
    monkeypatch.setattr(module, "LEAST", 1)
    monkeypatch.setattr(module, "available_cores", lambda: 2)
    monkeypatch.setattr(module, "needed_modules", lambda stacks: MODULES)
    monkeypatch.setattr(module, "_modules_of", lambda entries: MODULES)
    stamp = module.source_stamp
    monkeypatch.setattr(
        module, "source_stamp", lambda source: stamp(source) if source.is_file() else b""
    )
    return folder


def test_every_listed_module_has_kernels():
    names = module.every_module()
    assert "navstack.localization.amcl_kernels" in names
    for name in names:
        assert kernels_of(name), name


def test_modules_follow_the_stack():
    def modules(stack):
        return {name.removeprefix("navstack.") for name in needed_modules([load_stack(stack)])}

    assert "control.dwb.choice_kernels" in modules("paper-gps") & modules("nav2-amcl")
    assert "localization.amcl_kernels" in modules("nav2-amcl") - modules("paper-gps")
    assert not any(
        name.startswith(("control.dwb", "planning", "safety")) for name in modules("parked")
    )
    assert needed_modules([]) == []


@pytest.mark.slow
def test_kernels_are_compiled_once(cache, capsys):
    compile_ahead([load_stack("parked")])
    compiled = {path.name.split("-")[0] for path in cache.rglob("*.nbi")}
    assert compiled >= {"spread_kernels.measure_columns", "spread_kernels.spread", "kld.resample"}
    assert "compiling the kernels of 3 modules" in capsys.readouterr().err
    compile_ahead([load_stack("parked")])  # that one of them does not exist is not tried again
    assert capsys.readouterr().err == ""


def test_changed_source_counts_as_new(cache, monkeypatch):
    compiled = []
    monkeypatch.setattr(module, "_compile_all", compiled.extend)
    for stamp in (b"", b"", b"changed"):
        monkeypatch.setattr(module, "source_stamp", lambda _, stamp=stamp: stamp)
        compile_ahead([load_stack("parked")])
    assert compiled == 2 * MODULES
    assert len((cache / module.DONE).read_text().split()) == len(MODULES)  # old marks are dropped


def test_folder_that_cannot_be_written_changes_nothing(cache, capsys, monkeypatch):
    cache.write_text("no folder")
    monkeypatch.setattr(
        module, "_compile_all", lambda _: pytest.fail("compiled what cannot be kept")
    )
    compile_ahead([load_stack("parked")])
    assert capsys.readouterr().err == ""


def test_second_program_waits_for_the_first(cache, monkeypatch):
    compiled = []
    monkeypatch.setattr(module, "_compile_all", lambda modules: compiled.append(len(modules)))
    cache.mkdir()
    done = cache / module.DONE
    with done.open("a+") as first:
        fcntl.flock(first, fcntl.LOCK_EX)
        second = threading.Thread(target=compile_ahead, args=([load_stack("parked")],))
        second.start()
        second.join(0.5)
        assert second.is_alive()
        module._note(first, [module._mark(name) for name in MODULES])
    second.join(10.0)
    assert compiled == [0]


@pytest.fixture(scope="module")
def calls():
    """The lines of :data:`DRIVE`."""
    command = [sys.executable, "-c", DRIVE, *STACKS]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()


@pytest.mark.slow
@pytest.mark.parametrize("stack", STACKS)
def test_kernels_say_the_types_with_which_deliveries_call_them(stack, calls):
    assert not any(line.startswith("called by none ") for line in calls), "the map calls kernels"
    called = {line for line in calls if line.startswith(f"called by {stack} ")}
    needed = [
        (name, kernel)
        for name in needed_modules([load_stack(stack)])
        for kernel in kernels_of(name)
    ]
    listed = {
        f"called by {stack} {name} {kernel.py_func.__qualname__} "
        f"{[str(one) for one in argument_types(kernel)]}"
        for name, kernel in needed
    }
    assert called
    assert called <= listed, "a registry entry lacks a module, or a kernel its types"
