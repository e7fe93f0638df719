"""The table of kernels holds what deliveries call, and compiling them ahead leaves them in the cache, once."""

import fcntl
import importlib
import inspect
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from numba import types

from harness.study import compile_ahead as module
from harness.study.compile_ahead import ALWAYS, Kernel, compile_ahead, load_table, needed_kernels
from harness.task.stack import load_stack
from navstack import jit

TO_CELL = "(float64, float64, float64, float64, float64, int64, int64)"
KERNELS = [
    Kernel("navstack.costmap.kernels", "to_cell", TO_CELL),
    Kernel("navstack.control.dwb.kernels", "sine_cosine", "(float64,)"),
    Kernel("harness.world.lidar_kernels", "gone", "(float64,)"),
]
# Drives the first seconds of a delivery and prints the kernels called from Python: module, name, types.
DRIVE = """
import sys
import tempfile
from pathlib import Path

from numba.core.dispatcher import Dispatcher

compile_for_args = Dispatcher._compile_for_args


def noted(kernel, *given):
    types = [str(kernel.typeof_pyval(each)) for each in given]
    print("called", kernel.py_func.__module__, kernel.py_func.__qualname__, types)
    return compile_for_args(kernel, *given)


Dispatcher._compile_for_args = noted
from harness.bench.loops import Course, Loop, drive

drive(Course(Loop(sys.argv[1], sys.argv[1], False, 1.0), Path(tempfile.mkdtemp()), seconds=5.0).task(0))
"""


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty cache, and a table of a few kernels, one of which does not exist."""
    folder = tmp_path / "cache"
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(folder))
    monkeypatch.setattr(module, "LEAST", 1)
    monkeypatch.setattr(module, "available_cores", lambda: 2)
    monkeypatch.setattr(module, "load_table", lambda: dict.fromkeys(KERNELS, frozenset({ALWAYS})))
    return folder


def test_table_is_in_numbas_notation() -> None:
    for kernel in load_table():
        function = getattr(importlib.import_module(kernel.module), kernel.name).py_func
        assert len(argument_types(kernel)) == len(inspect.signature(function).parameters), kernel
        assert kernel.source.is_file()


def test_sections_follow_the_stack() -> None:
    def modules(stack: str) -> set[str]:
        return {kernel.module.removeprefix("navstack.") for kernel in needed_kernels([load_stack(stack)])}

    assert "control.dwb.choice_kernels" in modules("paper-gps") & modules("nav2-amcl")
    assert "localization.amcl_kernels" in modules("nav2-amcl") - modules("paper-gps")
    assert not any(name.startswith(("control.dwb", "planning")) for name in modules("parked"))
    assert needed_kernels([]) == []


def test_kernels_are_compiled_once(cache: Path, capsys: pytest.CaptureFixture[str]) -> None:
    compile_ahead([load_stack("parked")])
    assert {path.name.split("-")[0] for path in cache.rglob("*.nbi")} >= {"kernels.to_cell", "kernels.sine_cosine"}
    assert "compiling 3 kernels" in capsys.readouterr().err
    compile_ahead([load_stack("parked")])  # that one of them cannot be compiled is not tried again
    assert capsys.readouterr().err == ""


def test_changed_source_counts_as_new(cache: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    compiled: list[str] = []
    monkeypatch.setattr(module, "_compile_all", lambda kernels: compiled.extend(kernel.name for kernel in kernels))
    source = tmp_path / "source.py"
    source.write_text("")
    monkeypatch.setattr(Kernel, "source", property(lambda _: source))
    for text in ("", "", "changed"):
        source.write_text(text)
        for seen in (jit.source_stamp, jit._content, jit._imported):  # as a new process sees it
            seen.cache_clear()
        compile_ahead([load_stack("parked")])
    assert compiled == 2 * [kernel.name for kernel in KERNELS]
    assert len((cache / module.DONE).read_text().split()) == len(KERNELS)  # old marks are dropped


def test_folder_that_cannot_be_written_changes_nothing(
    cache: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    cache.write_text("no folder")
    monkeypatch.setattr(module, "_compile_all", lambda _: pytest.fail("compiled what cannot be kept"))
    compile_ahead([load_stack("parked")])
    assert capsys.readouterr().err == ""


def test_second_program_waits_for_the_first(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    compiled: list[int] = []
    monkeypatch.setattr(module, "_compile_all", lambda kernels: compiled.append(len(kernels)))
    cache.mkdir()
    done = cache / module.DONE
    with done.open("a+") as first:
        fcntl.flock(first, fcntl.LOCK_EX)
        second = threading.Thread(target=compile_ahead, args=([load_stack("parked")],))
        second.start()
        second.join(0.5)
        assert second.is_alive()
        module._note(first, [module._mark(kernel) for kernel in KERNELS])
    second.join(10.0)
    assert compiled == [0]


@pytest.mark.slow
@pytest.mark.parametrize("stack", ["paper-gps", "nav2-amcl-gps", "rpp-gps-ekf", "mppi-gps-ekf", "mpc-gps-ekf"])
def test_table_holds_what_deliveries_call(stack: str) -> None:
    command = [sys.executable, "-c", DRIVE, stack]
    lines = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()
    called = {line for line in lines if line.startswith("called ")}
    needed = needed_kernels([load_stack(stack)])
    listed = {f"called {each.module} {each.name} {[str(one) for one in argument_types(each)]}" for each in needed}
    assert called
    assert called <= listed, f"{module.TABLE.name} lacks what is called"


def argument_types(kernel: Kernel) -> tuple[types.Type, ...]:
    found: tuple[types.Type, ...] = eval(kernel.arguments, vars(importlib.import_module(kernel.module)), vars(types))
    return found
