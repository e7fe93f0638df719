"""What comes over from a policy's process is numbers and texts, whatever it sends."""

import dataclasses
import io
import math
import pickle
import struct
import time
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
    received,
)
from harness.policy.interface import PolicyError, PolicyObservation
from harness.policy.process import PolicyProcess
from harness.task.stack import PolicyParams

EMPTY = np.empty(0)
LIMIT = 3.0  # [s] of an answer
HEADER = 5  # [bytes]
SEEN = PolicyObservation(
    0.0,
    np.zeros(3),
    np.zeros((10, 2)),
    np.zeros(3),
    np.zeros(2),
    EMPTY,
    EMPTY,
    EMPTY,
    EMPTY,
)
SENDER = '''
import os
import pickle
import sys
import time

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
        os.write(int(sys.argv[1]), {content})
        time.sleep({seconds})
        return 0.0, 0.0


class Answers(Raw):
    def act(self, seen):
        return {content}
'''


def unpacked(sent: bytes) -> object:
    """What bytes say."""
    stream = io.BytesIO(sent)

    def read(size: int) -> bytes:
        content = stream.read(size)
        if len(content) < size:
            raise AnswerError("cut off")
        return content

    return received(read)


@pytest.fixture
def process(tmp_path: Path) -> Callable[..., PolicyProcess]:
    """A policy that sends or answers the value of an expression."""

    def make(name: str, content: str, seconds: float = 0.0) -> PolicyProcess:
        text = SENDER.format(content=content, ran=str(tmp_path / "ran"), seconds=seconds)
        (tmp_path / "sender.py").write_text(text)
        params = PolicyParams(time_limit=LIMIT)
        policy = PolicyProcess(f"{tmp_path / 'sender.py'}:{name}", params)
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
    assert len(packed(np.zeros((MOST_WAYPOINTS, 2)))) <= HEADER + MOST_BYTES
    assert len(packed_error("🤖" * 2000)) <= HEADER + MOST_BYTES
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
        struct.pack("<cI", b"W", 2**32 - 1),
    ],
)
def test_other_bytes_are_no_answer(sent: bytes) -> None:
    with pytest.raises(AnswerError):
        unpacked(sent)


@pytest.mark.parametrize(
    ("content", "told"),
    [
        ("pickle.dumps((True, Runs()))", "answered with bytes that are no answer"),
        ("pickle.dumps(Runs())", "answered with bytes that are no answer"),
        ("b'D' + bytes(4)", "answered nothing where it was asked to act"),
        ("b'W' + bytes(4)", r"answered with an answer of shape \(0, 2\)"),
        ("b'W' + b'\\xff' * 60000", "answered with bytes that are no answer"),
    ],
)
def test_nothing_that_a_policy_sends_is_executed(
    process: Callable[..., PolicyProcess],
    tmp_path: Path,
    content: str,
    told: str,
) -> None:
    with pytest.raises(PolicyError, match=told) as caught:
        process("Raw", content).act(SEEN)
    assert "sender.py:Raw" in str(caught.value) and "\n" not in str(caught.value)
    assert not (tmp_path / "ran").exists()


@pytest.mark.parametrize("content", ["[[1e300, 1e300]]", "[1e300, 0.0]", "np.full((9, 2), -2e6)"])
def test_an_answer_beyond_all_measure_is_a_line_that_names_the_policy(
    process: Callable[..., PolicyProcess], content: str
) -> None:
    with pytest.raises(PolicyError, match=r"sender\.py:Answers: act: .*go up to 1e\+06"):
        process("Answers", content).act(SEEN)


WHOLE = "b'V' + (16).to_bytes(4, 'little') + bytes(16)"


@pytest.mark.parametrize("size", [1, HEADER, HEADER + 15])
def test_half_an_answer_is_waited_for_no_longer_than_a_whole_one(
    process: Callable[..., PolicyProcess], size: int
) -> None:
    policy = process("Raw", f"({WHOLE})[:{size}]", 1e6)
    began = time.monotonic()
    with pytest.raises(PolicyError, match=f"did not answer within {LIMIT:g} s"):
        policy.act(SEEN)
    assert LIMIT <= time.monotonic() - began < LIMIT + 10.0


def test_a_policy_that_reads_nothing_is_not_waited_for(
    process: Callable[..., PolicyProcess],
) -> None:
    picture = dataclasses.replace(SEEN, image=np.zeros((2000, 2000, 3), dtype=np.uint8))
    policy = process("Raw", f"{WHOLE}", 1e6)
    policy.act(SEEN)
    with pytest.raises(PolicyError, match=f"did not answer within {LIMIT:g} s"):
        policy.act(picture)


def test_what_is_left_of_an_answer_is_not_taken_for_the_next(
    process: Callable[..., PolicyProcess],
) -> None:
    policy = process("Raw", f"({WHOLE}) * 2", 1e6)
    policy.act(SEEN)
    with pytest.raises(PolicyError, match="answered with more bytes than one answer"):
        policy.act(SEEN)
