"""Scripts that are told to stop."""

import os
import signal
from collections.abc import Iterator

import pytest

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
    yield
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
