"""Scripts that are told to stop."""

import os
import signal

import pytest

from harness.signals import run_script


@pytest.mark.parametrize("name", ["SIGTERM", "SIGINT"])
def test_a_script_that_is_told_to_stop_leaves_in_one_line(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    before = {number: signal.getsignal(number) for number in (signal.SIGTERM, signal.SIGHUP)}
    try:
        with pytest.raises(SystemExit) as leaving:
            run_script(lambda: os.kill(os.getpid(), getattr(signal, name)))
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    assert leaving.value.code == 130 and capsys.readouterr().err == "interrupted\n"


def test_a_script_that_ends_by_itself_is_left_alone() -> None:
    before = {number: signal.getsignal(number) for number in (signal.SIGTERM, signal.SIGHUP)}
    calls: list[str] = []
    try:
        run_script(lambda: calls.append("main"))
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    assert calls == ["main"]
