"""Scripts that are told to stop."""

import contextlib
import ctypes
import errno
import os
import signal
import sys
import time
from collections.abc import Iterator

import click
import pytest

from navbench.cli.app import main
from navbench.cli.signals import run_script


@pytest.fixture(autouse=True)
def handlers() -> Iterator[None]:
    """A process's own handlers, whatever other tests' libraries have put there.

    Afterwards theirs again.
    """
    own = {
        signal.SIGTERM: signal.SIG_DFL,
        signal.SIGHUP: signal.SIG_DFL,
        signal.SIGINT: signal.default_int_handler,
    }
    before = {number: signal.signal(number, handler) for number, handler in own.items()}
    hook = sys.unraisablehook
    yield
    sys.unraisablehook = hook
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.parametrize("name", ["SIGTERM", "SIGHUP", "SIGINT"])
def test_a_script_that_is_told_to_stop_leaves_in_one_line(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as leaving:
        run_script(lambda: os.kill(os.getpid(), getattr(signal, name)))
    assert leaving.value.code == 130 and capsys.readouterr().err == "interrupted\n"


def test_a_script_that_ends_by_itself_is_left_alone() -> None:
    calls: list[str] = []
    run_script(lambda: calls.append("main"))
    assert calls == ["main"]


def test_a_signal_that_the_caller_ignores_stays_ignored() -> None:
    signal.signal(signal.SIGHUP, signal.SIG_IGN)  # as nohup does
    run_script(lambda: os.kill(os.getpid(), signal.SIGHUP))
    assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN


@click.command()
def compiling() -> None:
    """Lose an interrupt in a callback of compiled code, as LLVM calls numba back."""
    call = ctypes.CFUNCTYPE(None)
    call(lambda: os.kill(os.getpid(), signal.SIGINT))()
    raise RuntimeError("no compiled object yet")


@click.command()
def driving() -> None:
    """Lose an interrupt without any error."""
    call = ctypes.CFUNCTYPE(None)
    call(lambda: os.kill(os.getpid(), signal.SIGTERM))()
    time.sleep(30.0)


@pytest.mark.parametrize("command", [compiling, driving])
def test_an_interrupt_that_a_library_loses_is_one(
    command: click.Command, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as leaving:
        main([], command)
    assert leaving.value.code == 130
    assert capsys.readouterr().err.strip() == "navbench: interrupted"
    time.sleep(0.25)  # nothing comes afterwards


@click.command()
def broken() -> None:
    """Fail by itself."""
    raise RuntimeError("a fault of the program")


def test_an_error_is_no_interrupt() -> None:
    with pytest.raises(RuntimeError, match="a fault"):
        main([], broken)


@click.command()
def summing_up() -> None:
    """Obey an interrupt, and find no room for what is kept."""
    with contextlib.suppress(KeyboardInterrupt):
        os.kill(os.getpid(), signal.SIGINT)
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def test_a_full_disk_after_an_interrupt_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as leaving:
        main([], summing_up)
    assert leaving.value.code == 1
    assert "No space left on device" in capsys.readouterr().err
