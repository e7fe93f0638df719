"""Answers of a policy's process as bytes: a header and raw numbers, or a text.

Nothing of them is unpickled: a policy is somebody's program, and does not decide what runs here.
"""

import struct
from collections.abc import Callable

import numpy as np

from harness.storage.texts import LONGEST_TEXT, clean_text
from navstack.types import FloatArray

DONE, VELOCITY, WAYPOINTS, ERROR = KINDS = b"D", b"V", b"W", b"E"
_HEADER = struct.Struct("<cI")  # the kind, and the number of bytes that follow
NUMBER = np.dtype("<f8")
MOST_WAYPOINTS = 10_000
FARTHEST = 1e6  # [m], [m/s] or [rad/s] of a number in an answer
# [bytes] of an answer after its header; a character of UTF-8 has four at most
MOST_BYTES = max(MOST_WAYPOINTS * 2 * NUMBER.itemsize, 4 * LONGEST_TEXT)


class AnswerError(ValueError):
    """What was answered is none of the answers that a policy can give."""


def check(answer: FloatArray) -> None:
    """Check that an answer can be driven.

    Raises:
        AnswerError: it is neither a velocity nor waypoints, or not of this world.
    """
    if answer.shape != (2,) and not (answer.ndim == 2 and answer.shape[1] == 2 and len(answer)):
        raise AnswerError(
            f"an answer of shape {answer.shape}; a velocity has (2,), waypoints have (k, 2)"
        )
    if answer.ndim == 2 and len(answer) > MOST_WAYPOINTS:
        raise AnswerError(f"{len(answer)} waypoints; at most {MOST_WAYPOINTS} are followed")
    if not np.isfinite(answer).all():
        raise AnswerError("an answer that is not finite")
    if (farthest := float(np.abs(answer).max())) > FARTHEST:
        raise AnswerError(
            f"an answer with the number {farthest:g}; metres, m/s and rad/s go up to {FARTHEST:g}"
        )


def packed(answer: FloatArray | None) -> bytes:
    """An answer (None: done as asked) as bytes.

    Raises:
        AnswerError: it cannot be driven.
    """
    if answer is None:
        return _HEADER.pack(DONE, 0)
    check(answer)
    numbers = np.ascontiguousarray(answer, dtype=NUMBER).tobytes()
    return _HEADER.pack(VELOCITY if answer.ndim == 1 else WAYPOINTS, len(numbers)) + numbers


def packed_error(text: str) -> bytes:
    """What went wrong as bytes."""
    content = clean_text(text).encode()
    return _HEADER.pack(ERROR, len(content)) + content


def received(read: Callable[[int], bytes]) -> FloatArray | str | None:
    """The numbers of an answer, the text of an error, or None: done as asked.

    Args:
        read: takes a number of bytes, and returns as many.

    Raises:
        AnswerError: the bytes are no answer, or it cannot be driven.
    """
    kind, length = _HEADER.unpack(read(_HEADER.size))
    if kind not in KINDS or length > MOST_BYTES:
        raise AnswerError("bytes that are no answer")
    content = read(length)
    if kind == ERROR:
        return clean_text(content.decode("utf-8", "backslashreplace"))
    if kind == DONE and not length:
        return None
    if kind == DONE or length % (2 * NUMBER.itemsize):
        raise AnswerError(f"{length} bytes that are no answer")
    numbers = np.frombuffer(content, NUMBER).astype(np.float64)
    answer = numbers
    if kind == WAYPOINTS:
        answer = numbers.reshape(-1, 2)
    check(answer)
    return answer
