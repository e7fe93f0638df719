"""What comes over from a policy's process is numbers and texts, whatever it sends."""

import math
import pickle
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from harness.policy.answers import (
    FARTHEST,
    MOST_BYTES,
    MOST_WAYPOINTS,
    AnswerError,
    packed,
    packed_error,
    unpacked,
)
from harness.policy.interface import PolicyError, PolicyObservation
from harness.policy.process import PolicyProcess
from harness.task.stack import PolicyParams

EMPTY = np.empty(0)
SEEN = PolicyObservation(
    0.0, np.zeros(3), np.zeros((10, 2)), np.zeros(3), np.zeros(2), EMPTY, EMPTY, EMPTY, EMPTY
)
SENDER = '''
import os
import pickle
import sys

import numpy as np


class Runs:
    """Leaves a file wherever it is unpickled."""

    def __reduce__(self):
        return open, ({ran!r}, "w")


class Raw:
    """Sends bytes of its own in place of the answer."""

    def reset(self, seed):
        pass

    def act(self, seen):
        content = {content}
        fd = int(sys.argv[1])
        os.write(fd, len(content).to_bytes(4, "big") + content)
        return 0.0, 0.0


class Answers(Raw):
    def act(self, seen):
        return {content}
'''


@pytest.fixture
def process(tmp_path: Path) -> Callable[[str, str], PolicyProcess]:
    """A policy that sends or answers the value of an expression."""

    def make(name: str, content: str) -> PolicyProcess:
        text = SENDER.format(content=content, ran=str(tmp_path / "ran"))
        (tmp_path / "sender.py").write_text(text)
        policy = PolicyProcess(f"{tmp_path / 'sender.py'}:{name}", PolicyParams())
        policy.reset(0)
        return policy

    return make


@pytest.mark.parametrize(
    "answer",
    [(0.5, -1.25), (0.0, -0.0), (FARTHEST, -FARTHEST), [(1.0, 2.0)], [(1e-300, 2.0)] * 9],
)
def test_numbers_come_over_to_the_last_bit(answer: object) -> None:
    given = np.array(answer)
    found = unpacked(packed(given))
    assert isinstance(found, np.ndarray)
    assert found.dtype == np.float64 and found.shape == given.shape
    assert found.tobytes() == given.tobytes()


def test_the_most_waypoints_and_the_longest_text_fit() -> None:
    assert len(packed(np.zeros((MOST_WAYPOINTS, 2)))) <= MOST_BYTES
    assert len(packed_error("🤖" * 2000)) <= MOST_BYTES
    assert unpacked(packed_error("🤖" * 2000)) == "🤖" * 1000
    assert unpacked(packed_error("no \udcff")) == r"no \udcff"
    assert unpacked(packed(None)) is None


@pytest.mark.parametrize(
    ("answer", "told"),
    [
        (np.zeros(3), r"shape \(3,\)"),
        (np.zeros((0, 2)), r"shape \(0, 2\)"),
        (np.zeros((2, 2, 2)), r"shape \(2, 2, 2\)"),
        (np.array(1.0), r"shape \(\)"),
        (np.array((math.inf, 0.0)), "not finite"),
        (np.array(((0.0, 0.0), (0.0, math.nan))), "not finite"),
        (np.array(((1e300, 1e300),)), r"the number 1e\+300; .* go up to 1e\+06"),
        (np.array((0.0, -1.1e6)), r"the number 1\.1e\+06"),
        (np.zeros((MOST_WAYPOINTS + 1, 2)), "10001 waypoints; at most 10000"),
    ],
)
def test_what_cannot_be_driven_is_neither_sent_nor_taken(answer: np.ndarray, told: str) -> None:
    with pytest.raises(AnswerError, match=told):
        packed(answer)


def message(kind: bytes, *numbers: float) -> bytes:
    return struct.pack(f"<cI{len(numbers)}d", kind, 8 * len(numbers), *numbers)


@pytest.mark.parametrize(
    "sent",
    [
        b"",
        b"V",
        pickle.dumps((True, None)),
        message(b"X", 1.0, 2.0),
        message(b"V", 1.0),
        message(b"V", 1.0, 2.0, 3.0, 4.0),
        message(b"V"),
        message(b"W"),
        message(b"W", 1.0, 2.0, 3.0),
        message(b"W", 1e300, 1e300),
        message(b"V", math.nan, 0.0),
        message(b"D", 1.0),
        message(b"V", 1.0, 2.0)[:-1],
        message(b"V", 1.0, 2.0) + b"\0",
        struct.pack("<cI", b"W", 2**32 - 1),
    ],
)
def test_other_bytes_are_no_answer(sent: bytes) -> None:
    with pytest.raises(AnswerError):
        unpacked(sent)


@pytest.mark.parametrize(
    ("content", "told"),
    [
        ("pickle.dumps((True, Runs()))", "answered with .* bytes that are no answer"),
        ("pickle.dumps(Runs())", "answered with .* bytes that are no answer"),
        ("b''", "answered with 0 bytes that are no answer"),
        ("b'D' + bytes(4)", "answered nothing where it was asked to act"),
        (f"bytes({MOST_BYTES + 1})[:60000] * 4", f"answered with more than {MOST_BYTES} bytes"),
    ],
)
def test_nothing_that_a_policy_sends_is_executed(
    process: Callable[[str, str], PolicyProcess], tmp_path: Path, content: str, told: str
) -> None:
    with pytest.raises(PolicyError, match=told) as caught:
        process("Raw", content).act(SEEN)
    assert "sender.py:Raw" in str(caught.value) and "\n" not in str(caught.value)
    assert not (tmp_path / "ran").exists()


@pytest.mark.parametrize("content", ["[[1e300, 1e300]]", "[1e300, 0.0]", "np.full((9, 2), -2e6)"])
def test_an_answer_beyond_all_measure_is_a_line_that_names_the_policy(
    process: Callable[[str, str], PolicyProcess], content: str
) -> None:
    with pytest.raises(PolicyError, match=r"sender\.py:Answers: act: .*go up to 1e\+06"):
        process("Answers", content).act(SEEN)
