"""Copies of a process go on from where it is, and leave it as it is."""

import os
import signal
import sys
import threading
import time
from functools import partial

import pytest

from harness.execution.copies import CopyError, PausedCopy, in_a_copy


def test_a_copy_changes_nothing_here() -> None:
    numbers = [1]

    def work() -> list[int]:
        numbers.append(2)
        return numbers

    assert in_a_copy(work) == [1, 2]
    assert numbers == [1]


def test_what_a_copy_raises_is_told() -> None:
    with pytest.raises(CopyError, match="ZeroDivisionError"):
        in_a_copy(lambda: 1 / 0)


def test_a_copy_that_dies_is_told() -> None:
    with pytest.raises(CopyError, match="died"):
        in_a_copy(lambda: os._exit(1))


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere a copy ends after its job")
def test_a_copy_ends_with_the_process_that_made_it() -> None:
    reading, writing = os.pipe()  # the copies keep it open

    def die_while_the_copy_works() -> None:
        threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGKILL)).start()
        in_a_copy(partial(time.sleep, 60.0))

    began = time.monotonic()
    with pytest.raises(CopyError, match="died"):
        in_a_copy(die_while_the_copy_works)
    os.close(writing)
    with open(reading, "rb") as file:
        assert file.read() == b""
    assert time.monotonic() - began < 50.0


def test_paused_copies_know_what_was_when_they_were_made() -> None:
    numbers: list[int] = []

    def work(job: int) -> list[int]:
        numbers.append(job)
        return numbers

    copies: list[PausedCopy[int, list[int]]] = []
    for number in range(3):
        copies.append(PausedCopy(work, copies))
        numbers.append(number)
    assert copies[2].ask([8, 9]) == [[0, 1, 8], [0, 1, 9]]
    assert copies[0].ask([7]) == [[7]]
    copies[1].close()
    with pytest.raises(ChildProcessError):
        os.waitpid(copies[1]._pid, os.WNOHANG)
    assert numbers == [0, 1, 2]
